//! From tractions at the markers to nodal forces.

use super::{Facets, InterfaceMarker};

/// Nodal forces `[n, D]` N of tractions `[m, D]` Pa at the markers, integrated over the facets in their current place
/// with the facets' own linear or bilinear shape functions. Added to `force`.
///
/// Exact for tractions linear on segments and triangles; 2 x 2 Gauss points on quadrilaterals. In 2-D per metre of depth.
pub fn add_traction_forces(
    facets: &Facets,
    markers: &[InterfaceMarker],
    position: &[f64],
    traction: &[f64],
    force: &mut [f64],
) {
    let dimension = if facets.nodes_per_facet == 2 { 2 } else { 3 };
    let marker_of = |face: usize, node: usize| {
        markers
            .binary_search(&InterfaceMarker { face, node })
            .expect("every facet node has a marker of its face")
    };
    for facet in 0..facets.len() {
        let nodes = facets.facet(facet);
        let mut points = [[0.0; 3]; 4];
        let mut stress = [[0.0; 3]; 4];
        for (corner, &node) in nodes.iter().enumerate() {
            let marker = marker_of(facets.face[facet], node);
            points[corner][..dimension].copy_from_slice(&position[node * dimension..][..dimension]);
            stress[corner][..dimension].copy_from_slice(&traction[marker * dimension..][..dimension]);
        }
        let nodal = facet_forces(&points[..nodes.len()], &stress[..nodes.len()]);
        for (corner, &node) in nodes.iter().enumerate() {
            for axis in 0..dimension {
                force[node * dimension + axis] += nodal[corner][axis];
            }
        }
    }
}

fn facet_forces(points: &[[f64; 3]], stress: &[[f64; 3]]) -> [[f64; 3]; 4] {
    let mut nodal = [[0.0; 3]; 4];
    let corners = points.len();
    if corners == 4 {
        let g = 1.0 / 3f64.sqrt();
        for (xi, eta) in [(-g, -g), (g, -g), (g, g), (-g, g)] {
            let shape = bilinear(xi, eta);
            let weight = norm(cross(tangent(points, eta, true), tangent(points, xi, false)));
            for (a, &na) in shape.iter().enumerate() {
                for (b, &nb) in shape.iter().enumerate() {
                    (0..3).for_each(|axis| nodal[a][axis] += weight * na * nb * stress[b][axis]);
                }
            }
        }
        return nodal;
    }
    // Mass matrix of linear shape functions: size / (n (n + 1)) (1 + delta_ab), n nodes.
    let edge = sub(points[1], points[0]);
    let size = if corners == 2 { norm(edge) } else { 0.5 * norm(cross(edge, sub(points[2], points[0]))) };
    let unit = size / (corners * (corners + 1)) as f64;
    for a in 0..corners {
        for b in 0..corners {
            let weight = if a == b { 2.0 * unit } else { unit };
            (0..3).for_each(|axis| nodal[a][axis] += weight * stress[b][axis]);
        }
    }
    nodal
}

/// Bilinear shape functions of a quadrilateral, counter-clockwise from (-1, -1).
fn bilinear(xi: f64, eta: f64) -> [f64; 4] {
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(a, b)| 0.25 * (1.0 + a * xi) * (1.0 + b * eta))
}

/// Derivative of a quadrilateral's position along its first (at fixed `other` = eta) or second local axis.
fn tangent(points: &[[f64; 3]], other: f64, first: bool) -> [f64; 3] {
    let (low, high) = if first {
        (sub(points[1], points[0]), sub(points[2], points[3]))
    } else {
        (sub(points[3], points[0]), sub(points[2], points[1]))
    };
    std::array::from_fn(|axis| 0.25 * ((1.0 - other) * low[axis] + (1.0 + other) * high[axis]))
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn norm(a: [f64; 3]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uniform_traction_gives_the_area_times_it_shared_by_the_corners() {
        let quad = Facets { nodes_per_facet: 4, nodes: vec![0, 1, 2, 3], face: vec![0] };
        let position = [0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 3.0, 0.0, 0.0, 3.0, 0.0];
        let traction = [0.0, 0.0, 5.0].repeat(4);
        let mut force = vec![0.0; 12];
        add_traction_forces(&quad, &quad.markers(), &position, &traction, &mut force);
        assert!(force.chunks(3).all(|f| (f[2] - 7.5).abs() < 1e-12), "{force:?}");
        // Linear traction t = x on a segment from 0 to 2: nodal forces 2/3 and 4/3.
        let segment = Facets { nodes_per_facet: 2, nodes: vec![0, 1], face: vec![0] };
        let mut force = vec![0.0; 4];
        add_traction_forces(
            &segment,
            &segment.markers(),
            &[0.0, 0.0, 2.0, 0.0],
            &[0.0, 0.0, 0.0, 2.0],
            &mut force,
        );
        assert!((force[1] - 2.0 / 3.0).abs() < 1e-15 && (force[3] - 4.0 / 3.0).abs() < 1e-15);
    }
}
