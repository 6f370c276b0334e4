//! Nearest neighbour: every point follows the node of the solid nearest to it. Keeps force and work, not the moment;
//! first order in the node distance.

use protocol::interface::Surface;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::Rows;

pub(super) fn rows(points: &[f64], surface: &Surface) -> Rows {
    let nodes = Nodes::new(surface);
    points.chunks_exact(surface.dimension).map(|point| vec![(nodes.nearest(point).1, 1.0)]).collect()
}

/// The nodes of a surface, to be searched.
pub(super) struct Nodes(RTree<GeomWithData<[f64; 3], usize>>);

impl Nodes {
    pub(super) fn new(surface: &Surface) -> Self {
        let nodes = surface.reference_position.chunks_exact(surface.dimension).enumerate();
        Self(RTree::bulk_load(nodes.map(|(node, x)| GeomWithData::new(padded(x), node)).collect()))
    }

    /// Distance (m) and number of the node nearest to a point.
    pub(super) fn nearest(&self, point: &[f64]) -> (f64, usize) {
        let point = padded(point);
        let nearest = self.0.nearest_neighbor(point);
        nearest.map_or((f64::INFINITY, 0), |node| {
            let square: f64 = node.geom().iter().zip(point).map(|(a, b)| (a - b) * (a - b)).sum();
            (square.sqrt(), node.data)
        })
    }
}

fn padded(point: &[f64]) -> [f64; 3] {
    std::array::from_fn(|axis| point.get(axis).copied().unwrap_or_default())
}
