//! The fluid's points in the place the wall has: the structure's normal at each, and the area each stands for.
//!
//! Both are those of the structure's own surface at the point's foot, between its markers by the facet's shape functions.

use protocol::interface::{InterfaceMarker, Points, Surface};
use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::mapping::{Sparse, feet};
use crate::marker_place::MarkerPlace;

/// Normals and areas at the fluid's points.
pub struct PointPlace {
    dimension: usize,
    /// The structure's markers.
    solid: MarkerPlace,
    /// From these to the points.
    feet: Sparse,
    /// Normal and marker area of the structure at the foot of each point, `[n, 4]`.
    at_feet: Vec<f64>,
    /// The points that have an area.
    with_area: Vec<usize>,
    /// Area of each of these over the marker area at its foot, of the unloaded body, `[m]`.
    share: Vec<f64>,
    /// Outward unit normals of all points, `[n, D]`.
    normal: Vec<f64>,
    /// See [`PointPlace::markers`].
    markers: Vec<f64>,
}

impl PointPlace {
    /// The points at the unloaded body.
    pub fn new(points: &Points, surface: &Surface) -> Self {
        let feet = Sparse::pack(feet(&points.reference_position, surface));
        let with_area = points.markers();
        let mut place = Self {
            dimension: points.dimension,
            solid: MarkerPlace::new(&surface.facets, &surface.reference_position),
            at_feet: vec![0.0; 4 * points.len()],
            share: vec![1.0; with_area.len()],
            normal: vec![0.0; points.reference_position.len()],
            markers: vec![0.0; 4 * with_area.len()],
            with_area,
            feet,
        };
        place.follow(&surface.reference_position);
        let unloaded = place.markers.as_chunks::<4>().0;
        place.share =
            place.with_area.iter().zip(unloaded).map(|(&i, there)| points.area[i] / there[3]).collect();
        place.follow(&surface.reference_position);
        place
    }

    /// Of each point that has an area the outward unit normal and the area in the present place, m2.
    pub fn markers(&self) -> &[[f64; 4]] {
        self.markers.as_chunks().0
    }

    /// Outward unit normals of all points, `[n, D]`.
    pub fn normals(&self) -> &[f64] {
        &self.normal
    }

    /// The points that have an area, `[m]`.
    pub fn with_area(&self) -> &[usize] {
        &self.with_area
    }

    /// Goes where the solid's nodes are now, `[N, D]` m.
    pub fn follow(&mut self, solid_position: &[f64]) {
        let Self { dimension, solid, feet, at_feet, with_area, share, normal, markers } = self;
        solid.follow(solid_position);
        let there = solid.markers().as_flattened();
        feet.spread_rows::<4>(|_| 0.0, |component| there[component], at_feet);
        let at_feet = at_feet.as_chunks::<4>().0;
        for (normal, [x, y, z, _]) in normal.chunks_exact_mut(*dimension).zip(at_feet) {
            let length = (x * x + y * y + z * z).sqrt();
            normal.copy_from_slice(&[x / length, y / length, z / length][..*dimension]);
        }
        let places = markers.as_chunks_mut::<4>().0.iter_mut().zip(with_area.iter().zip(share.iter()));
        for (marker, (&point, share)) in places {
            marker[..*dimension].copy_from_slice(&normal[point * *dimension..][..*dimension]);
            marker[3] = share * at_feet[point][3];
        }
    }

    /// For every marker of the structure the points, of those that have an area, whose tractions give its own, with weights:
    /// the mean over the areas it shares in; where it shares in none, the nearest point.
    pub fn traction_rows(&self, points: &Points, surface: &Surface) -> Sparse {
        let dimension = surface.dimension;
        let markers = surface.facets.markers();
        let mut rows = vec![Vec::new(); markers.len()];
        for (number, &point) in self.with_area.iter().enumerate() {
            for (marker, weight) in self.feet.row(point) {
                rows[marker].push((number, weight * points.area[point]));
            }
        }
        let place = |values: &[f64], item: usize| -> [f64; 3] {
            std::array::from_fn(|axis| if axis < dimension { values[item * dimension + axis] } else { 0.0 })
        };
        let named = self.with_area.iter().enumerate();
        let tree = RTree::bulk_load(
            named.map(|(i, &point)| GeomWithData::new(place(&points.reference_position, point), i)).collect(),
        );
        for (row, InterfaceMarker { node, .. }) in rows.iter_mut().zip(&markers) {
            let total: f64 = row.iter().map(|entry| entry.1).sum();
            if total > 0.0 {
                row.iter_mut().for_each(|entry| entry.1 /= total);
            } else {
                let nearest = tree.nearest_neighbor(place(&surface.reference_position, *node));
                *row = nearest.map(|found| (found.data, 1.0)).into_iter().collect();
            }
        }
        Sparse::pack(rows)
    }
}

#[cfg(test)]
mod tests {
    use protocol::interface::Facets;

    use super::*;

    /// The left and the upper face of a unit square, two segments each; normals to the left and up.
    fn corner() -> Surface {
        Surface {
            dimension: 2,
            reference_position: vec![0.0, 0.0, 0.0, 0.5, 0.0, 1.0, 0.5, 1.0, 1.0, 1.0],
            facets: Facets {
                nodes_per_facet: 2,
                nodes: vec![1, 0, 2, 1, 3, 2, 4, 3],
                face: vec![0, 0, 3, 3],
            },
            areal_mass: vec![1.0; 5],
        }
    }

    /// Two points on the left face, one inside beside the upper one, without an area, and two on top.
    fn points() -> Points {
        Points {
            dimension: 2,
            reference_position: vec![0.0, 0.25, 0.0, 0.75, 0.6, 0.9, 0.25, 1.0, 0.75, 1.0],
            area: vec![0.5, 0.5, 0.0, 0.5, 0.5],
        }
    }

    #[test]
    fn normals_and_areas_are_those_of_the_surface_under_each_point() {
        let mut place = PointPlace::new(&points(), &corner());
        assert_eq!(place.normals(), [-1.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0]);
        assert_eq!(place.markers()[2], [0.0, 1.0, 0.0, 0.5]);
        // Turned by a quarter, to the left, and stretched twice along what is now the upper face.
        let turned: Vec<f64> =
            corner().reference_position.chunks(2).flat_map(|x| [-2.0 * x[1], x[0]]).collect();
        place.follow(&turned);
        let rounded: Vec<f64> = place.normals().iter().map(|n| (n * 1e12).round() / 1e12 + 0.0).collect();
        assert_eq!(rounded, [0.0, -1.0, 0.0, -1.0, -1.0, 0.0, -1.0, 0.0, -1.0, 0.0]);
        let areas: Vec<f64> = place.markers().iter().map(|marker| marker[3]).collect();
        assert_eq!(areas, [1.0, 1.0, 0.5, 0.5]);
    }

    #[test]
    fn tractions_of_the_structures_markers_are_means_of_the_points_beside_them() {
        let (points, surface) = (points(), corner());
        let rows = PointPlace::new(&points, &surface).traction_rows(&points, &surface);
        // Markers by face, then node: left 0, 1, 2, top 2, 3, 4. Both left points are half-way between two of these.
        let expected = [vec![(0, 1.0)], vec![(0, 0.5), (1, 0.5)], vec![(1, 1.0)], vec![(2, 1.0)]];
        for (marker, expected) in expected.iter().enumerate() {
            assert_eq!(&rows.row(marker), expected, "marker {marker}");
        }
        // Without a point on top its markers take the nearest one.
        let few = Points { area: vec![0.5, 0.5, 0.0, 0.0, 0.0], ..points };
        let rows = PointPlace::new(&few, &surface).traction_rows(&few, &surface);
        assert_eq!(rows.row(5), [(1, 1.0)]);
    }
}
