//! Materials: second Piola-Kirchhoff stress S and its derivative from the Green-Lagrange strain E, both in Voigt order
//! (xx yy xy in 2-D, xx yy zz xy yz zx in 3-D, engineering shear).
//!
//! | law | file | for |
//! |---|---|---|
//! | St.Venant-Kirchhoff | [`st_venant_kirchhoff`] | large rotation, small strain: the default |
//! | neo-Hookean | [`neo_hookean`] | soft bodies at large strain, also crushed ones |
//! | J2 plasticity | [`plasticity`] | metals beyond yield, isotropic hardening, finite strain |
//!
//! The first is a type of its own, as constant moduli save most of the work; the others stand behind [`Law`], written
//! once for space and brought to the plane by [`InSpace`].

pub mod neo_hookean;
pub mod plane;
pub mod plasticity;
pub mod st_venant_kirchhoff;
pub mod tensor;

pub use plane::InSpace;
pub use st_venant_kirchhoff::StVenantKirchhoff;

use serde::{Deserialize, Serialize};

/// The stress of a law could not be found at a strain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unsolvable;

/// State of a material point: what it kept from the last accepted step, and what it would keep from this one.
#[derive(Debug)]
pub struct History<'a> {
    /// Of the last accepted state.
    pub old: &'a [f64],
    /// Of the state tried.
    pub new: &'a mut [f64],
}

/// dS/dE at a strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Moduli<const S: usize> {
    /// lambda I x I + 2 mu 1, the isotropic linear law.
    Lame(f64, f64),
    /// Any symmetric matrix, `[S, S]` Pa.
    Full([[f64; S]; S]),
}

/// What an element needs of a material in D dimensions with S Voigt components.
pub trait Material<const D: usize, const S: usize>: Send + Sync {
    /// Numbers kept per integration point.
    fn history_len(&self) -> usize {
        0
    }

    /// S at E, Pa.
    ///
    /// # Errors
    /// [`Unsolvable`].
    fn stress(&self, strain: &[f64; S], history: History<'_>) -> Result<[f64; S], Unsolvable>;

    /// S and dS/dE at E, Pa.
    ///
    /// # Errors
    /// [`Unsolvable`].
    fn response(&self, strain: &[f64; S], history: History<'_>) -> Result<([f64; S], Moduli<S>), Unsolvable>;

    /// Recoverable energy per volume, J/m3.
    fn energy_density(&self, strain: &[f64; S], old: &[f64]) -> f64;

    /// All six components of S, Pa, and the stretch across the plane.
    fn in_space(&self, strain: &[f64; S], old: &[f64]) -> ([f64; 6], f64);
}

/// S and dS/dE of a law in space, Pa.
pub type Response = ([f64; 6], [[f64; 6]; 6]);

/// A law in space.
pub trait Law: Send + Sync {
    /// Numbers kept per integration point.
    fn history_len(&self) -> usize {
        0
    }

    /// S and dS/dE at E, Pa.
    ///
    /// # Errors
    /// [`Unsolvable`].
    fn response(&self, strain: &[f64; 6], history: History<'_>) -> Result<Response, Unsolvable>;

    /// Recoverable energy per volume, J/m3.
    fn energy_density(&self, strain: &[f64; 6], old: &[f64]) -> f64;
}

/// The laws on offer, with what they need beside Young's modulus and Poisson's ratio.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub enum LawKind {
    /// S = lambda tr(E) I + 2 mu E.
    #[default]
    StVenantKirchhoff,
    /// Compressible neo-Hookean.
    NeoHookean,
    /// J2 plasticity: yield stress, Pa, over equivalent plastic strain; linear between the rows, constant after them.
    Plasticity {
        /// Rows of increasing plastic strain, the first at 0.
        hardening: Vec<(f64, f64)>,
    },
}

impl LawKind {
    /// Names in the case file.
    pub const NAMES: [&'static str; 3] = ["st_venant_kirchhoff", "neo_hookean", "plasticity"];

    /// The law in space; `None` for St.Venant-Kirchhoff, which is no [`Law`].
    pub fn build(&self, young_modulus: f64, poisson_ratio: f64) -> Option<Box<dyn Law>> {
        let elastic = StVenantKirchhoff::new(young_modulus, poisson_ratio);
        match self {
            Self::StVenantKirchhoff => None,
            Self::NeoHookean => Some(Box::new(neo_hookean::NeoHookean::new(elastic))),
            Self::Plasticity { hardening } => {
                Some(Box::new(plasticity::Plasticity::new(elastic, hardening.clone())))
            }
        }
    }
}

#[cfg(test)]
mod tests;
