//! Node for node: the paper's choice, the markers sit at the solid's surface nodes.

use protocol::interface::Surface;

use super::nearest::Nodes;
use super::{MappingError, Rows};

/// Largest distance of two nodes taken for one, relative to the size of the body.
const SAME_NODE: f64 = 1e-9;

pub(super) fn rows(points: &[f64], surface: &Surface) -> Result<Rows, MappingError> {
    let size = surface.reference_position.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    let nodes = Nodes::new(surface);
    let row = |(node, point): (usize, &[f64])| {
        let (distance, nearest) = nodes.nearest(point);
        if distance <= SAME_NODE * size {
            Ok(vec![(nearest, 1.0)])
        } else {
            Err(MappingError::NotIdentical { node, distance })
        }
    };
    points.chunks_exact(surface.dimension).enumerate().map(row).collect()
}
