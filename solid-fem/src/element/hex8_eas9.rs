//! 8-node hexahedron with nine enhanced strain modes and consistent mass: the default in 3-D.
//!
//! xi, eta, zeta on the normal strains and the two linear terms of its own plane on each shear strain (Simo and Rifai
//! 1990, Klinkel and Wagner 1997). Bends without locking with one element across the thickness; second order in L2.

use super::enhanced::{Corners, Enhanced};
use crate::material::StVenantKirchhoff;
use crate::mesh::Mesh;

const CORNERS: Corners<3, 8> = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

fn modes(&[xi, eta, zeta]: &[f64; 3]) -> [[f64; 9]; 6] {
    let mut modes = [[0.0; 9]; 6];
    (modes[0][0], modes[1][1], modes[2][2]) = (xi, eta, zeta);
    (modes[3][3], modes[3][4]) = (xi, eta);
    (modes[4][5], modes[4][6]) = (eta, zeta);
    (modes[5][7], modes[5][8]) = (zeta, xi);
    modes
}

/// The hexahedra of a mesh.
pub fn new(mesh: &Mesh, material: StVenantKirchhoff) -> Enhanced<3, 6, 8, 9> {
    Enhanced::new(mesh, material, &CORNERS, modes)
}
