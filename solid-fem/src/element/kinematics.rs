//! Strain, stress and stiffness at one integration point, for any element.
//!
//! One-letter names as in the formulas: H displacement gradient, F = I + H, S second Piola-Kirchhoff stress,
//! g_a gradient of the shape function of node a in the reference configuration.

use serde::{Deserialize, Serialize};

use super::Collapse;
use crate::material::Moduli;

/// Pairs of axes of the shear components in Voigt order.
pub(crate) const SHEAR: [(usize, usize); 3] = [(0, 1), (1, 2), (2, 0)];

/// What is made of the displacement gradient.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kinematics {
    /// Strain (H + H')/2, balance in the unloaded shape: small displacement.
    Linear,
    /// Strain (H + H' + H'H)/2, integrals over the unloaded shape.
    #[default]
    TotalLagrangian,
    /// The same strain, Cauchy stress and integrals over the current shape. The same numbers as the total form but for
    /// round-off, at a higher cost: what is wanted of the paper's formulation, and a check of either.
    UpdatedLagrangian,
}

impl Kinematics {
    /// Names in the case file, in the order of the variants.
    pub const NAMES: [&'static str; 3] = ["linear", "total_lagrangian", "updated_lagrangian"];

    /// All, in the same order.
    pub const ALL: [Self; 3] = [Self::Linear, Self::TotalLagrangian, Self::UpdatedLagrangian];

    /// Strain in Voigt order and deformation gradient of H; the latter is I in linear kinematics.
    ///
    /// # Errors
    /// [`Collapse::Inverted`] when det F <= 0.
    #[inline]
    pub(crate) fn strain<const D: usize, const S: usize>(
        self,
        gradient: &[[f64; D]; D],
    ) -> Result<([f64; S], [[f64; D]; D]), Collapse> {
        if self == Self::Linear {
            return Ok((small_strain(gradient), unit()));
        }
        Ok((green_lagrange_strain(gradient), deformation_gradient(gradient)?))
    }
}

/// What a point gives to force and tangent, in the configuration integrated over.
pub(crate) struct Sample<const D: usize, const S: usize, const N: usize> {
    pub(crate) point: Point<D, N>,
    pub(crate) deformation: [[f64; D]; D],
    pub(crate) stress: [[f64; D]; D],
    pub(crate) moduli: Moduli<S>,
}

impl<const D: usize, const S: usize, const N: usize> Sample<D, S, N> {
    /// The same in the current shape: sigma = F S F'/J, c = F F C F' F'/J, gradients g F^-1, weight w J.
    pub(crate) fn push_forward(self) -> Self {
        let Self { point, deformation, stress, moduli } = self;
        let jacobian = determinant(&deformation);
        let inverse = inverse(&deformation);
        let gradient = point.gradient.map(|g| {
            std::array::from_fn(|i| {
                let mut sum = 0.0;
                for k in 0..D {
                    sum += g[k] * inverse[k][i];
                }
                sum
            })
        });
        let turned = product(&product(&deformation, &stress), &transpose(&deformation));
        let moduli = push_moduli::<D, S>(&deformation, &moduli, jacobian);
        Self {
            point: Point { weight: point.weight * jacobian, gradient },
            deformation: unit(),
            stress: turned.map(|row| row.map(|value| value / jacobian)),
            moduli: Moduli::Full(moduli),
        }
    }

    /// f_a += w P g_a with P = F S.
    #[inline]
    pub(crate) fn add_force(&self, force: &mut [f64]) {
        self.point.add_force(&product(&self.deformation, &self.stress), force);
    }

    /// Adds the blocks b >= a of the tangent; without the stress' own part in linear kinematics.
    #[inline]
    pub(crate) fn add_tangent(&self, kinematics: Kinematics, tangent: &mut [f64]) {
        let stress = if kinematics == Kinematics::Linear { [[0.0; D]; D] } else { self.stress };
        match &self.moduli {
            Moduli::Lame(lambda, mu) => {
                self.point.add_tangent((*lambda, *mu), &self.deformation, &stress, tangent);
            }
            Moduli::Full(moduli) => self.point.add_full_tangent(moduli, &self.deformation, &stress, tangent),
        }
    }
}

/// c_ijkl = F_iI F_jJ F_kK F_lL C_IJKL / J, by the Voigt matrix of E -> F E F'.
fn push_moduli<const D: usize, const S: usize>(
    deformation: &[[f64; D]; D],
    moduli: &Moduli<S>,
    jacobian: f64,
) -> [[f64; S]; S] {
    // T: components of F S F' from those of S.
    let mut turn = [[0.0; S]; S];
    for (row, turn) in turn.iter_mut().enumerate() {
        let (i, j) = pair::<D>(row);
        for (column, turn) in turn.iter_mut().enumerate() {
            let (k, l) = pair::<D>(column);
            *turn = deformation[i][k] * deformation[j][l];
            if k != l {
                *turn += deformation[i][l] * deformation[j][k];
            }
        }
    }
    let full = full_moduli::<D, S>(moduli);
    let mut half = [[0.0; S]; S];
    let mut result = [[0.0; S]; S];
    for s in 0..S {
        for t in 0..S {
            for k in 0..S {
                half[s][t] += turn[s][k] * full[k][t] / jacobian;
            }
        }
    }
    for s in 0..S {
        for t in 0..S {
            for k in 0..S {
                result[s][t] += half[s][k] * turn[t][k];
            }
        }
    }
    result
}

/// The matrix of any moduli.
pub(crate) fn full_moduli<const D: usize, const S: usize>(moduli: &Moduli<S>) -> [[f64; S]; S] {
    match moduli {
        Moduli::Full(full) => *full,
        Moduli::Lame(lambda, mu) => {
            let mut full = [[0.0; S]; S];
            for s in 0..S {
                full[s][s] = if s < D { 2.0 * mu } else { *mu };
            }
            for row in full.iter_mut().take(D) {
                row.iter_mut().take(D).for_each(|value| *value += lambda);
            }
            full
        }
    }
}

/// Axes of a Voigt component.
fn pair<const D: usize>(component: usize) -> (usize, usize) {
    if component < D { (component, component) } else { SHEAR[component - D] }
}

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

    /// Adds the blocks b >= a of the tangent of a law with constants lambda and mu,
    /// K_ab += w [ lambda (F g_a)(F g_b)' + mu ((g_a.g_b) F F' + (F g_b)(F g_a)') + (g_a.S g_b) I ].
    #[inline]
    pub(crate) fn add_tangent(
        &self,
        (lambda, mu): (f64, f64),
        deformation: &[[f64; D]; D],
        stress: &[[f64; D]; D],
        tangent: &mut [f64],
    ) {
        let (lambda, mu) = (self.weight * lambda, self.weight * mu);
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

    /// The same for any moduli C: K_ab += w [ B_a' C B_b + (g_a.S g_b) I ], B_a the derivative of E by u_a.
    pub(crate) fn add_full_tangent<const S: usize>(
        &self,
        moduli: &[[f64; S]; S],
        deformation: &[[f64; D]; D],
        stress: &[[f64; D]; D],
        tangent: &mut [f64],
    ) {
        let strain: [[[f64; S]; D]; N] = self.strain_derivative(deformation);
        for b in 0..N {
            let stressed = times(stress, &self.gradient[b]);
            let mut answer = [[0.0; S]; D];
            for j in 0..D {
                for s in 0..S {
                    for t in 0..S {
                        answer[j][s] += self.weight * moduli[s][t] * strain[b][j][t];
                    }
                }
            }
            for a in 0..=b {
                let initial = self.weight * dot(&self.gradient[a], &stressed);
                for i in 0..D {
                    let row = &mut tangent[(a * D + i) * N * D + b * D..][..D];
                    for j in 0..D {
                        row[j] += dot(&strain[a][i], &answer[j]);
                    }
                    row[i] += initial;
                }
            }
        }
    }

    /// dE/du_ai in Voigt order, `[N, D, S]`: component (k, l) is F_ik g_al, made symmetric.
    pub(crate) fn strain_derivative<const S: usize>(
        &self,
        deformation: &[[f64; D]; D],
    ) -> [[[f64; S]; D]; N] {
        let mut strain = [[[0.0; S]; D]; N];
        for a in 0..N {
            for i in 0..D {
                for s in 0..S {
                    let (k, l) = pair::<D>(s);
                    strain[a][i][s] = deformation[i][k] * self.gradient[a][l];
                    if k != l {
                        strain[a][i][s] += deformation[i][l] * self.gradient[a][k];
                    }
                }
            }
        }
        strain
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

/// (H + H')/2 in Voigt order with engineering shear.
#[inline]
pub(crate) fn small_strain<const D: usize, const S: usize>(gradient: &[[f64; D]; D]) -> [f64; S] {
    let mut strain = [0.0; S];
    for i in 0..D {
        strain[i] = gradient[i][i];
    }
    for shear in D..S {
        let (i, j) = SHEAR[shear - D];
        strain[shear] = gradient[i][j] + gradient[j][i];
    }
    strain
}

/// I.
#[inline]
pub(crate) fn unit<const D: usize>() -> [[f64; D]; D] {
    let mut unit = [[0.0; D]; D];
    for i in 0..D {
        unit[i][i] = 1.0;
    }
    unit
}

/// A'.
pub(crate) fn transpose<const D: usize>(a: &[[f64; D]; D]) -> [[f64; D]; D] {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// F = I + H.
///
/// # Errors
/// [`Collapse::Inverted`] when det F <= 0.
#[inline]
pub(crate) fn deformation_gradient<const D: usize>(
    gradient: &[[f64; D]; D],
) -> Result<[[f64; D]; D], Collapse> {
    let mut deformation = *gradient;
    for i in 0..D {
        deformation[i][i] += 1.0;
    }
    let determinant = determinant(&deformation);
    // Written so that a determinant that is not a number is refused too.
    if determinant > 0.0 { Ok(deformation) } else { Err(Collapse::Inverted(determinant)) }
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
pub(crate) fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
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
