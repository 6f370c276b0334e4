//! Simplex elements of constant strain: one integration point.

use super::kinematics::{
    Point, deformation_gradient, determinant, green_lagrange_strain, inverse, mirror, product, stress_tensor,
};
use super::{Element, Inverted};
use crate::material::StVenantKirchhoff;
use crate::mesh::Mesh;

/// Triangle (D 2, S 3, N 3) or tetrahedron (D 3, S 6, N 4); S is the number of Voigt components.
pub struct ConstantStrain<const D: usize, const S: usize, const N: usize> {
    class: Vec<u32>,
    points: Vec<Point<D, N>>,
    material: StVenantKirchhoff,
}

impl<const D: usize, const S: usize, const N: usize> ConstantStrain<D, S, N> {
    pub(super) fn new(mesh: &Mesh, material: StVenantKirchhoff) -> Self {
        let (class, shapes) = mesh.shapes();
        Self { class, points: shapes.iter().map(|shape| Self::point(shape)).collect(), material }
    }

    /// Gradients of the barycentric coordinates.
    fn point(shape: &[f64]) -> Point<D, N> {
        let edges: [[f64; D]; D] = std::array::from_fn(|i| std::array::from_fn(|a| shape[(a + 1) * D + i]));
        let inverse = inverse(&edges);
        let mut gradient = [[0.0; D]; N];
        for a in 1..N {
            for i in 0..D {
                gradient[a][i] = inverse[a - 1][i];
                gradient[0][i] -= inverse[a - 1][i];
            }
        }
        Point { weight: determinant(&edges) / if D == 2 { 2.0 } else { 6.0 }, gradient }
    }
}

impl<const D: usize, const S: usize, const N: usize> Element for ConstantStrain<D, S, N> {
    fn internal_force(
        &self,
        element: usize,
        displacement: &[f64],
        force: &mut [f64],
    ) -> Result<(), Inverted> {
        let point = &self.points[self.class[element] as usize];
        let gradient = point.displacement_gradient(displacement);
        let stress = self.material.second_pk_stress::<D, S>(&green_lagrange_strain(&gradient));
        force.fill(0.0);
        point.add_force(&product(&deformation_gradient(&gradient)?, &stress_tensor(&stress)), force);
        Ok(())
    }

    fn tangent(
        &self,
        element: usize,
        displacement: &[f64],
        force: &mut [f64],
        tangent: &mut [f64],
    ) -> Result<(), Inverted> {
        let point = &self.points[self.class[element] as usize];
        let gradient = point.displacement_gradient(displacement);
        let deformation = deformation_gradient(&gradient)?;
        let stress = self.material.second_pk_stress::<D, S>(&green_lagrange_strain(&gradient));
        let stress = stress_tensor(&stress);
        force.fill(0.0);
        tangent.fill(0.0);
        point.add_force(&product(&deformation, &stress), force);
        point.add_tangent(&self.material, &deformation, &stress, tangent);
        mirror::<D, N>(tangent);
        Ok(())
    }

    fn strain_energy(&self, element: usize, displacement: &[f64]) -> f64 {
        let point = &self.points[self.class[element] as usize];
        let strain = green_lagrange_strain(&point.displacement_gradient(displacement));
        point.weight * self.material.energy_density::<D, S>(&strain)
    }

    /// Exact: V (1 + delta_ab) / ((D + 1)(D + 2)).
    fn shape_product(&self, element: usize, product: &mut [f64]) {
        let volume = self.points[self.class[element] as usize].weight;
        let share = volume / ((D + 1) * (D + 2)) as f64;
        for a in 0..N {
            for b in 0..N {
                product[a * N + b] = if a == b { 2.0 * share } else { share };
            }
        }
    }
}
