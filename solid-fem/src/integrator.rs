//! Time integration of M a + C v + f(u) = F: generalised-alpha, Newmark and the energy-momentum method.
//!
//! The first two are M [(1-am) a1 + am a0] + (1-af) f(u1) + af f(u0) = (1-af) F1 + af F0 with Newmark's
//! u1 = u0 + dt v0 + dt2 [(1/2-beta) a0 + beta a1], v1 = v0 + dt [(1-gamma) a0 + gamma a1]. The load is blended like
//! the internal force: that keeps the stability limit of the coupling. The last is M (v1-v0)/dt + f_mid = (F0 + F1)/2
//! with u1-u0 = dt (v0+v1)/2, f_mid of [`crate::element::Element::conserving_force`]; its acceleration is (v1-v0)/dt, the
//! mean over the step. It keeps energy and momenta for St.Venant-Kirchhoff, at any step.

use serde::{Deserialize, Serialize};

use crate::error::SceneError;

/// The integrators on offer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Integrator {
    /// Second order, damping of high frequencies set by the spectral radius at infinity.
    GeneralisedAlpha {
        /// In [0, 1]: 1 does not damp.
        rho_inf: f64,
    },
    /// Newmark; first order for gamma other than 1/2. The paper's gamma 0.6, beta 0.3025.
    Newmark {
        /// At least 1/2; below, the scheme feeds energy in.
        gamma: f64,
        /// At least (gamma + 1/2)^2 / 4 for unconditional stability.
        beta: f64,
    },
    /// Simo and Tarnow's: second order, keeps energy and angular momentum.
    EnergyMomentum,
}

/// The four numbers of the scheme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients {
    /// Weight of the old acceleration.
    pub alpha_m: f64,
    /// Weight of the old forces.
    pub alpha_f: f64,
    /// Newmark's gamma in the standard meaning.
    pub gamma: f64,
    /// Newmark's beta in the standard meaning.
    pub beta: f64,
}

impl Default for Integrator {
    fn default() -> Self {
        Self::GeneralisedAlpha { rho_inf: 0.5 }
    }
}

impl Integrator {
    /// The paper's: gamma 0.6, beta 0.3025 (its table prints them the other way round).
    pub const PAPER: Self = Self::Newmark { gamma: 0.6, beta: 0.3025 };

    /// The numbers of the scheme.
    ///
    /// Source: J. Chung and G. M. Hulbert, J. Appl. Mech. 60 (1993) 371; N. M. Newmark, J. Eng. Mech. Div. 85 (1959) 67.
    pub fn coefficients(self) -> Coefficients {
        match self {
            Self::GeneralisedAlpha { rho_inf } => {
                let alpha_m = (2.0 * rho_inf - 1.0) / (rho_inf + 1.0);
                let alpha_f = rho_inf / (rho_inf + 1.0);
                let difference = alpha_f - alpha_m;
                Coefficients {
                    alpha_m,
                    alpha_f,
                    gamma: 0.5 + difference,
                    beta: (1.0 + difference) * (1.0 + difference) / 4.0,
                }
            }
            Self::Newmark { gamma, beta } => Coefficients { alpha_m: 0.0, alpha_f: 0.0, gamma, beta },
            // The midpoint rule, written for the mean acceleration of the step.
            Self::EnergyMomentum => Coefficients { alpha_m: 0.0, alpha_f: 0.5, gamma: 1.0, beta: 0.5 },
        }
    }

    /// Refuses schemes that are not stable.
    ///
    /// # Errors
    /// [`SceneError::Range`].
    pub fn check(self) -> Result<(), SceneError> {
        match self {
            Self::GeneralisedAlpha { rho_inf } if !(0.0..=1.0).contains(&rho_inf) => {
                Err(SceneError::Range { name: "rho_inf", value: rho_inf, range: "from 0 to 1" })
            }
            Self::Newmark { gamma, .. } if !(0.5..=1.0).contains(&gamma) => {
                Err(SceneError::Range { name: "newmark_gamma", value: gamma, range: "from 0.5 to 1" })
            }
            Self::Newmark { gamma, beta } if !(beta >= 0.5 * gamma && beta <= 1.0) => {
                Err(SceneError::Range {
                    name: "newmark_beta",
                    value: beta,
                    range: "from newmark_gamma / 2 to 1",
                })
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_that_feeds_energy_in_is_refused() {
        let swapped = Integrator::Newmark { gamma: 0.3025, beta: 0.6 };
        assert!(matches!(swapped.check(), Err(SceneError::Range { name: "newmark_gamma", .. })));
        assert!(Integrator::Newmark { gamma: 0.6, beta: 0.25 }.check().is_err());
        assert_eq!(Integrator::PAPER.check(), Ok(()));
        assert_eq!(Integrator::Newmark { gamma: 0.5, beta: 0.25 }.check(), Ok(()));
    }
}
