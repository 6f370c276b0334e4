//! Normals of the interface markers of a dummy mesh: the mean over the facets of their face around each.

use protocol::interface::{Facets, InterfaceMarker};

use crate::vector::{Vector, add_scaled, normalised, sub};

/// Which facets count for which marker.
#[derive(Debug)]
pub struct FacetNormals {
    facets: Facets,
    /// Marker of each corner of each facet.
    marker_of: Vec<usize>,
}

impl FacetNormals {
    /// Of `markers`, which are those of the facets.
    pub fn new(facets: &Facets, markers: &[InterfaceMarker]) -> Self {
        let corner = |facet: usize| {
            let face = facets.face[facet];
            facets.facet(facet).iter().map(move |&node| {
                let wanted = InterfaceMarker { face, node };
                markers.binary_search(&wanted).expect("every corner of a facet has a marker")
            })
        };
        Self { marker_of: (0..facets.len()).flat_map(corner).collect(), facets: facets.clone() }
    }

    /// Unit normals at the current node positions, `[m, D]`.
    pub fn evaluate<const D: usize>(&self, position: &[Vector<D>], normals: &mut [Vector<D>]) {
        normals.fill([0.0; D]);
        let per_facet = self.facets.nodes_per_facet;
        for facet in 0..self.facets.len() {
            let area: Vector<D> = facet_area(self.facets.facet(facet), position);
            for corner in 0..per_facet {
                add_scaled(&mut normals[self.marker_of[facet * per_facet + corner]], 1.0, &area);
            }
        }
        for normal in normals {
            *normal = normalised(normal);
        }
    }
}

/// Outward area vector of a facet: m in 2-D, m2 in 3-D.
fn facet_area<const D: usize>(nodes: &[usize], position: &[Vector<D>]) -> Vector<D> {
    let x = |k: usize| &position[nodes[k]];
    let mut area = [0.0; D];
    if D == 2 {
        let along = sub(x(1), x(0));
        (area[0], area[1]) = (along[1], -along[0]);
    } else {
        let last = nodes.len() - 1;
        let (a, b) = if last == 2 {
            (sub(x(1), x(0)), sub(x(2), x(0)))
        } else {
            (sub(x(2), x(0)), sub(x(last), x(1)))
        };
        for k in 0..D {
            let (p, q) = ((k + 1) % D, (k + 2) % D);
            area[k] = 0.5 * (a[p] * b[q] - a[q] * b[p]);
        }
    }
    area
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_point_out_of_the_body() {
        // Lower edge of a body above it: the segment runs with the body on its left.
        let area: Vector<2> = facet_area(&[0, 1], &[[0.0, 0.0], [2.0, 0.0]]);
        assert_eq!(area, [0.0, -2.0]);
        let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(facet_area::<3>(&[0, 1, 2, 3], &square), [0.0, 0.0, 1.0]);
        assert_eq!(facet_area::<3>(&[0, 1, 2], &square), [0.0, 0.0, 0.5]);
    }
}
