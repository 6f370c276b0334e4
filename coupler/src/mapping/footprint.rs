//! How wide a piece of the structure's surface belongs to each of the fluid's points: the load of one spreads over it, and its
//! motion is the mean of it. Points on facets that are wider know no more than their foot.

use protocol::interface::Points;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Width of each point's footprint, `[n]` m: of its area, or, without one, the distance to the nearest point without one.
pub(super) fn widths(points: &Points) -> Vec<f64> {
    let dimension = points.dimension;
    let place = |point: usize| -> [f64; 3] {
        let x = &points.reference_position[point * dimension..][..dimension];
        std::array::from_fn(|axis| x.get(axis).copied().unwrap_or_default())
    };
    let bare = (0..points.len()).filter(|&point| points.area[point] == 0.0);
    let tree = RTree::bulk_load(bare.map(|point| GeomWithData::new(place(point), point)).collect());
    let pitch = |point: usize| {
        let mut others = tree.nearest_neighbor_iter_with_distance_2(place(point));
        // The nearest one is the point itself.
        others.nth(1).map_or(0.0, |(_, square): (_, f64)| square.sqrt())
    };
    let width = |point: usize| match points.area[point] {
        0.0 => pitch(point),
        area if dimension == 2 => area,
        area => area.sqrt(),
    };
    (0..points.len()).map(width).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_with_an_area_is_as_wide_as_that_and_others_as_far_apart_as_they_are() {
        let reference_position = vec![0.0, 0.0, 0.0, 0.3, 0.4, 0.3, 0.5, 0.5];
        let points = Points { dimension: 2, reference_position, area: vec![0.0, 0.0, 0.0, 0.25] };
        assert_eq!(widths(&points), [0.3, 0.3, 0.4, 0.25]);
    }
}
