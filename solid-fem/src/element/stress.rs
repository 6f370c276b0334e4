//! Cauchy stress from S, and its way from the integration points to the nodes.

use nalgebra::DMatrix;

use crate::cell::Cell;
use crate::material::tensor::{Tensor, of_stress, product, voigt};
use crate::quadrature::QuadraturePoint;

/// sigma = F S F' / J, Voigt order in space; `across` is the stretch across the plane in 2-D.
pub(crate) fn cauchy_stress<const D: usize>(
    deformation: &[[f64; D]; D],
    second_pk_stress: &[f64; 6],
    across: f64,
) -> [f64; 6] {
    let mut whole: Tensor = [[0.0; 3]; 3];
    whole[2][2] = across;
    for i in 0..D {
        for j in 0..D {
            whole[i][j] = deformation[i][j];
        }
    }
    let jacobian = super::matrix::determinant(&whole);
    let turned = product(&whole, &of_stress(second_pk_stress));
    let turned = std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..3).map(|k| turned[i][k] * whole[j][k]).sum::<f64>() / jacobian)
    });
    voigt(&turned)
}

/// Values at the nodes of a cell from those at its integration points: the linear function closest to them.
pub(crate) struct Extrapolation {
    /// `[N, points]`.
    weights: Vec<Vec<f64>>,
}

impl Extrapolation {
    pub(crate) fn new(cell: Cell, rule: &[QuadraturePoint]) -> Self {
        let d = if rule.len() == 1 { 0 } else { cell.dimension() };
        let row = |at: &[f64; 3], column: usize| if column == 0 { 1.0 } else { at[column - 1] };
        let terms = DMatrix::from_fn(rule.len(), 1 + d, |q, column| row(&rule[q].at, column));
        let normal = terms.transpose() * &terms;
        let fit = normal.try_inverse().expect("the points of a rule span the cell") * terms.transpose();
        let weights = (0..cell.nodes()).map(|a| {
            let at = cell.node(a);
            let weight = |q: usize| (0..=d).map(|column| row(&at, column) * fit[(column, q)]).sum();
            (0..rule.len()).map(weight).collect()
        });
        Self { weights: weights.collect() }
    }

    pub(crate) fn to_nodes(&self, at_points: &[[f64; 6]], nodal: &mut [[f64; 6]]) {
        for (nodal, weights) in nodal.iter_mut().zip(&self.weights) {
            *nodal =
                std::array::from_fn(|s| weights.iter().zip(at_points).map(|(w, point)| w * point[s]).sum());
        }
    }
}
