//! From tractions at the markers to nodal forces.

use super::Facets;

/// Nodal forces `[n, D]` N of tractions `[m, D]` Pa at the markers, integrated over the facets in their current place
/// with the facets' own linear or bilinear shape functions. Added to `force`.
///
/// `corner_markers` are those of [`Facets::corner_markers`]. Exact for tractions linear on segments and triangles; 2 x 2 Gauss
/// points on quadrilaterals. In 2-D per metre of depth.
pub fn add_traction_forces(
    facets: &Facets,
    corner_markers: &[usize],
    position: &[f64],
    traction: &[f64],
    force: &mut [f64],
) {
    let add = match facets.nodes_per_facet {
        2 => add_facets::<2, 2>,
        3 => add_facets::<3, 3>,
        _ => add_facets::<3, 4>,
    };
    add(&facets.nodes, corner_markers, position, traction, force);
}

/// Facets of `N` nodes in `D` dimensions.
fn add_facets<const D: usize, const N: usize>(
    nodes: &[usize],
    corner_markers: &[usize],
    position: &[f64],
    traction: &[f64],
    force: &mut [f64],
) {
    for (nodes, markers) in nodes.chunks_exact(N).zip(corner_markers.chunks_exact(N)) {
        let points: [[f64; 3]; N] = std::array::from_fn(|corner| padded::<D>(position, nodes[corner]));
        let stress: [[f64; 3]; N] = std::array::from_fn(|corner| padded::<D>(traction, markers[corner]));
        let nodal = facet_forces(&points, &stress);
        for (&node, nodal) in nodes.iter().zip(&nodal) {
            (0..D).for_each(|axis| force[node * D + axis] += nodal[axis]);
        }
    }
}

/// Vector number `index` of an array of `D` components each, with zeros behind.
fn padded<const D: usize>(values: &[f64], index: usize) -> [f64; 3] {
    let vector = &values[index * D..(index + 1) * D];
    std::array::from_fn(|axis| if axis < D { vector[axis] } else { 0.0 })
}

fn facet_forces<const N: usize>(points: &[[f64; 3]; N], stress: &[[f64; 3]; N]) -> [[f64; 3]; N] {
    let mut nodal = [[0.0; 3]; N];
    if N == 4 {
        let lines = [-1.0 / 3f64.sqrt(), 1.0 / 3f64.sqrt()];
        let along_first = lines.map(|eta| tangent(points, eta, true));
        let along_second = lines.map(|xi| tangent(points, xi, false));
        for (xi, second) in lines.iter().zip(&along_second) {
            for (eta, first) in lines.iter().zip(&along_first) {
                let shape = bilinear(*xi, *eta);
                let weight = norm(cross(*first, *second));
                let at_point: [f64; 3] = std::array::from_fn(|axis| {
                    weight * (0..N).map(|b| shape[b] * stress[b][axis]).sum::<f64>()
                });
                for (nodal, &na) in nodal.iter_mut().zip(&shape) {
                    (0..3).for_each(|axis| nodal[axis] += na * at_point[axis]);
                }
            }
        }
        return nodal;
    }
    // Mass matrix of linear shape functions: size / (n (n + 1)) (1 + delta_ab), n nodes.
    let edge = sub(points[1], points[0]);
    let size = if N == 2 { norm(edge) } else { 0.5 * norm(cross(edge, sub(points[2], points[0]))) };
    let unit = size / (N * (N + 1)) as f64;
    for a in 0..N {
        for b in 0..N {
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
        add_traction_forces(&quad, &quad.corner_markers(), &position, &traction, &mut force);
        assert!(force.chunks(3).all(|f| (f[2] - 7.5).abs() < 1e-12), "{force:?}");
        // Linear traction t = x on a segment from 0 to 2: nodal forces 2/3 and 4/3.
        let segment = Facets { nodes_per_facet: 2, nodes: vec![0, 1], face: vec![0] };
        let mut force = vec![0.0; 4];
        add_traction_forces(
            &segment,
            &segment.corner_markers(),
            &[0.0, 0.0, 2.0, 0.0],
            &[0.0, 0.0, 0.0, 2.0],
            &mut force,
        );
        assert!((force[1] - 2.0 / 3.0).abs() < 1e-15 && (force[3] - 4.0 / 3.0).abs() < 1e-15);
    }
}
