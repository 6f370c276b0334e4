//! 4-node quadrilateral in plane strain with four enhanced strain modes and consistent mass: the default in 2-D.
//!
//! xi and eta on the normal strains, both on the shear strain (Simo and Rifai 1990): the modes of the hexahedron with
//! nine that are left in a plane, so a prismatic body of hexahedra between rollers gives the same displacement.

use super::enhanced::{Corners, Enhanced};
use crate::material::StVenantKirchhoff;
use crate::mesh::Mesh;

const CORNERS: Corners<2, 4> = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

fn modes(&[xi, eta]: &[f64; 2]) -> [[f64; 4]; 3] {
    [[xi, 0.0, 0.0, 0.0], [0.0, eta, 0.0, 0.0], [0.0, 0.0, xi, eta]]
}

/// The quadrilaterals of a mesh.
pub fn new(mesh: &Mesh, material: StVenantKirchhoff) -> Enhanced<2, 3, 4, 4> {
    Enhanced::new(mesh, material, &CORNERS, modes)
}
