//! Enhanced assumed strain: E = (H + H' + H'H - U'U)/2 + M alpha, with 2-point Gauss integration per axis; U is the uneven
//! part of H in slender cells, see [`super::uneven`].
//!
//! Source: J. C. Simo and M. S. Rifai, Int. J. Numer. Methods Eng. 29 (1990) 1595; in the Green-Lagrange strain
//! S. Klinkel and W. Wagner, ibid. 40 (1997) 4529. M(xi) = (det J0 / det J) T0 M_xi, T0 the transformation of a strain
//! from the element's axes to the global ones at its centre, which keeps the patch test.
//!
//! The parameters alpha make the enhanced work vanish, integral M'S = 0. St.Venant-Kirchhoff is linear in E and hence
//! in alpha: alpha = -Kaa^-1 integral M'C E(u) with a constant Kaa = integral M'C M, exact at any displacement. So
//! alpha is a function of u and comes back with it; a law that is not linear iterates, see [`super::enhanced_iterated`].
//! Tangent: K - L Kaa^-1 L', L = integral B'C M.

use nalgebra::SMatrix;

use super::enhancement::Reference;
use super::kinematics::{Kinematics, stress_tensor};
use super::point::mirror;
use super::uneven::Parts;
use super::{Collapse, Element, Extrapolation, cauchy_stress, middle_stress};
use crate::material::{History, Material, StVenantKirchhoff};

/// Quadrilaterals (D 2, S 3, N 4) or hexahedra (D 3, S 6, N 8) with A enhanced modes in a linear law; there are as many
/// integration points as corners.
pub struct Enhanced<const D: usize, const S: usize, const N: usize, const A: usize> {
    pub(super) class: Vec<u32>,
    pub(super) shapes: Vec<Shape<D, S, N, A>>,
    pub(super) extrapolation: Extrapolation,
    pub(super) material: StVenantKirchhoff,
    pub(super) kinematics: Kinematics,
}

/// What depends on the reference shape and the moduli only.
pub(super) struct Shape<const D: usize, const S: usize, const N: usize, const A: usize> {
    reference: Reference<D, S, N, A>,
    /// w C M at the points, N m / m3 times volume.
    mode_stress: [[[f64; A]; S]; N],
    /// Lower triangular G with Kaa^-1 = G' G.
    root: [[f64; A]; A],
}

/// State of an element at a displacement: gradient and enhanced strain at the points.
struct Strained<const D: usize, const S: usize, const N: usize> {
    parts: [Parts<D>; N],
    strain: [[f64; S]; N],
}

impl<const D: usize, const S: usize, const N: usize, const A: usize> Shape<D, S, N, A> {
    pub(super) fn new(reference: Reference<D, S, N, A>, material: &StVenantKirchhoff) -> Self {
        let mode_stress = std::array::from_fn(|q| {
            mode_stress::<D, S, A>(material, reference.points[q].weight, &reference.modes[q])
        });
        let root = root(&reference.modes, &mode_stress);
        Self { reference, mode_stress, root }
    }

    #[inline]
    fn strained(&self, kinematics: Kinematics, displacement: &[f64]) -> Result<Strained<D, S, N>, Collapse> {
        let (mut strain, parts) = self.reference.strains(kinematics, displacement)?;
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
        Ok(Strained { parts, strain })
    }

    /// Adds L = integral B'C M of point q, `[N, D, A]`.
    #[inline]
    fn add_coupling(&self, q: usize, strain: &[[[f64; S]; D]; N], coupling: &mut [[[f64; A]; D]; N]) {
        for (row, strain) in coupling.as_flattened_mut().iter_mut().zip(strain.as_flattened()) {
            for s in 0..S {
                for m in 0..A {
                    row[m] += strain[s] * self.mode_stress[q][s][m];
                }
            }
        }
    }

    /// Makes L G' of L.
    #[inline]
    fn take_root(&self, coupling: &mut [[[f64; A]; D]; N]) {
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
            shape.reference.add_force(q, &state.parts[q], &stress, force);
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
        let mut coupling = [[[0.0; A]; D]; N];
        let stress_of = |strain: &[f64; S]| self.material.second_pk_stress::<D, S>(strain);
        for q in 0..N {
            let stress = stress_tensor(&stress_of(&state.strain[q]));
            let initial = (self.kinematics != Kinematics::Linear).then_some(&stress);
            let strain = shape.reference.strain_derivative(q, &state.parts[q]);
            shape.reference.add_tangent(q, &strain, stress_of, (&state.parts[q], initial), tangent);
            shape.add_coupling(q, &strain, &mut coupling);
        }
        shape.take_root(&mut coupling);
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
            let [before, after] = &states;
            let stress = middle_stress::<D, S, _>(&self.material, &before.strain[q], &after.strain[q])?;
            let parts = Parts::middle(&before.parts[q], &after.parts[q]);
            shape.reference.add_force(q, &parts, &stress, force);
        }
        Ok(())
    }

    fn strain_energy(&self, element: usize, displacement: &[f64], _: &[f64]) -> f64 {
        let shape = self.shape(element);
        let Ok(state) = shape.strained(self.kinematics, displacement) else { return f64::NAN };
        let energy = |q: usize| {
            let density = Material::<D, S>::energy_density(&self.material, &state.strain[q], &[]);
            shape.reference.points[q].weight * density + shape.reference.own_energy(q, &state.parts[q])
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
            cauchy_stress(&state.parts[q].deformation, &second, across)
        });
        self.extrapolation.to_nodes(&at_points, stress);
        shape.reference.points.iter().map(|point| point.weight).sum()
    }
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
