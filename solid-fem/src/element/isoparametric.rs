//! Displacement elements of any cell: shape functions, their gradients in the unloaded shape, quadrature.
//!
//! The plain element: 3-node triangle and 4-node tetrahedron (second order in L2 but far too stiff in bending), 6-node
//! triangle, 8-node quadrilateral, 10-node tetrahedron and 20-node hexahedron (third order), all with full integration:
//! the 20-node hexahedron with reduced integration diverges at large displacement and is not offered.

use super::kinematics::{Kinematics, Sample, stress_tensor};
use super::matrix::{determinant, inverse, product};
use super::point::{Point, mirror};
use super::{Collapse, Element, Extrapolation, cauchy_stress, middle_stress};
use crate::cell::Cell;
use crate::material::{History, Material, Moduli};
use crate::mesh::Mesh;

/// Elements of a mesh with D dimensions, S Voigt components, N nodes and material M.
pub struct Isoparametric<const D: usize, const S: usize, const N: usize, M> {
    class: Vec<u32>,
    /// Points of all classes, `[classes, points]`.
    points: Vec<Point<D, N>>,
    points_per_element: usize,
    /// Integral of N_a N_b of all classes, `[classes, N, N]`.
    products: Vec<f64>,
    extrapolation: Extrapolation,
    material: M,
    kinematics: Kinematics,
}

impl<const D: usize, const S: usize, const N: usize, M: Material<D, S>> Isoparametric<D, S, N, M> {
    pub(super) fn new(mesh: &Mesh, material: M, kinematics: Kinematics) -> Self {
        let (class, shapes) = mesh.shapes();
        let rule = mesh.cell.stiffness_rule();
        let place =
            |shape: &[f64], q: &crate::quadrature::QuadraturePoint| point(mesh.cell, shape, &q.at, q.weight);
        let points = shapes.iter().flat_map(|shape| rule.iter().map(move |q| place(shape, q))).collect();
        let products = shapes.iter().flat_map(|shape| shape_product::<D, N>(mesh.cell, shape)).collect();
        let extrapolation = Extrapolation::new(mesh.cell, &rule);
        Self { class, points, points_per_element: rule.len(), products, extrapolation, material, kinematics }
    }

    #[inline]
    fn points(&self, element: usize) -> &[Point<D, N>] {
        let count = self.points_per_element;
        &self.points[self.class[element] as usize * count..][..count]
    }

    /// What is kept at point q.
    #[inline]
    fn history<'h>(&self, history: &'h mut History<'_>, q: usize) -> History<'h> {
        let len = self.material.history_len();
        History { old: &history.old[q * len..][..len], new: &mut history.new[q * len..][..len] }
    }
}

/// The point at own coordinates `at`: gradients by the inverse of J_ij = dX_i / dxi_j.
pub(super) fn point<const D: usize, const N: usize>(
    cell: Cell,
    position: &[f64],
    at: &[f64; 3],
    weight: f64,
) -> Point<D, N> {
    let shape = cell.shape(at);
    let jacobian: [[f64; D]; D] = std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..N).map(|a| position[a * D + i] * shape.derivative[a][j]).sum())
    });
    let inverse = inverse(&jacobian);
    let gradient = std::array::from_fn(|a| {
        std::array::from_fn(|i| (0..D).map(|j| shape.derivative[a][j] * inverse[j][i]).sum())
    });
    Point { weight: weight * determinant(&jacobian), gradient }
}

/// Integral of N_a N_b, `[N, N]` m3.
pub(super) fn shape_product<const D: usize, const N: usize>(cell: Cell, position: &[f64]) -> Vec<f64> {
    let mut product = vec![0.0; N * N];
    for q in cell.mass_rule() {
        let weight = point::<D, N>(cell, position, &q.at, q.weight).weight;
        let value = cell.shape(&q.at).value;
        for a in 0..N {
            for b in 0..N {
                product[a * N + b] += weight * value[a] * value[b];
            }
        }
    }
    product
}

impl<const D: usize, const S: usize, const N: usize, M: Material<D, S>> Element
    for Isoparametric<D, S, N, M>
{
    fn history_len(&self) -> usize {
        self.points_per_element * self.material.history_len()
    }

    fn internal_force(
        &self,
        element: usize,
        displacement: &[f64],
        mut history: History<'_>,
        force: &mut [f64],
    ) -> Result<(), Collapse> {
        force.fill(0.0);
        for (q, point) in self.points(element).iter().enumerate() {
            let gradient = point.displacement_gradient(displacement);
            let (strain, deformation) = self.kinematics.strain::<D, S>(&gradient)?;
            let stress = stress_tensor(&self.material.stress(&strain, self.history(&mut history, q))?);
            let moduli = Moduli::Lame(0.0, 0.0);
            let sample = Sample::<D, S, N> { point: *point, deformation, stress, moduli };
            match self.kinematics {
                Kinematics::UpdatedLagrangian => sample.push_forward().add_force(force),
                _ => sample.add_force(force),
            }
        }
        Ok(())
    }

    fn tangent(
        &self,
        element: usize,
        displacement: &[f64],
        mut history: History<'_>,
        tangent: &mut [f64],
    ) -> Result<(), Collapse> {
        tangent.fill(0.0);
        for (q, point) in self.points(element).iter().enumerate() {
            let gradient = point.displacement_gradient(displacement);
            let (strain, deformation) = self.kinematics.strain::<D, S>(&gradient)?;
            let (stress, moduli) = self.material.response(&strain, self.history(&mut history, q))?;
            let sample =
                Sample::<D, S, N> { point: *point, deformation, stress: stress_tensor(&stress), moduli };
            match self.kinematics {
                Kinematics::UpdatedLagrangian => sample.push_forward().add_tangent(self.kinematics, tangent),
                _ => sample.add_tangent(self.kinematics, tangent),
            }
        }
        mirror::<D, N>(tangent);
        Ok(())
    }

    fn conserving_force(
        &self,
        element: usize,
        [before, after]: [&[f64]; 2],
        force: &mut [f64],
    ) -> Result<(), Collapse> {
        force.fill(0.0);
        for point in self.points(element) {
            let gradients = [before, after].map(|displacement| point.displacement_gradient(displacement));
            let [before, after] = gradients;
            let states = [self.kinematics.strain::<D, S>(&before)?, self.kinematics.strain(&after)?];
            let stress = middle_stress(&self.material, &states[0].0, &states[1].0)?;
            let middle = std::array::from_fn(|i| {
                std::array::from_fn(|j| 0.5 * (states[0].1[i][j] + states[1].1[i][j]))
            });
            point.add_force(&product(&middle, &stress), force);
        }
        Ok(())
    }

    fn strain_energy(&self, element: usize, displacement: &[f64], old: &[f64]) -> f64 {
        let len = self.material.history_len();
        let density = |(q, point): (usize, &Point<D, N>)| {
            let state = self.kinematics.strain::<D, S>(&point.displacement_gradient(displacement));
            let (strain, _) = state.unwrap_or(([f64::NAN; S], [[0.0; D]; D]));
            point.weight * self.material.energy_density(&strain, &old[q * len..][..len])
        };
        self.points(element).iter().enumerate().map(density).sum()
    }

    fn shape_product(&self, element: usize, product: &mut [f64]) {
        product.copy_from_slice(&self.products[self.class[element] as usize * N * N..][..N * N]);
    }

    fn nodal_stress(
        &self,
        element: usize,
        displacement: &[f64],
        old: &[f64],
        stress: &mut [[f64; 6]],
    ) -> f64 {
        let len = self.material.history_len();
        let mut at_points = Vec::with_capacity(self.points_per_element);
        for (q, point) in self.points(element).iter().enumerate() {
            let gradient = point.displacement_gradient(displacement);
            let Ok((strain, deformation)) = self.kinematics.strain::<D, S>(&gradient) else {
                return 0.0;
            };
            let (second, across) = self.material.in_space(&strain, &old[q * len..][..len]);
            at_points.push(cauchy_stress(&deformation, &second, across));
        }
        self.extrapolation.to_nodes(&at_points, stress);
        self.points(element).iter().map(|point| point.weight).sum()
    }
}
