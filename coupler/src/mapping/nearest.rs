//! Nearest neighbour: every point follows the node of the solid nearest to it. Keeps force and work, not the moment;
//! first order in the node distance.

use protocol::interface::Surface;

use super::Rows;

pub(super) fn rows(points: &[f64], surface: &Surface) -> Rows {
    points.chunks_exact(surface.dimension).map(|point| vec![(nearest_node(point, surface).1, 1.0)]).collect()
}

/// Distance (m) and number of the surface node nearest to a point.
pub(super) fn nearest_node(point: &[f64], surface: &Surface) -> (f64, usize) {
    let square = |node: &[f64]| node.iter().zip(point).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
    let nodes = surface.reference_position.chunks_exact(surface.dimension).map(square).enumerate();
    let nearest = nodes.min_by(|a, b| a.1.total_cmp(&b.1));
    nearest.map_or((f64::INFINITY, 0), |(node, square)| (square.sqrt(), node))
}
