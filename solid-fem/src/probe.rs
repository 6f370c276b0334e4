//! A point of the body, embedded by the shape functions of the element it lies in.

use crate::box_grid::BoxGrid;
use crate::mesh::path;

/// Nodes and weights that give any nodal quantity at the point.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// Node and its shape function there.
    pub weights: Vec<(usize, f64)>,
}

impl Probe {
    /// The probe at a reference position, m; `None` outside the body (a millionth of its size is forgiven).
    pub fn at(grid: &BoxGrid, is_simplex: bool, position: &[f64]) -> Option<Self> {
        let (mut cell, mut xi) = ([0usize; 3], [0.0; 3]);
        for axis in 0..grid.dimension {
            let along = (position[axis] - grid.minimum[axis]) / grid.extent(axis);
            if !(-1e-6..=1.0 + 1e-6).contains(&along) {
                return None;
            }
            let along = along.clamp(0.0, 1.0) * grid.cells[axis] as f64;
            cell[axis] = (along.floor() as usize).min(grid.cells[axis] - 1);
            xi[axis] = along - cell[axis] as f64;
        }
        Some(if is_simplex { Self::in_simplex(grid, cell, xi) } else { Self::in_box(grid, cell, xi) })
    }

    /// Products of linear functions.
    fn in_box(grid: &BoxGrid, cell: [usize; 3], xi: [f64; 3]) -> Self {
        let corner = |corner: usize| {
            let offset = [corner & 1, corner >> 1 & 1, corner >> 2];
            let factor = |axis: usize| if offset[axis] == 1 { xi[axis] } else { 1.0 - xi[axis] };
            let weight = (0..grid.dimension).map(factor).product();
            (grid.node([0, 1, 2].map(|axis| cell[axis] + offset[axis])), weight)
        };
        Self { weights: (0..1 << grid.dimension).map(corner).collect() }
    }

    /// The simplex whose path takes the axes in the order of the distance gone along them.
    fn in_simplex(grid: &BoxGrid, cell: [usize; 3], xi: [f64; 3]) -> Self {
        let gone = |axis: usize| if cell[axis] % 2 == 1 { 1.0 - xi[axis] } else { xi[axis] };
        let mut axes: Vec<usize> = (0..grid.dimension).collect();
        axes.sort_by(|&a, &b| gone(b).total_cmp(&gone(a)));
        let ends = |order: usize| match order {
            0 => 1.0,
            _ => axes.get(order - 1).map_or(0.0, |&axis| gone(axis)),
        };
        let nodes = path(grid, cell, &axes).enumerate();
        Self { weights: nodes.map(|(order, node)| (node, ends(order) - ends(order + 1))).collect() }
    }

    /// A nodal quantity `[n, D]` at the point; components beyond D are 0.
    pub fn value(&self, nodal: &[f64], dimension: usize) -> [f64; 3] {
        let mut value = [0.0; 3];
        for &(node, weight) in &self.weights {
            for axis in 0..dimension {
                value[axis] += weight * nodal[node * dimension + axis];
            }
        }
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reproduces_linear_fields() {
        let grid =
            BoxGrid { dimension: 3, minimum: [1.0, 0.0, 0.0], maximum: [2.0, 3.0, 1.0], cells: [2, 3, 2] };
        let field = grid.reference_position();
        for is_simplex in [false, true] {
            for position in [[1.0, 0.0, 0.0], [1.3, 2.9, 0.7], [2.0, 3.0, 1.0], [1.51, 1.1, 0.2]] {
                let value = Probe::at(&grid, is_simplex, &position).unwrap().value(&field, 3);
                (0..3).for_each(|i| assert!((value[i] - position[i]).abs() < 1e-14));
            }
            assert_eq!(Probe::at(&grid, is_simplex, &[0.9, 0.0, 0.0]), None);
        }
    }
}
