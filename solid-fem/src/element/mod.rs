//! Elements: internal force, tangent, energy and mass of one element, total Lagrangian.
//!
//! All start from the displacement gradient H: E = (H + H' + H'H)/2, never through F - I, which would lose six digits
//! at the strains of steel. Mass is consistent for all elements (integral of N_a N_b).
//!
//! | element | file | use |
//! |---|---|---|
//! | 4-node quadrilateral, 4 enhanced modes | [`quad4_eas4`] | 2-D, default |
//! | 8-node hexahedron, 9 enhanced modes | [`hex8_eas9`] | 3-D, default |
//! | 3-node triangle | [`tri3`] | 2-D, paper mode: far too stiff in bending |
//! | 4-node tetrahedron | [`tet4`] | 3-D, paper mode: far too stiff in bending |

mod constant_strain;
mod enhanced;
pub mod hex8_eas9;
pub(crate) mod kinematics;
pub mod quad4_eas4;
pub mod tet4;
pub mod tri3;

use serde::{Deserialize, Serialize};

use crate::material::StVenantKirchhoff;
use crate::mesh::Mesh;

/// det F <= 0 at a point of the element; holds the determinant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inverted(pub f64);

/// What the assembly needs of an element; `displacement` and `force` are `[N, D]` of the element, m and N (per metre
/// of depth in 2-D).
pub trait Element: Send + Sync {
    /// Writes the internal force: integral of P grad N_a, with P = F S.
    ///
    /// # Errors
    /// [`Inverted`] when det F <= 0 at an integration point.
    fn internal_force(&self, element: usize, displacement: &[f64], force: &mut [f64])
    -> Result<(), Inverted>;

    /// Writes the internal force and its derivative, the symmetric tangent stiffness `[N D, N D]` N/m.
    ///
    /// # Errors
    /// [`Inverted`] when det F <= 0 at an integration point.
    fn tangent(
        &self,
        element: usize,
        displacement: &[f64],
        force: &mut [f64],
        tangent: &mut [f64],
    ) -> Result<(), Inverted>;

    /// Strain energy, J.
    fn strain_energy(&self, element: usize, displacement: &[f64]) -> f64;

    /// Writes the integral of N_a N_b, `[N, N]` m3 (m2 in 2-D); times the density it is the consistent mass.
    fn shape_product(&self, element: usize, product: &mut [f64]);
}

/// The elements on offer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ElementKind {
    /// 2-D, 4-node quadrilateral with 4 enhanced modes.
    Quad4Eas4,
    /// 2-D, 3-node triangle.
    Tri3,
    /// 3-D, 8-node hexahedron with 9 enhanced modes.
    Hex8Eas9,
    /// 3-D, 4-node tetrahedron.
    Tet4,
}

impl ElementKind {
    /// All elements.
    pub const ALL: [Self; 4] = [Self::Quad4Eas4, Self::Tri3, Self::Hex8Eas9, Self::Tet4];

    /// Its name in the case file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Quad4Eas4 => "quad4_eas4",
            Self::Tri3 => "tri3",
            Self::Hex8Eas9 => "hex8_eas9",
            Self::Tet4 => "tet4",
        }
    }

    /// The default of a dimension: the enhanced element.
    pub fn default_of(dimension: usize) -> Self {
        if dimension == 2 { Self::Quad4Eas4 } else { Self::Hex8Eas9 }
    }

    /// 2 or 3.
    pub fn dimension(self) -> usize {
        if matches!(self, Self::Quad4Eas4 | Self::Tri3) { 2 } else { 3 }
    }

    /// Whether it is a triangle or tetrahedron.
    pub fn is_simplex(self) -> bool {
        matches!(self, Self::Tri3 | Self::Tet4)
    }

    /// The element for all elements of a mesh.
    pub fn build(self, mesh: &Mesh, material: StVenantKirchhoff) -> Box<dyn Element> {
        match self {
            Self::Quad4Eas4 => Box::new(quad4_eas4::new(mesh, material)),
            Self::Tri3 => Box::new(tri3::new(mesh, material)),
            Self::Hex8Eas9 => Box::new(hex8_eas9::new(mesh, material)),
            Self::Tet4 => Box::new(tet4::new(mesh, material)),
        }
    }
}

#[cfg(test)]
mod tests;
