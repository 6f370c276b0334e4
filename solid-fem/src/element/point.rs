//! An integration point: what stress and moduli there give to force and tangent.
//!
//! One-letter names as in the formulas: F deformation gradient, S second Piola-Kirchhoff stress, g_a gradient of the shape
//! function of node a in the reference configuration.

use super::kinematics::pair;
use super::matrix::{dot, times};

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
