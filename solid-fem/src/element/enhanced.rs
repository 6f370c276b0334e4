//! Enhanced assumed strain: E = (H + H' + H'H)/2 + M alpha, with 2-point Gauss integration per axis.
//!
//! Source: J. C. Simo and M. S. Rifai, Int. J. Numer. Methods Eng. 29 (1990) 1595; in the Green-Lagrange strain
//! S. Klinkel and W. Wagner, ibid. 40 (1997) 4529. M(xi) = (det J0 / det J) T0 M_xi, T0 the transformation of a strain
//! from the element's axes to the global ones at its centre, which keeps the patch test.
//!
//! The parameters alpha make the enhanced work vanish, integral M'S = 0. St.Venant-Kirchhoff is linear in E and hence
//! in alpha: alpha = -Kaa^-1 integral M'C E(u) with a constant Kaa = integral M'C M, exact at any displacement. So
//! alpha is a function of u and comes back with it; a law that is not linear iterates, see [`super::enhanced_iterated`].
//! Tangent: K - L Kaa^-1 L', L = integral B'C M.
//!
//! Hexahedron: xi, eta, zeta on the normal strains and the two linear terms of its own plane on each shear strain.
//! Quadrilateral: the modes of the hexahedron that are left in a plane, so a prismatic body of hexahedra between rollers
//! gives the same displacement. Both bend without locking with one element across the thickness; second order in L2.

use nalgebra::SMatrix;

use super::enhanced_iterated::EnhancedIterated;
use super::isoparametric::{point, shape_product};
use super::kinematics::{
    Kinematics, Point, SHEAR, Sample, determinant, inverse, mirror, product, stress_tensor,
};
use super::{Collapse, Element, Extrapolation, cauchy_stress};
use crate::cell::Cell;
use crate::material::{History, InSpace, Material, Moduli, StVenantKirchhoff};
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
        let (class, references, extrapolation) = self.references(mesh);
        let shapes = references.into_iter().map(|reference| Shape::new(reference, &material)).collect();
        Enhanced { class, shapes, extrapolation, material, kinematics }
    }

    /// The elements of a mesh in any other law.
    pub fn build_iterated(
        &self,
        mesh: &Mesh,
        material: InSpace,
        kinematics: Kinematics,
    ) -> EnhancedIterated<D, S, N, A> {
        let (class, references, extrapolation) = self.references(mesh);
        EnhancedIterated { class, references, extrapolation, material, kinematics }
    }

    fn references(&self, mesh: &Mesh) -> (Vec<u32>, Vec<Reference<D, S, N, A>>, Extrapolation) {
        let (class, shapes) = mesh.shapes();
        let references = shapes.iter().map(|shape| self.reference(shape)).collect();
        (class, references, Extrapolation::new(self.cell, &self.cell.stiffness_rule()))
    }

    fn reference(&self, position: &[f64]) -> Reference<D, S, N, A> {
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
        Reference { points, modes, product: shape_product::<D, N>(self.cell, position) }
    }
}

/// Quadrilaterals (D 2, S 3, N 4) or hexahedra (D 3, S 6, N 8) with A enhanced modes in a linear law; there are as many
/// integration points as corners.
pub struct Enhanced<const D: usize, const S: usize, const N: usize, const A: usize> {
    class: Vec<u32>,
    shapes: Vec<Shape<D, S, N, A>>,
    extrapolation: Extrapolation,
    material: StVenantKirchhoff,
    kinematics: Kinematics,
}

/// What depends on the reference shape and the moduli only.
struct Shape<const D: usize, const S: usize, const N: usize, const A: usize> {
    reference: Reference<D, S, N, A>,
    /// w C M at the points, N m / m3 times volume.
    mode_stress: [[[f64; A]; S]; N],
    /// Lower triangular G with Kaa^-1 = G' G.
    root: [[f64; A]; A],
}

/// State of an element at a displacement: F and the enhanced strain at the points.
struct Strained<const D: usize, const S: usize, const N: usize> {
    deformation: [[[f64; D]; D]; N],
    strain: [[f64; S]; N],
}

impl<const D: usize, const S: usize, const N: usize, const A: usize> Shape<D, S, N, A> {
    fn new(reference: Reference<D, S, N, A>, material: &StVenantKirchhoff) -> Self {
        let mode_stress = std::array::from_fn(|q| {
            mode_stress::<D, S, A>(material, reference.points[q].weight, &reference.modes[q])
        });
        let root = root(&reference.modes, &mode_stress);
        Self { reference, mode_stress, root }
    }

    #[inline]
    fn strained(&self, kinematics: Kinematics, displacement: &[f64]) -> Result<Strained<D, S, N>, Collapse> {
        let (mut deformation, mut strain) = ([[[0.0; D]; D]; N], [[0.0; S]; N]);
        for q in 0..N {
            let gradient = self.reference.points[q].displacement_gradient(displacement);
            (strain[q], deformation[q]) = kinematics.strain::<D, S>(&gradient)?;
        }
        let mut work = [0.0; A];
        for q in 0..N {
            for s in 0..S {
                for m in 0..A {
                    work[m] += self.mode_stress[q][s][m] * strain[q][s];
                }
            }
        }
        let (mut half, mut alpha) = ([0.0; A], [0.0; A]);
        for m in 0..A {
            for k in 0..=m {
                half[m] += self.root[m][k] * work[k];
            }
        }
        for m in 0..A {
            for k in m..A {
                alpha[m] -= self.root[k][m] * half[k];
            }
        }
        for q in 0..N {
            for s in 0..S {
                for m in 0..A {
                    strain[q][s] += self.reference.modes[q][s][m] * alpha[m];
                }
            }
        }
        Ok(Strained { deformation, strain })
    }

    /// L G', `[N D, A]`: L_(a,i),m = sum_q (F T_m)_ij g_aj, T_m the tensor of column m of w C M.
    #[inline]
    fn coupling(&self, deformation: &[[[f64; D]; D]; N], coupling: &mut [[[f64; A]; D]; N]) {
        for q in 0..N {
            let mut turned = [[[0.0; A]; D]; D];
            for i in 0..D {
                for j in 0..D {
                    for k in 0..D {
                        let row = &self.mode_stress[q][voigt::<D>(k, j)];
                        for m in 0..A {
                            turned[i][j][m] += deformation[q][i][k] * row[m];
                        }
                    }
                }
            }
            for a in 0..N {
                for i in 0..D {
                    for j in 0..D {
                        let g = self.reference.points[q].gradient[a][j];
                        for m in 0..A {
                            coupling[a][i][m] += g * turned[i][j][m];
                        }
                    }
                }
            }
        }
        for row in coupling.as_flattened_mut() {
            let plain = *row;
            for m in 0..A {
                row[m] = 0.0;
                for k in 0..=m {
                    row[m] += self.root[m][k] * plain[k];
                }
            }
        }
    }
}

impl<const D: usize, const S: usize, const N: usize, const A: usize> Enhanced<D, S, N, A> {
    fn shape(&self, element: usize) -> &Shape<D, S, N, A> {
        &self.shapes[self.class[element] as usize]
    }
}

impl<const D: usize, const S: usize, const N: usize, const A: usize> Element for Enhanced<D, S, N, A> {
    fn internal_force(
        &self,
        element: usize,
        displacement: &[f64],
        _: History<'_>,
        force: &mut [f64],
    ) -> Result<(), Collapse> {
        let shape = self.shape(element);
        let state = shape.strained(self.kinematics, displacement)?;
        force.fill(0.0);
        for q in 0..N {
            let stress = stress_tensor(&self.material.second_pk_stress::<D, S>(&state.strain[q]));
            shape.reference.points[q].add_force(&product(&state.deformation[q], &stress), force);
        }
        Ok(())
    }

    fn tangent(
        &self,
        element: usize,
        displacement: &[f64],
        _: History<'_>,
        tangent: &mut [f64],
    ) -> Result<(), Collapse> {
        let shape = self.shape(element);
        let state = shape.strained(self.kinematics, displacement)?;
        tangent.fill(0.0);
        for q in 0..N {
            let stress = stress_tensor(&self.material.second_pk_stress::<D, S>(&state.strain[q]));
            let moduli = Moduli::Lame(self.material.lambda, self.material.mu);
            let (point, deformation) = (shape.reference.points[q], state.deformation[q]);
            Sample::<D, S, N> { point, deformation, stress, moduli }.add_tangent(self.kinematics, tangent);
        }
        let mut coupling = [[[0.0; A]; D]; N];
        shape.coupling(&state.deformation, &mut coupling);
        let rows = coupling.as_flattened();
        for (row, left) in rows.iter().enumerate() {
            for (column, right) in rows.iter().enumerate().skip(row / D * D) {
                let mut sum = 0.0;
                for m in 0..A {
                    sum += left[m] * right[m];
                }
                tangent[row * N * D + column] -= sum;
            }
        }
        mirror::<D, N>(tangent);
        Ok(())
    }

    /// The enhanced work vanishes in both states, hence also in their mean: the same balance of energy as without.
    fn conserving_force(
        &self,
        element: usize,
        [before, after]: [&[f64]; 2],
        force: &mut [f64],
    ) -> Result<(), Collapse> {
        let shape = self.shape(element);
        let states = [shape.strained(self.kinematics, before)?, shape.strained(self.kinematics, after)?];
        force.fill(0.0);
        for q in 0..N {
            let at = |state: &Strained<D, S, N>| (state.strain[q], state.deformation[q]);
            let point = &shape.reference.points[q];
            super::middle(point, &self.material, [at(&states[0]), at(&states[1])])?.add_force(force);
        }
        Ok(())
    }

    fn strain_energy(&self, element: usize, displacement: &[f64], _: &[f64]) -> f64 {
        let shape = self.shape(element);
        let Ok(state) = shape.strained(self.kinematics, displacement) else { return f64::NAN };
        let energy = |q: usize| {
            let density = Material::<D, S>::energy_density(&self.material, &state.strain[q], &[]);
            shape.reference.points[q].weight * density
        };
        (0..N).map(energy).sum()
    }

    fn shape_product(&self, element: usize, product: &mut [f64]) {
        product.copy_from_slice(&self.shape(element).reference.product);
    }

    fn nodal_stress(&self, element: usize, displacement: &[f64], _: &[f64], stress: &mut [[f64; 6]]) -> f64 {
        let shape = self.shape(element);
        let Ok(state) = shape.strained(self.kinematics, displacement) else { return 0.0 };
        let at_points: [[f64; 6]; N] = std::array::from_fn(|q| {
            let (second, across) = Material::<D, S>::in_space(&self.material, &state.strain[q], &[]);
            cauchy_stress(&state.deformation[q], &second, across)
        });
        self.extrapolation.to_nodes(&at_points, stress);
        shape.reference.points.iter().map(|point| point.weight).sum()
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

fn mode_stress<const D: usize, const S: usize, const A: usize>(
    material: &StVenantKirchhoff,
    weight: f64,
    modes: &[[f64; A]; S],
) -> [[f64; A]; S] {
    let mut result = [[0.0; A]; S];
    for m in 0..A {
        let stress = material.second_pk_stress::<D, S>(&std::array::from_fn(|s| modes[s][m]));
        for s in 0..S {
            result[s][m] = weight * stress[s];
        }
    }
    result
}

/// G lower triangular with Kaa^-1 = G' G, by the Cholesky factor of Kaa = integral M'C M.
fn root<const S: usize, const N: usize, const A: usize>(
    modes: &[[[f64; A]; S]; N],
    mode_stress: &[[[f64; A]; S]; N],
) -> [[f64; A]; A] {
    let mut stiffness = SMatrix::<f64, A, A>::zeros();
    for q in 0..N {
        for (mode, stress) in modes[q].iter().zip(&mode_stress[q]) {
            for m in 0..A {
                for n in 0..A {
                    stiffness[(m, n)] += mode[m] * stress[n];
                }
            }
        }
    }
    let factor = stiffness.cholesky().expect("independent modes have a positive definite stiffness").l();
    let mut root = [[0.0; A]; A];
    for column in 0..A {
        for row in column..A {
            let known: f64 = (column..row).map(|k| factor[(row, k)] * root[k][column]).sum();
            root[row][column] = (if row == column { 1.0 } else { 0.0 } - known) / factor[(row, row)];
        }
    }
    root
}
