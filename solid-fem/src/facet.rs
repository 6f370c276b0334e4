//! Integration over facets in their current place, by their own shape functions.

use crate::cell::{Cell, MAX_NODES, Shape};

/// Most nodes a facet has.
pub(crate) const MAX_FACET_NODES: usize = 8;

/// The quadrature of a facet.
#[derive(Debug, Clone)]
pub(crate) struct FacetRule {
    nodes: usize,
    is_segment: bool,
    points: Vec<(Shape, f64)>,
}

impl FacetRule {
    /// Exact for loads and positions that vary as the shape functions do (on flat facets).
    pub(crate) fn new(facet: Cell) -> Self {
        let points = facet.mass_rule().iter().map(|q| (facet.shape(&q.at), q.weight)).collect();
        Self { nodes: facet.nodes(), is_segment: facet.dimension() == 1, points }
    }

    /// Nodes of the facet.
    pub(crate) fn nodes(&self) -> usize {
        self.nodes
    }

    /// Visits the integration points of one facet: shape functions and outward area vector, m2 (m in 2-D).
    ///
    /// `position` are the current positions of its nodes.
    #[inline]
    pub(crate) fn for_each_point(
        &self,
        position: &[[f64; 3]; MAX_FACET_NODES],
        mut visit: impl FnMut(&[f64; MAX_NODES], [f64; 3]),
    ) {
        for (shape, weight) in &self.points {
            let mut along = [[0.0; 3]; 2];
            for (position, derivative) in position.iter().zip(&shape.derivative).take(self.nodes) {
                for i in 0..3 {
                    along[0][i] += position[i] * derivative[0];
                    along[1][i] += position[i] * derivative[1];
                }
            }
            let [t, s] = along;
            let area = if self.is_segment { [t[1], -t[0], 0.0] } else { cross(t, s) };
            visit(&shape.value, area.map(|component| weight * component));
        }
    }
}

/// Current positions of the nodes of a facet.
#[inline]
pub(crate) fn positions(
    nodes: &[usize],
    dimension: usize,
    coordinate: impl Fn(usize) -> f64,
) -> [[f64; 3]; MAX_FACET_NODES] {
    let mut positions = [[0.0; 3]; MAX_FACET_NODES];
    for (position, &node) in positions.iter_mut().zip(nodes) {
        for axis in 0..dimension {
            position[axis] = coordinate(node * dimension + axis);
        }
    }
    positions
}

/// Length of a vector.
pub(crate) fn norm(a: [f64; 3]) -> f64 {
    (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt()
}

/// a x b.
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
