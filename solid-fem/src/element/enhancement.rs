//! The modes of the enhanced elements and what is known of them before anything moves: points, gradients, M.
//!
//! Hexahedron: xi, eta, zeta on the normal strains and the two linear terms of its own plane on each shear strain.
//! Quadrilateral: the modes of the hexahedron that are left in a plane, so a prismatic body of hexahedra between rollers
//! gives the same displacement. Both bend without locking with one element across the thickness; second order in L2.

use super::Extrapolation;
use super::enhanced::{Enhanced, Shape};
use super::enhanced_iterated::EnhancedIterated;
use super::isoparametric::{point, shape_product};
use super::kinematics::{Kinematics, SHEAR};
use super::matrix::{determinant, inverse};
use super::point::Point;
use super::uneven::{Uneven, uneven_gradients};
use crate::cell::Cell;
use crate::material::{InSpace, StVenantKirchhoff};
use crate::mesh::Mesh;

/// Strain modes in the element's own axes at a point: M_xi, `[S, A]`, engineering shear.
type Modes<const S: usize, const A: usize> = fn(&[f64; 3]) -> [[f64; A]; S];

/// A cell and its modes.
pub struct Enhancement<const D: usize, const S: usize, const N: usize, const A: usize> {
    cell: Cell,
    modes: Modes<S, A>,
}

/// 4-node quadrilateral with four modes.
pub const QUADRILATERAL: Enhancement<2, 3, 4, 4> = Enhancement {
    cell: Cell::Quadrilateral4,
    modes: |&[xi, eta, _]| [[xi, 0.0, 0.0, 0.0], [0.0, eta, 0.0, 0.0], [0.0, 0.0, xi, eta]],
};

/// 8-node hexahedron with nine modes.
pub const HEXAHEDRON: Enhancement<3, 6, 8, 9> = Enhancement {
    cell: Cell::Hexahedron8,
    modes: |&[xi, eta, zeta]| {
        let mut modes = [[0.0; 9]; 6];
        (modes[0][0], modes[1][1], modes[2][2]) = (xi, eta, zeta);
        (modes[3][3], modes[3][4]) = (xi, eta);
        (modes[4][5], modes[4][6]) = (eta, zeta);
        (modes[5][7], modes[5][8]) = (zeta, xi);
        modes
    },
};

/// Points and modes of one reference shape.
pub(super) struct Reference<const D: usize, const S: usize, const N: usize, const A: usize> {
    pub(super) points: [Point<D, N>; N],
    /// U of slender cells.
    pub(super) uneven: Option<Uneven<D, N>>,
    /// M at the points.
    pub(super) modes: [[[f64; A]; S]; N],
    /// Integral of N_a N_b, `[N, N]`.
    pub(super) product: Vec<f64>,
}

impl<const D: usize, const S: usize, const N: usize, const A: usize> Enhancement<D, S, N, A> {
    /// The elements of a mesh in a linear law.
    pub fn build(
        &self,
        mesh: &Mesh,
        material: StVenantKirchhoff,
        kinematics: Kinematics,
    ) -> Enhanced<D, S, N, A> {
        let (class, references, extrapolation) = self.references(mesh, material);
        let shapes = references.into_iter().map(|reference| Shape::new(reference, &material)).collect();
        Enhanced { class, shapes, extrapolation, material, kinematics }
    }

    /// The elements of a mesh in any other law, with what it is at small strain.
    pub fn build_iterated(
        &self,
        mesh: &Mesh,
        (material, elastic): (InSpace, StVenantKirchhoff),
        kinematics: Kinematics,
    ) -> EnhancedIterated<D, S, N, A> {
        let (class, references, extrapolation) = self.references(mesh, elastic);
        EnhancedIterated { class, references, extrapolation, material, kinematics }
    }

    fn references(
        &self,
        mesh: &Mesh,
        elastic: StVenantKirchhoff,
    ) -> (Vec<u32>, Vec<Reference<D, S, N, A>>, Extrapolation) {
        let (class, shapes) = mesh.shapes();
        let references = shapes.iter().map(|shape| self.reference(shape, elastic)).collect();
        (class, references, Extrapolation::new(self.cell, &self.cell.stiffness_rule()))
    }

    fn reference(&self, position: &[f64], elastic: StVenantKirchhoff) -> Reference<D, S, N, A> {
        let rule = self.cell.stiffness_rule();
        let jacobian = |at: &[f64; 3]| -> [[f64; D]; D] {
            let shape = self.cell.shape(at);
            std::array::from_fn(|i| {
                std::array::from_fn(|j| (0..N).map(|a| position[a * D + i] * shape.derivative[a][j]).sum())
            })
        };
        let centre = jacobian(&[0.0; 3]);
        let back = inverse(&centre);
        let modes = std::array::from_fn(|q| {
            let scale = determinant(&centre) / determinant(&jacobian(&rule[q].at));
            turn_modes(&(self.modes)(&rule[q].at), &back, scale)
        });
        let points = std::array::from_fn(|q| point(self.cell, position, &rule[q].at, rule[q].weight));
        let product = shape_product::<D, N>(self.cell, position);
        Reference { uneven: uneven_gradients(&points, &rule, &centre, elastic), points, modes, product }
    }
}

/// Voigt number of a tensor component.
#[inline]
const fn voigt<const D: usize>(i: usize, j: usize) -> usize {
    if i == j {
        i
    } else if i + j == 1 {
        D
    } else if i + j == 3 {
        D + 1
    } else {
        D + 2
    }
}

/// M = scale T0 M_xi: every mode as a tensor, E = J0^-T E_xi J0^-1.
fn turn_modes<const D: usize, const S: usize, const A: usize>(
    modes: &[[f64; A]; S],
    inverse: &[[f64; D]; D],
    scale: f64,
) -> [[f64; A]; S] {
    let mut turned = [[0.0; A]; S];
    for m in 0..A {
        let own = |k: usize, l: usize| modes[voigt::<D>(k, l)][m] * if k == l { 1.0 } else { 0.5 };
        let component = |i: usize, j: usize| {
            let mut sum = 0.0;
            for k in 0..D {
                for l in 0..D {
                    sum += inverse[k][i] * own(k, l) * inverse[l][j];
                }
            }
            scale * sum
        };
        for i in 0..D {
            turned[i][m] = component(i, i);
        }
        for shear in D..S {
            let (i, j) = SHEAR[shear - D];
            turned[shear][m] = 2.0 * component(i, j);
        }
    }
    turned
}
