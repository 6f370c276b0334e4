//! Strain, stress and stiffness at one integration point, for any element.
//!
//! One-letter names as in the formulas: H displacement gradient, F = I + H, S second Piola-Kirchhoff stress,
//! g_a gradient of the shape function of node a in the reference configuration.

use super::Inverted;
use crate::material::StVenantKirchhoff;

/// Pairs of axes of the shear components in Voigt order.
pub(crate) const SHEAR: [(usize, usize); 3] = [(0, 1), (1, 2), (2, 0)];

/// An integration point: its volume and the shape gradients there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point<const D: usize, const N: usize> {
    /// m3 (m2 in 2-D).
    pub(crate) weight: f64,
    /// `[N, D]` 1/m.
    pub(crate) gradient: [[f64; D]; N],
}

impl<const D: usize, const N: usize> Point<D, N> {
    /// H_ij = sum_a u_ai g_aj.
    #[inline]
    pub(crate) fn displacement_gradient(&self, displacement: &[f64]) -> [[f64; D]; D] {
        let mut gradient = [[0.0; D]; D];
        for a in 0..N {
            for i in 0..D {
                let u = displacement[a * D + i];
                for j in 0..D {
                    gradient[i][j] += u * self.gradient[a][j];
                }
            }
        }
        gradient
    }

    /// f_a += w P g_a.
    #[inline]
    pub(crate) fn add_force(&self, first_pk_stress: &[[f64; D]; D], force: &mut [f64]) {
        for a in 0..N {
            for i in 0..D {
                let mut sum = 0.0;
                for j in 0..D {
                    sum += first_pk_stress[i][j] * self.gradient[a][j];
                }
                force[a * D + i] += self.weight * sum;
            }
        }
    }

    /// Adds the blocks b >= a of the tangent of St.Venant-Kirchhoff,
    /// K_ab += w [ lambda (F g_a)(F g_b)' + mu ((g_a.g_b) F F' + (F g_b)(F g_a)') + (g_a.S g_b) I ].
    #[inline]
    pub(crate) fn add_tangent(
        &self,
        material: &StVenantKirchhoff,
        deformation: &[[f64; D]; D],
        stress: &[[f64; D]; D],
        tangent: &mut [f64],
    ) {
        let (lambda, mu) = (self.weight * material.lambda, self.weight * material.mu);
        let turned: [[f64; D]; N] = std::array::from_fn(|a| times(deformation, &self.gradient[a]));
        let stressed: [[f64; D]; N] = std::array::from_fn(|a| times(stress, &self.gradient[a]));
        let mut finger = [[0.0; D]; D];
        for i in 0..D {
            for j in 0..D {
                for k in 0..D {
                    finger[i][j] += deformation[i][k] * deformation[j][k];
                }
            }
        }
        for a in 0..N {
            for b in a..N {
                let near = mu * dot(&self.gradient[a], &self.gradient[b]);
                let initial = self.weight * dot(&self.gradient[a], &stressed[b]);
                for i in 0..D {
                    let row = &mut tangent[(a * D + i) * N * D + b * D..][..D];
                    for j in 0..D {
                        row[j] += lambda * turned[a][i] * turned[b][j]
                            + mu * turned[b][i] * turned[a][j]
                            + near * finger[i][j];
                    }
                    row[i] += initial;
                }
            }
        }
    }
}

/// Copies the blocks b > a below the diagonal.
#[inline]
pub(crate) fn mirror<const D: usize, const N: usize>(tangent: &mut [f64]) {
    let size = N * D;
    for row in 0..size {
        for column in 0..row / D * D {
            tangent[row * size + column] = tangent[column * size + row];
        }
    }
}

/// E = (H + H' + H'H)/2 in Voigt order with engineering shear.
#[inline]
pub(crate) fn green_lagrange_strain<const D: usize, const S: usize>(gradient: &[[f64; D]; D]) -> [f64; S] {
    let mut strain = [0.0; S];
    for i in 0..D {
        let mut square = 0.0;
        for k in 0..D {
            square += gradient[k][i] * gradient[k][i];
        }
        strain[i] = gradient[i][i] + 0.5 * square;
    }
    for shear in D..S {
        let (i, j) = SHEAR[shear - D];
        let mut product = 0.0;
        for k in 0..D {
            product += gradient[k][i] * gradient[k][j];
        }
        strain[shear] = gradient[i][j] + gradient[j][i] + product;
    }
    strain
}

/// F = I + H.
///
/// # Errors
/// [`Inverted`] when det F <= 0.
#[inline]
pub(crate) fn deformation_gradient<const D: usize>(
    gradient: &[[f64; D]; D],
) -> Result<[[f64; D]; D], Inverted> {
    let mut deformation = *gradient;
    for i in 0..D {
        deformation[i][i] += 1.0;
    }
    let determinant = determinant(&deformation);
    // Written so that a determinant that is not a number is refused too.
    if determinant > 0.0 { Ok(deformation) } else { Err(Inverted(determinant)) }
}

/// Symmetric tensor of a stress in Voigt order.
#[inline]
pub(crate) fn stress_tensor<const D: usize, const S: usize>(voigt: &[f64; S]) -> [[f64; D]; D] {
    let mut tensor = [[0.0; D]; D];
    for i in 0..D {
        tensor[i][i] = voigt[i];
    }
    for shear in D..S {
        let (i, j) = SHEAR[shear - D];
        (tensor[i][j], tensor[j][i]) = (voigt[shear], voigt[shear]);
    }
    tensor
}

/// A B.
#[inline]
pub(crate) fn product<const D: usize>(a: &[[f64; D]; D], b: &[[f64; D]; D]) -> [[f64; D]; D] {
    let mut result = [[0.0; D]; D];
    for i in 0..D {
        for k in 0..D {
            for j in 0..D {
                result[i][j] += a[i][k] * b[k][j];
            }
        }
    }
    result
}

#[inline]
fn times<const D: usize>(matrix: &[[f64; D]; D], vector: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|i| dot(&matrix[i], vector))
}

#[inline]
fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let mut sum = 0.0;
    for i in 0..D {
        sum += a[i] * b[i];
    }
    sum
}

/// Determinant of a 2x2 or 3x3 matrix.
#[inline]
pub(crate) fn determinant<const D: usize>(m: &[[f64; D]; D]) -> f64 {
    if D == 2 {
        m[0][0] * m[1][1] - m[0][1] * m[1][0]
    } else {
        let minor = |i: usize, j: usize| m[1][i] * m[2][j] - m[1][j] * m[2][i];
        m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
    }
}

/// Inverse of a 2x2 or 3x3 matrix, by cofactors.
pub(crate) fn inverse<const D: usize>(m: &[[f64; D]; D]) -> [[f64; D]; D] {
    let determinant = determinant(m);
    let mut result = [[0.0; D]; D];
    for i in 0..D {
        for j in 0..D {
            result[j][i] = if D == 2 {
                let sign = if i == j { 1.0 } else { -1.0 };
                sign * m[1 - i][1 - j] / determinant
            } else {
                let (p, q, r, s) = ((i + 1) % D, (i + 2) % D, (j + 1) % D, (j + 2) % D);
                (m[p][r] * m[q][s] - m[p][s] * m[q][r]) / determinant
            };
        }
    }
    result
}
