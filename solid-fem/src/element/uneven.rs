//! Strain of the enhanced elements before their modes are added: E = (H + H' + H'H - U'U)/2, U the part of the
//! displacement gradient H that is uneven along the short edges of a slender cell.
//!
//! Without the last term slender cells make hourglasses under pressure across them. Modes relax the bending of a cell
//! of width a and height b to a stiffness E (b/a)^2, but stress S across it works on the whole square of the bending:
//! the tangent loses its sign at -S = E (b/a)^2, at 20:1 a 400th of E, where the real body is far from buckling
//! (P. Wriggers and S. Reese, Comput. Methods Appl. Mech. Eng. 135 (1996) 201, found it in cubes under half their height).
//!
//! H less its mean over the cell is what bends it: its derivative along own axis i grows with the other axes j. Of this
//! the share w_ij counts for U, as much as the bending needs to bear -S = E/6, half the stress at which St.Venant-Kirchhoff
//! itself collapses: 1 - w_ij = 6 (l_i/l_j)^2, at most 1, l the lengths of the cell. So cells up to 2.4 times as long as
//! wide are those of the literature.
//!
//! Pressure that is not even across the cell, as on the inner side of a bent wall, would still find the relaxed mode: with
//! curvature c it ties the mode's size q to the shear g of the cell by E c g q a^2/12, against G g^2/2 and E q^2 b^2/24, and the
//! tangent loses its sign at a strain c a/2 of about 1.2 b/a of the outer fibres: 8 % at 14:1. So what is left out of the
//! strain has a law of its own, the energy k/2 (U'U/2) C (U'U/2): of fourth order in the bending, it gives the mode the
//! stiffness k E c^2 a^4/160, which holds at any b/a and c from k = 2.2 on (nu = 0, alternating modes of a stack).
//!
//! U vanishes in affine motion and turns with the body: patch test, rigid rotation and the conservation of momenta and
//! energy stay. What is left out is of second order in the size of the cell, as is the error of the element.

use super::Collapse;
use super::enhancement::Reference;
use super::kinematics::{
    Kinematics, deformation_gradient, green_lagrange_strain, half_square, small_strain, stress_tensor,
};
use super::matrix::{dot, inverse, product, times, unit};
use super::point::Point;
use crate::material::StVenantKirchhoff;
use crate::quadrature::QuadraturePoint;

/// Pressure across a cell over Young's modulus that its bending bears at least.
const BORNE: f64 = 1.0 / 6.0;

/// k, with room for Poisson's ratio and for strain that changes along the wall: stacks of 20:1 and 40:1 then bend to 28 % of
/// strain, with k = 3 to 18 %; costs 0.8 % of stiffness at 13 %.
const OWN: f64 = 6.0;

/// The displacement gradient at a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parts<const D: usize> {
    /// F = I + H; I in linear kinematics.
    pub(super) deformation: [[f64; D]; D],
    /// U; 0 in linear kinematics.
    uneven: [[f64; D]; D],
    /// k C U'U/2, Pa.
    own_stress: [[f64; D]; D],
}

/// U and the law its square has.
pub(super) struct Uneven<const D: usize, const N: usize> {
    /// Gradients that make U at the points, `[N, N, D]` 1/m.
    gradient: [[[f64; D]; N]; N],
    law: StVenantKirchhoff,
}

impl<const D: usize> Parts<D> {
    /// Halfway between two states.
    pub(super) fn middle(before: &Self, after: &Self) -> Self {
        let mean = |a: &[[f64; D]; D], b: &[[f64; D]; D]| {
            std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (a[i][j] + b[i][j])))
        };
        Self {
            deformation: mean(&before.deformation, &after.deformation),
            uneven: mean(&before.uneven, &after.uneven),
            own_stress: mean(&before.own_stress, &after.own_stress),
        }
    }
}

/// Gradients h_a of U = sum u_a h_a' at the points, `[N, N, D]` 1/m; `None` for squat cells. With J = dX/dxi at the centre the parts
/// of J' (g_a - mean g_a) along axis i that go with xi_j count by the root of w_ij, those with xi_j xi_k by the greater.
pub(super) fn uneven_gradients<const D: usize, const N: usize>(
    points: &[Point<D, N>; N],
    rule: &[QuadraturePoint],
    jacobian: &[[f64; D]; D],
    law: StVenantKirchhoff,
) -> Option<Uneven<D, N>> {
    let square: [f64; D] = std::array::from_fn(|j| (0..D).map(|i| jacobian[i][j].powi(2)).sum());
    let root = |i: usize, j: usize| (1.0 - square[i] / (square[j] * BORNE)).max(0.0).sqrt();
    let others = |i: usize| (0..D).filter(move |&j| j != i);
    if (0..D).all(|i| others(i).all(|j| root(i, j) == 0.0)) {
        return None;
    }
    let volume: f64 = points.iter().map(|point| point.weight).sum();
    let mean = |a: usize, j: usize| points.iter().map(|p| p.weight * p.gradient[a][j]).sum::<f64>() / volume;
    let mut uneven = [[[0.0; D]; N]; N];
    for a in 0..N {
        let mean: [f64; D] = std::array::from_fn(|j| mean(a, j));
        for i in 0..D {
            let own: [f64; N] = std::array::from_fn(|q| {
                (0..D).map(|j| jacobian[j][i] * (points[q].gradient[a][j] - mean[j])).sum()
            });
            // The part of `own` that goes with a product of own coordinates, which is orthogonal to the others.
            let part = |mode: &dyn Fn(&[f64; 3]) -> f64, q: usize| {
                let modes: [f64; N] = std::array::from_fn(|q| mode(&rule[q].at));
                let size: f64 = modes.iter().map(|mode| mode * mode).sum();
                modes[q] * own.iter().zip(&modes).map(|(own, mode)| own * mode).sum::<f64>() / size
            };
            for q in 0..N {
                for j in others(i) {
                    uneven[q][a][i] += root(i, j) * part(&|xi| xi[j], q);
                }
                let greatest = others(i).map(|j| root(i, j)).fold(0.0, f64::max);
                if D == 3 {
                    let product = |xi: &[f64; 3]| others(i).map(|j| xi[j]).product();
                    uneven[q][a][i] += greatest * part(&product, q);
                }
            }
        }
    }
    let back = inverse(jacobian);
    let turned = |own: [f64; D]| std::array::from_fn(|i| (0..D).map(|k| back[k][i] * own[k]).sum());
    Some(Uneven { gradient: uneven.map(|at_point| at_point.map(turned)), law })
}

impl<const D: usize, const S: usize, const N: usize, const A: usize> Reference<D, S, N, A> {
    /// Strain and gradient at every point.
    ///
    /// # Errors
    /// [`Collapse::Inverted`] when det F <= 0 at one.
    #[inline]
    pub(super) fn strains(
        &self,
        kinematics: Kinematics,
        displacement: &[f64],
    ) -> Result<([[f64; S]; N], [Parts<D>; N]), Collapse> {
        let none = Parts { deformation: unit(), uneven: [[0.0; D]; D], own_stress: [[0.0; D]; D] };
        let (mut strain, mut parts) = ([[0.0; S]; N], [none; N]);
        for q in 0..N {
            let gradient = self.points[q].displacement_gradient(displacement);
            if kinematics == Kinematics::Linear {
                strain[q] = small_strain(&gradient);
                continue;
            }
            strain[q] = green_lagrange_strain(&gradient);
            parts[q].deformation = deformation_gradient(&gradient)?;
            if let Some(point) = self.uneven(q) {
                parts[q].uneven = point.displacement_gradient(displacement);
                let square: [f64; S] = half_square(&parts[q].uneven);
                parts[q].own_stress = stress_tensor(&self.own_stress(&square));
                for s in 0..S {
                    strain[q][s] -= square[s];
                }
            }
        }
        Ok((strain, parts))
    }

    /// The gradients of U at point q, with what it gives counted as negative.
    #[inline]
    fn uneven(&self, q: usize) -> Option<Point<D, N>> {
        let uneven = self.uneven.as_ref()?;
        Some(Point { weight: -self.points[q].weight, gradient: uneven.gradient[q] })
    }

    /// k C of a square of U, Pa.
    #[inline]
    fn own_stress(&self, square: &[f64; S]) -> [f64; S] {
        let law = self.uneven.as_ref().map(|uneven| uneven.law);
        law.map_or([0.0; S], |law| law.second_pk_stress::<D, S>(square).map(|stress| OWN * stress))
    }

    /// Energy of the square of U at point q, J.
    pub(super) fn own_energy(&self, q: usize, parts: &Parts<D>) -> f64 {
        let square: [f64; S] = half_square(&parts.uneven);
        0.5 * self.points[q].weight * dot(&self.own_stress(&square), &square)
    }

    /// f_a += w [F S g_a - U (S - k C U'U/2) h_a].
    #[inline]
    pub(super) fn add_force(&self, q: usize, parts: &Parts<D>, stress: &[[f64; D]; D], force: &mut [f64]) {
        self.points[q].add_force(&product(&parts.deformation, stress), force);
        if let Some(point) = self.uneven(q) {
            point.add_force(&product(&parts.uneven, &less(stress, &parts.own_stress)), force);
        }
    }

    /// dE/du_ai at point q in Voigt order, `[N, D, S]`.
    #[inline]
    pub(super) fn strain_derivative(&self, q: usize, parts: &Parts<D>) -> [[[f64; S]; D]; N] {
        let mut strain = self.points[q].strain_derivative(&parts.deformation);
        if let Some(point) = self.uneven(q) {
            let uneven: [[[f64; S]; D]; N] = point.strain_derivative(&parts.uneven);
            for a in 0..N {
                for i in 0..D {
                    for s in 0..S {
                        strain[a][i][s] -= uneven[a][i][s];
                    }
                }
            }
        }
        strain
    }

    /// Adds the blocks b >= a of w B_a' C B_b, `stress_of` being C, and with an initial stress its own part and that of U.
    #[inline]
    pub(super) fn add_tangent(
        &self,
        q: usize,
        strain: &[[[f64; S]; D]; N],
        stress_of: impl Fn(&[f64; S]) -> [f64; S],
        (parts, initial): (&Parts<D>, Option<&[[f64; D]; D]>),
        tangent: &mut [f64],
    ) {
        let weight = self.points[q].weight;
        add_products(weight, strain, stress_of, tangent);
        let Some(stress) = initial else { return };
        add_initial(&self.points[q], stress, tangent);
        if let Some(point) = self.uneven(q) {
            add_initial(&point, &less(stress, &parts.own_stress), tangent);
            let square = point.strain_derivative(&parts.uneven);
            add_products(weight, &square, |square| self.own_stress(square), tangent);
        }
    }
}

/// A - B.
#[inline]
fn less<const D: usize>(a: &[[f64; D]; D], b: &[[f64; D]; D]) -> [[f64; D]; D] {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] - b[i][j]))
}

/// K_ab += w B_a' C B_b for b >= a, `stress_of` being C.
#[inline]
fn add_products<const D: usize, const S: usize, const N: usize>(
    weight: f64,
    strain: &[[[f64; S]; D]; N],
    stress_of: impl Fn(&[f64; S]) -> [f64; S],
    tangent: &mut [f64],
) {
    let size = N * D;
    let mut answer = [[[0.0; D]; N]; S];
    for b in 0..N {
        for j in 0..D {
            let stress = stress_of(&strain[b][j]);
            for s in 0..S {
                answer[s][b][j] = weight * stress[s];
            }
        }
    }
    for a in 0..N {
        for i in 0..D {
            let row = &mut tangent[(a * D + i) * size + a * D..(a * D + i + 1) * size];
            for s in 0..S {
                let factor = strain[a][i][s];
                for (entry, answer) in row.iter_mut().zip(answer[s][a..].as_flattened()) {
                    *entry += factor * answer;
                }
            }
        }
    }
}

/// K_ab += w (g_a.S g_b) I for b >= a.
#[inline]
fn add_initial<const D: usize, const N: usize>(
    point: &Point<D, N>,
    stress: &[[f64; D]; D],
    tangent: &mut [f64],
) {
    for b in 0..N {
        let turned = times(stress, &point.gradient[b]);
        for a in 0..=b {
            let value = point.weight * dot(&point.gradient[a], &turned);
            for i in 0..D {
                tangent[(a * D + i) * N * D + b * D + i] += value;
            }
        }
    }
}
