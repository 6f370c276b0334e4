//! The enhanced elements of [`super::enhanced`] in a law that is not linear in E: alpha is found by Newton's method in
//! the element, alpha -= Kaa^-1 integral M'S, starting from that of the last accepted state, so that force and tangent
//! are functions of the displacement and the history as those of any other element.
//!
//! History per element: alpha, then that of the integration points.

use nalgebra::{SMatrix, SVector};

use super::enhancement::Reference;
use super::kinematics::{Kinematics, full_moduli, stress_tensor};
use super::point::mirror;
use super::uneven::Parts;
use super::{Collapse, Element, Extrapolation, cauchy_stress};
use crate::material::{History, InSpace, Material};

/// Iterations for alpha.
const ITERATIONS: usize = 30;

/// Residual of the enhanced work over the sum of its parts at which alpha is found.
const TOLERANCE: f64 = 1e-13;

/// Quadrilaterals or hexahedra with A enhanced modes in any law.
pub struct EnhancedIterated<const D: usize, const S: usize, const N: usize, const A: usize> {
    pub(super) class: Vec<u32>,
    pub(super) references: Vec<Reference<D, S, N, A>>,
    pub(super) extrapolation: Extrapolation,
    pub(super) material: InSpace,
    pub(super) kinematics: Kinematics,
}

/// An element whose enhanced work vanishes.
struct Settled<const D: usize, const S: usize, const N: usize, const A: usize> {
    parts: [Parts<D>; N],
    strain: [[f64; S]; N],
    stress: [[f64; S]; N],
    moduli: [[[f64; S]; S]; N],
    /// Kaa = integral M'C M.
    stiffness: SMatrix<f64, A, A>,
}

impl<const D: usize, const S: usize, const N: usize, const A: usize> EnhancedIterated<D, S, N, A>
where
    InSpace: Material<D, S>,
{
    fn reference(&self, element: usize) -> &Reference<D, S, N, A> {
        &self.references[self.class[element] as usize]
    }

    fn kept(&self) -> usize {
        Material::<D, S>::history_len(&self.material)
    }

    fn settle(
        &self,
        element: usize,
        displacement: &[f64],
        history: History<'_>,
    ) -> Result<Settled<D, S, N, A>, Collapse> {
        let (reference, kept) = (self.reference(element), self.kept());
        let (plain, parts) = reference.strains(self.kinematics, displacement)?;
        let mut alpha = SVector::<f64, A>::from_column_slice(&history.old[..A]);
        let mut state = Settled {
            parts,
            strain: [[0.0; S]; N],
            stress: [[0.0; S]; N],
            moduli: [[[0.0; S]; S]; N],
            stiffness: SMatrix::<f64, A, A>::zeros(),
        };
        for _ in 0..ITERATIONS {
            let (mut work, mut size) = (SVector::<f64, A>::zeros(), 0.0);
            state.stiffness = SMatrix::<f64, A, A>::zeros();
            for q in 0..N {
                let modes = &reference.modes[q];
                let enhanced = |s: usize| (0..A).map(|m| modes[s][m] * alpha[m]).sum::<f64>();
                state.strain[q] = std::array::from_fn(|s| plain[q][s] + enhanced(s));
                let (old, new) =
                    (&history.old[A + q * kept..][..kept], &mut history.new[A + q * kept..][..kept]);
                let (stress, moduli) = self.material.response(&state.strain[q], History { old, new })?;
                (state.stress[q], state.moduli[q]) = (stress, full_moduli::<D, S>(&moduli));
                let weight = reference.points[q].weight;
                for m in 0..A {
                    for s in 0..S {
                        work[m] += weight * modes[s][m] * stress[s];
                        size += (weight * modes[s][m] * state.moduli[q][s][s] * state.strain[q][s]).abs();
                    }
                }
                add_products(weight, modes, &state.moduli[q], &mut state.stiffness);
            }
            if work.norm() <= TOLERANCE * size {
                history.new[..A].copy_from_slice(alpha.as_slice());
                return Ok(state);
            }
            let inverse = state.stiffness.try_inverse().ok_or(Collapse::Unsolvable)?;
            alpha -= inverse * work;
        }
        Err(Collapse::Unsolvable)
    }

    /// State at a displacement with what is kept of the last one.
    fn at_rest(&self, element: usize, displacement: &[f64], old: &[f64]) -> Option<Settled<D, S, N, A>> {
        let mut new = old.to_vec();
        self.settle(element, displacement, History { old, new: &mut new }).ok()
    }
}

/// Adds w M'C M.
fn add_products<const S: usize, const A: usize>(
    weight: f64,
    modes: &[[f64; A]; S],
    moduli: &[[f64; S]; S],
    stiffness: &mut SMatrix<f64, A, A>,
) {
    for n in 0..A {
        let answer: [f64; S] = std::array::from_fn(|s| (0..S).map(|t| moduli[s][t] * modes[t][n]).sum());
        for m in 0..A {
            for s in 0..S {
                stiffness[(m, n)] += weight * modes[s][m] * answer[s];
            }
        }
    }
}

impl<const D: usize, const S: usize, const N: usize, const A: usize> Element for EnhancedIterated<D, S, N, A>
where
    InSpace: Material<D, S>,
{
    fn history_len(&self) -> usize {
        A + N * self.kept()
    }

    fn internal_force(
        &self,
        element: usize,
        displacement: &[f64],
        history: History<'_>,
        force: &mut [f64],
    ) -> Result<(), Collapse> {
        let state = self.settle(element, displacement, history)?;
        force.fill(0.0);
        for q in 0..N {
            let stress = stress_tensor(&state.stress[q]);
            self.reference(element).add_force(q, &state.parts[q], &stress, force);
        }
        Ok(())
    }

    /// K - L Kaa^-1 L', L = integral B'C M.
    fn tangent(
        &self,
        element: usize,
        displacement: &[f64],
        history: History<'_>,
        tangent: &mut [f64],
    ) -> Result<(), Collapse> {
        let state = self.settle(element, displacement, history)?;
        let reference = self.reference(element);
        tangent.fill(0.0);
        let mut coupling = vec![SVector::<f64, A>::zeros(); N * D];
        for q in 0..N {
            let (stress, moduli) = (stress_tensor(&state.stress[q]), &state.moduli[q]);
            let initial = (self.kinematics != Kinematics::Linear).then_some(&stress);
            let stress_of =
                |strain: &[f64; S]| std::array::from_fn(|s| super::matrix::dot(&moduli[s], strain));
            let strain = reference.strain_derivative(q, &state.parts[q]);
            reference.add_tangent(q, &strain, stress_of, (&state.parts[q], initial), tangent);
            for m in 0..A {
                let column: [f64; S] = std::array::from_fn(|s| {
                    let answer = |t: usize| moduli[s][t] * reference.modes[q][t][m];
                    reference.points[q].weight * (0..S).map(answer).sum::<f64>()
                });
                for (row, strain) in strain.as_flattened().iter().enumerate() {
                    coupling[row][m] += super::matrix::dot(strain, &column);
                }
            }
        }
        let inverse = state.stiffness.try_inverse().ok_or(Collapse::Unsolvable)?;
        for (row, left) in coupling.iter().enumerate() {
            let left = inverse * left;
            for (column, right) in coupling.iter().enumerate().skip(row / D * D) {
                tangent[row * N * D + column] -= left.dot(right);
            }
        }
        mirror::<D, N>(tangent);
        Ok(())
    }

    fn conserving_force(&self, _: usize, _: [&[f64]; 2], _: &mut [f64]) -> Result<(), Collapse> {
        Err(Collapse::Unsolvable)
    }

    fn strain_energy(&self, element: usize, displacement: &[f64], old: &[f64]) -> f64 {
        let Some(state) = self.at_rest(element, displacement, old) else { return f64::NAN };
        let kept = self.kept();
        let energy = |q: usize| {
            let old = &old[A + q * kept..][..kept];
            let density = Material::<D, S>::energy_density(&self.material, &state.strain[q], old);
            let reference = self.reference(element);
            reference.points[q].weight * density + reference.own_energy(q, &state.parts[q])
        };
        (0..N).map(energy).sum()
    }

    fn shape_product(&self, element: usize, product: &mut [f64]) {
        product.copy_from_slice(&self.reference(element).product);
    }

    fn nodal_stress(
        &self,
        element: usize,
        displacement: &[f64],
        old: &[f64],
        stress: &mut [[f64; 6]],
    ) -> f64 {
        let Some(state) = self.at_rest(element, displacement, old) else { return 0.0 };
        let kept = self.kept();
        let at_points: [[f64; 6]; N] = std::array::from_fn(|q| {
            let old = &old[A + q * kept..][..kept];
            let (second, across) = Material::<D, S>::in_space(&self.material, &state.strain[q], old);
            cauchy_stress(&state.parts[q].deformation, &second, across)
        });
        self.extrapolation.to_nodes(&at_points, stress);
        self.reference(element).points.iter().map(|point| point.weight).sum()
    }
}
