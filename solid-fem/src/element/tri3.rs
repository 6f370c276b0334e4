//! 3-node triangle in plane strain with consistent mass: the 2-D counterpart of the paper's linear tetrahedron.
//!
//! Second order in displacement (L2), but so stiff in bending at a few elements across that it serves to reproduce
//! published results only.

use super::constant_strain::ConstantStrain;
use crate::material::StVenantKirchhoff;
use crate::mesh::Mesh;

/// The triangles of a mesh.
pub fn new(mesh: &Mesh, material: StVenantKirchhoff) -> ConstantStrain<2, 3, 3> {
    ConstantStrain::new(mesh, material)
}
