//! Integration over facets in their current place.

use protocol::interface::Facets;

/// Visits the integration points of one facet: shape functions, `[4]`, and outward area vector, m2 (m in 2-D).
///
/// `corners` are the current positions of its nodes, `[2..4]`; exact for loads and positions that vary as the shape
/// functions do (on flat facets).
pub(crate) fn for_each_point(corners: &[[f64; 3]], mut visit: impl FnMut(&[f64; 4], [f64; 3])) {
    let gauss = 1.0 / 3.0f64.sqrt();
    match corners.len() {
        2 => {
            let half = [0, 1].map(|i| 0.5 * (corners[1][i] - corners[0][i]));
            for xi in [-gauss, gauss] {
                visit(&[0.5 * (1.0 - xi), 0.5 * (1.0 + xi), 0.0, 0.0], [half[1], -half[0], 0.0]);
            }
        }
        3 => {
            let area =
                cross(minus(&corners[1], &corners[0]), minus(&corners[2], &corners[0])).map(|c| c / 6.0);
            for lone in 0..3 {
                let mut shape = [1.0 / 6.0, 1.0 / 6.0, 1.0 / 6.0, 0.0];
                shape[lone] = 2.0 / 3.0;
                visit(&shape, area);
            }
        }
        _ => {
            for (xi, eta) in [(-gauss, -gauss), (gauss, -gauss), (gauss, gauss), (-gauss, gauss)] {
                let (left, right, down, up) = (1.0 - xi, 1.0 + xi, 1.0 - eta, 1.0 + eta);
                let shape = [left * down, right * down, right * up, left * up].map(|n| 0.25 * n);
                let along_xi = [-down, down, up, -up].map(|n| 0.25 * n);
                let along_eta = [-left, -right, right, left].map(|n| 0.25 * n);
                visit(&shape, cross(combine(corners, &along_xi), combine(corners, &along_eta)));
            }
        }
    }
}

/// Current positions of the nodes of a facet; `node_of` turns the facet's node numbers into those of the mesh.
pub(crate) fn corners(
    facets: &Facets,
    facet: usize,
    dimension: usize,
    node_of: impl Fn(usize) -> usize,
    coordinate: impl Fn(usize) -> f64,
) -> ([[f64; 3]; 4], usize) {
    let mut corners = [[0.0; 3]; 4];
    let nodes = facets.facet(facet);
    for (corner, &node) in corners.iter_mut().zip(nodes) {
        for axis in 0..dimension {
            corner[axis] = coordinate(node_of(node) * dimension + axis);
        }
    }
    (corners, nodes.len())
}

fn minus(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

fn combine(corners: &[[f64; 3]], weights: &[f64; 4]) -> [f64; 3] {
    std::array::from_fn(|i| corners.iter().zip(weights).map(|(corner, weight)| corner[i] * weight).sum())
}

/// a x b.
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
