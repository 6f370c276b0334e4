//! Elements: internal force, tangent, energy, mass and stress of one element.
//!
//! All start from the displacement gradient H: E = (H + H' + H'H)/2, never through F - I, which would lose six digits
//! at the strains of steel. Mass is consistent for all elements (integral of N_a N_b).
//!
//! | element | use |
//! |---|---|
//! | `quad4_eas4` 4-node quadrilateral, 4 enhanced modes | 2-D, default of boxes |
//! | `tri6`, `quad8` | 2-D, any shape; `tri6` is the default of mesh files of triangles |
//! | `tri3` | 2-D, paper mode: far too stiff in bending |
//! | `hex8_eas9` 8-node hexahedron, 9 enhanced modes | 3-D, default of boxes |
//! | `tet10`, `hex20` | 3-D, any shape; `tet10` is the default of mesh files of tetrahedra |
//! | `tet4` | 3-D, paper mode: far too stiff in bending |
//!
//! Files: [`isoparametric`] (all displacement elements); [`enhancement`] (modes), [`uneven`] (strain before them), [`enhanced`]
//! and [`enhanced_iterated`] (the same for laws that are not linear); `kinematics` and `point` (one integration point).

pub mod enhanced;
pub mod enhanced_iterated;
pub mod enhancement;
pub mod isoparametric;
pub(crate) mod kinematics;
pub(crate) mod matrix;
mod point;
mod stress;
pub mod uneven;

use serde::{Deserialize, Serialize};

pub use kinematics::Kinematics;
pub(crate) use stress::{Extrapolation, cauchy_stress};

use crate::cell::Cell;
use crate::material::{History, InSpace, LawKind, Material, StVenantKirchhoff, Unsolvable};
use crate::mesh::Mesh;
use enhancement::{HEXAHEDRON, QUADRILATERAL};
use kinematics::stress_tensor;

/// Why an element gives no force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Collapse {
    /// det F <= 0 at a point; holds the determinant.
    Inverted(f64),
    /// The material law, or the enhanced strain, could not be solved.
    Unsolvable,
}

impl From<Unsolvable> for Collapse {
    fn from(_: Unsolvable) -> Self {
        Self::Unsolvable
    }
}

/// What the assembly needs of an element; `displacement` and `force` are `[N, D]` of the element, m and N (per metre
/// of depth in 2-D).
pub trait Element: Send + Sync {
    /// Numbers an element keeps from one accepted state to the next.
    fn history_len(&self) -> usize {
        0
    }

    /// Writes the internal force: integral of P grad N_a, with P = F S.
    ///
    /// # Errors
    /// [`Collapse`].
    fn internal_force(
        &self,
        element: usize,
        displacement: &[f64],
        history: History<'_>,
        force: &mut [f64],
    ) -> Result<(), Collapse>;

    /// Writes the derivative of the internal force, the symmetric tangent stiffness `[N D, N D]` N/m.
    ///
    /// # Errors
    /// [`Collapse`].
    fn tangent(
        &self,
        element: usize,
        displacement: &[f64],
        history: History<'_>,
        tangent: &mut [f64],
    ) -> Result<(), Collapse>;

    /// Writes the force over a step that conserves energy and momenta: integral of F_mid C (E0 + E1)/2 grad N_a, of
    /// the displacements before and after (St.Venant-Kirchhoff only).
    ///
    /// # Errors
    /// [`Collapse`].
    fn conserving_force(
        &self,
        element: usize,
        displacements: [&[f64]; 2],
        force: &mut [f64],
    ) -> Result<(), Collapse>;

    /// Recoverable strain energy, J.
    fn strain_energy(&self, element: usize, displacement: &[f64], old: &[f64]) -> f64;

    /// Writes the integral of N_a N_b, `[N, N]` m3 (m2 in 2-D); times the density it is the consistent mass.
    fn shape_product(&self, element: usize, product: &mut [f64]);

    /// Writes the Cauchy stress at the nodes, `[N]` xx yy zz xy yz zx Pa, extrapolated from the integration points;
    /// gives the element's volume as weight, 0 if there is no stress.
    fn nodal_stress(&self, element: usize, displacement: &[f64], old: &[f64], stress: &mut [[f64; 6]])
    -> f64;
}

/// Stress halfway between two strains, as the energy-momentum method takes it, Pa.
///
/// Source: J. C. Simo and N. Tarnow, Z. angew. Math. Phys. 43 (1992) 757.
pub(super) fn middle_stress<const D: usize, const S: usize, M: Material<D, S>>(
    material: &M,
    before: &[f64; S],
    after: &[f64; S],
) -> Result<[[f64; D]; D], Collapse> {
    let strain = std::array::from_fn(|s| 0.5 * (before[s] + after[s]));
    Ok(stress_tensor(&material.stress(&strain, History { old: &[], new: &mut [] })?))
}

/// The elements on offer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ElementKind {
    /// 2-D, 4-node quadrilateral with 4 enhanced modes.
    Quad4Eas4,
    /// 2-D, 8-node quadrilateral.
    Quad8,
    /// 2-D, 6-node triangle.
    Tri6,
    /// 2-D, 3-node triangle.
    Tri3,
    /// 3-D, 8-node hexahedron with 9 enhanced modes.
    Hex8Eas9,
    /// 3-D, 20-node hexahedron.
    Hex20,
    /// 3-D, 10-node tetrahedron.
    Tet10,
    /// 3-D, 4-node tetrahedron.
    Tet4,
}

/// What the elements of a body are made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Substance {
    /// The law.
    pub law: LawKind,
    /// Pa.
    pub young_modulus: f64,
    /// In [0, 0.5).
    pub poisson_ratio: f64,
    /// In 2-D: a plate free of stress across its plane instead of plane strain.
    pub is_plane_stress: bool,
    /// What is made of the displacement gradient.
    pub kinematics: Kinematics,
}

impl Substance {
    /// Whether the force is K u at any displacement.
    pub fn is_linear(&self) -> bool {
        self.kinematics == Kinematics::Linear && self.law == LawKind::StVenantKirchhoff
    }
}

impl ElementKind {
    /// All elements.
    pub const ALL: [Self; 8] = [
        Self::Quad4Eas4,
        Self::Quad8,
        Self::Tri6,
        Self::Tri3,
        Self::Hex8Eas9,
        Self::Hex20,
        Self::Tet10,
        Self::Tet4,
    ];

    /// Its name in the case file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Quad4Eas4 => "quad4_eas4",
            Self::Quad8 => "quad8",
            Self::Tri6 => "tri6",
            Self::Tri3 => "tri3",
            Self::Hex8Eas9 => "hex8_eas9",
            Self::Hex20 => "hex20",
            Self::Tet10 => "tet10",
            Self::Tet4 => "tet4",
        }
    }

    /// The default of a box: the enhanced element.
    pub fn default_of(dimension: usize) -> Self {
        if dimension == 2 { Self::Quad4Eas4 } else { Self::Hex8Eas9 }
    }

    /// The default of a mesh file with cells of this shape: the enhanced element for linear boxes, else the quadratic
    /// one (linear simplices get nodes in the middle of their edges).
    pub fn default_of_cell(cell: Cell) -> Self {
        match cell {
            Cell::Quadrilateral4 => Self::Quad4Eas4,
            Cell::Hexahedron8 => Self::Hex8Eas9,
            Cell::Quadrilateral8 => Self::Quad8,
            Cell::Hexahedron20 => Self::Hex20,
            Cell::Triangle3 | Cell::Triangle6 => Self::Tri6,
            _ => Self::Tet10,
        }
    }

    /// 2 or 3.
    pub fn dimension(self) -> usize {
        self.cell().dimension()
    }

    /// Its shape.
    pub fn cell(self) -> Cell {
        match self {
            Self::Quad4Eas4 => Cell::Quadrilateral4,
            Self::Quad8 => Cell::Quadrilateral8,
            Self::Tri6 => Cell::Triangle6,
            Self::Tri3 => Cell::Triangle3,
            Self::Hex8Eas9 => Cell::Hexahedron8,
            Self::Hex20 => Cell::Hexahedron20,
            Self::Tet10 => Cell::Tetrahedron10,
            Self::Tet4 => Cell::Tetrahedron4,
        }
    }

    /// Whether it has enhanced strain modes.
    pub fn is_enhanced(self) -> bool {
        matches!(self, Self::Quad4Eas4 | Self::Hex8Eas9)
    }

    /// The element for all elements of a mesh.
    pub fn build(self, mesh: &Mesh, substance: &Substance) -> Box<dyn Element> {
        let elastic = StVenantKirchhoff::new(substance.young_modulus, substance.poisson_ratio);
        let is_plate = substance.is_plane_stress && self.dimension() == 2;
        let elastic = if is_plate { elastic.in_plane_stress() } else { elastic };
        let kinematics = substance.kinematics;
        match (self, substance.law.build(substance.young_modulus, substance.poisson_ratio)) {
            (Self::Quad4Eas4, None) => Box::new(QUADRILATERAL.build(mesh, elastic, kinematics)),
            (Self::Hex8Eas9, None) => Box::new(HEXAHEDRON.build(mesh, elastic, kinematics)),
            (Self::Quad4Eas4, Some(law)) => Box::new(QUADRILATERAL.build_iterated(
                mesh,
                (InSpace::new(law, is_plate), elastic),
                kinematics,
            )),
            (Self::Hex8Eas9, Some(law)) => {
                Box::new(HEXAHEDRON.build_iterated(mesh, (InSpace::new(law, is_plate), elastic), kinematics))
            }
            (_, None) => self.isoparametric(mesh, elastic, kinematics),
            (_, Some(law)) => self.isoparametric(mesh, InSpace::new(law, is_plate), kinematics),
        }
    }

    fn isoparametric<M>(self, mesh: &Mesh, material: M, kinematics: Kinematics) -> Box<dyn Element>
    where
        M: Material<2, 3> + Material<3, 6> + 'static,
    {
        use isoparametric::Isoparametric as Plain;
        match self {
            Self::Tri3 => Box::new(Plain::<2, 3, 3, M>::new(mesh, material, kinematics)),
            Self::Tri6 => Box::new(Plain::<2, 3, 6, M>::new(mesh, material, kinematics)),
            Self::Quad4Eas4 | Self::Quad8 => Box::new(Plain::<2, 3, 8, M>::new(mesh, material, kinematics)),
            Self::Tet4 => Box::new(Plain::<3, 6, 4, M>::new(mesh, material, kinematics)),
            Self::Tet10 => Box::new(Plain::<3, 6, 10, M>::new(mesh, material, kinematics)),
            Self::Hex8Eas9 | Self::Hex20 => Box::new(Plain::<3, 6, 20, M>::new(mesh, material, kinematics)),
        }
    }
}

#[cfg(test)]
mod convergence;
#[cfg(test)]
mod tests;
