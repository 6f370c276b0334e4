//! Node for node: the paper's choice, the markers sit at the solid's surface nodes.

use protocol::interface::Surface;

use super::MappingError;
use crate::dummy_mesh::DummyMesh;

/// Largest distance of two nodes taken for one, relative to the size of the body.
const SAME_NODE: f64 = 1e-9;

pub(super) fn rows(dummy: &DummyMesh, surface: &Surface) -> Result<Vec<Vec<(usize, f64)>>, MappingError> {
    let dimension = surface.dimension;
    let size = surface.reference_position.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    let row = |(node, point): (usize, &[f64])| {
        let (distance, nearest) = nearest_node(point, surface);
        if distance <= SAME_NODE * size {
            Ok(vec![(nearest, 1.0)])
        } else {
            Err(MappingError::NotIdentical { node, distance })
        }
    };
    dummy.reference_position().chunks_exact(dimension).enumerate().map(row).collect()
}

/// Distance (m) and number of the surface node nearest to a point.
pub(super) fn nearest_node(point: &[f64], surface: &Surface) -> (f64, usize) {
    let square = |node: &[f64]| node.iter().zip(point).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
    let nodes = surface.reference_position.chunks_exact(surface.dimension).map(square).enumerate();
    let nearest = nodes.min_by(|a, b| a.1.total_cmp(&b.1));
    nearest.map_or((f64::INFINITY, 0), |(node, square)| (square.sqrt(), node))
}
