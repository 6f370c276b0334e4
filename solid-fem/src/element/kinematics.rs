//! Strain, stress and stiffness at one integration point, for any element.
//!
//! One-letter names as in the formulas: H displacement gradient, F = I + H, S second Piola-Kirchhoff stress,
//! g_a gradient of the shape function of node a in the reference configuration.

use serde::{Deserialize, Serialize};

use super::Collapse;
use super::matrix::{determinant, inverse, product, transpose, unit};
use super::point::Point;
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
pub(crate) fn pair<const D: usize>(component: usize) -> (usize, usize) {
    if component < D { (component, component) } else { SHEAR[component - D] }
}

/// E = (H + H' + H'H)/2 in Voigt order with engineering shear.
#[inline]
pub(crate) fn green_lagrange_strain<const D: usize, const S: usize>(gradient: &[[f64; D]; D]) -> [f64; S] {
    let (mut strain, square) = (small_strain::<D, S>(gradient), half_square::<D, S>(gradient));
    for s in 0..S {
        strain[s] += square[s];
    }
    strain
}

/// H'H/2 in Voigt order with engineering shear.
#[inline]
pub(crate) fn half_square<const D: usize, const S: usize>(gradient: &[[f64; D]; D]) -> [f64; S] {
    let mut square = [0.0; S];
    for s in 0..S {
        let (i, j) = pair::<D>(s);
        let mut sum = 0.0;
        for k in 0..D {
            sum += gradient[k][i] * gradient[k][j];
        }
        square[s] = if i == j { 0.5 * sum } else { sum };
    }
    square
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
