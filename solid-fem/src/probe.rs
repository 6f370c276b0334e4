//! A point of the body, embedded by the shape functions of the element it lies in.

use crate::cell::{Cell, MAX_NODES};
use crate::element::matrix::inverse;
use crate::mesh::Mesh;

/// How far outside its element, in own coordinates, a point may lie.
const SLACK: f64 = 1e-6;

/// Newton iterations for the own coordinates; one is enough in parallelepipeds and straight simplices.
const ITERATIONS: usize = 20;

/// Nodes and weights that give any nodal quantity at the point.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// Node and its shape function there.
    pub weights: Vec<(usize, f64)>,
}

impl Probe {
    /// The probe at a reference position, m; `None` outside the body (a millionth of an element is forgiven).
    pub fn at(mesh: &Mesh, position: &[f64]) -> Option<Self> {
        (0..mesh.element_count()).filter(|&element| is_near(mesh, element, position)).find_map(|element| {
            let own = match mesh.dimension {
                2 => own_coordinates::<2>(mesh, element, position),
                _ => own_coordinates::<3>(mesh, element, position),
            }?;
            let value = mesh.cell.shape(&own).value;
            Some(Self { weights: mesh.element(element).iter().copied().zip(value).collect() })
        })
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

/// Whether the point lies in the box around the element, widened by half.
fn is_near(mesh: &Mesh, element: usize, position: &[f64]) -> bool {
    let d = mesh.dimension;
    (0..d).all(|axis| {
        let along = mesh.element(element).iter().map(|&node| mesh.reference_position[node * d + axis]);
        let (low, high) =
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let slack = 0.1 * (high - low);
        (low - slack..=high + slack).contains(&position[axis])
    })
}

/// Own coordinates of a point by Newton's method; `None` outside the element.
fn own_coordinates<const D: usize>(mesh: &Mesh, element: usize, position: &[f64]) -> Option<[f64; 3]> {
    let nodes = mesh.element(element);
    let mut own = [0.0; 3];
    for _ in 0..ITERATIONS {
        let shape = mesh.cell.shape(&own);
        let mut distance: [f64; D] = std::array::from_fn(|i| position[i]);
        let mut jacobian = [[0.0; D]; D];
        for (a, &node) in nodes.iter().enumerate().take(MAX_NODES) {
            for i in 0..D {
                let x = mesh.reference_position[node * D + i];
                distance[i] -= shape.value[a] * x;
                for j in 0..D {
                    jacobian[i][j] += shape.derivative[a][j] * x;
                }
            }
        }
        let inverse = inverse(&jacobian);
        let step: [f64; D] = std::array::from_fn(|i| (0..D).map(|j| inverse[i][j] * distance[j]).sum());
        (0..D).for_each(|i| own[i] += step[i]);
        if step.iter().all(|step| step.abs() < 1e-13) {
            break;
        }
    }
    is_inside(mesh.cell, &own).then_some(own)
}

fn is_inside(cell: Cell, own: &[f64; 3]) -> bool {
    let own = &own[..cell.dimension()];
    if cell.is_simplex() {
        own.iter().all(|&x| x >= -SLACK) && own.iter().sum::<f64>() <= 1.0 + SLACK
    } else {
        own.iter().all(|&x| x.abs() <= 1.0 + SLACK)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::box_grid::BoxGrid;
    use crate::element::ElementKind;

    #[test]
    fn reproduces_linear_fields() {
        for kind in ElementKind::ALL {
            let (minimum, maximum) = ([1.0, 0.0, 0.0], [2.0, 3.0, 1.0]);
            let grid = BoxGrid { dimension: kind.dimension(), minimum, maximum, cells: [2, 3, 2] };
            let mesh = Mesh::of_box(&grid, kind.cell());
            let d = mesh.dimension;
            for position in [[1.0, 0.0, 0.0], [1.3, 2.9, 0.7], [2.0, 3.0, 1.0], [1.51, 1.1, 0.2]] {
                let value = Probe::at(&mesh, &position).unwrap().value(&mesh.reference_position, d);
                (0..d).for_each(|i| assert!((value[i] - position[i]).abs() < 1e-13, "{kind:?} {value:?}"));
            }
            assert_eq!(Probe::at(&mesh, &[0.9, 0.0, 0.0]), None);
        }
    }
}
