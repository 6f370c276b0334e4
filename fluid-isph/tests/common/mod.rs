//! Bodies and solids made by hand for the tests.

#![allow(dead_code, reason = "each test program uses its own part")]

use fluid_isph::Motion;
use protocol::case::{BoxFace, BoxRegion, SolidOutline};
use protocol::interface::{BodyMesh, Facets, Response};

/// A mesh whose nodes stay where they are.
pub(crate) fn at_rest<'a>(position: &'a [f64], still: &'a [f64]) -> Motion<'a> {
    Motion { position, velocity: still, acceleration: None, normal: None }
}

/// The rigid body a mesh fills, as a case describes it.
pub(crate) fn outline(mesh: &BodyMesh, wet: &[BoxFace]) -> SolidOutline {
    let along = |k: usize| mesh.reference_position.iter().skip(k).step_by(mesh.dimension).copied();
    let axes = 0..mesh.dimension;
    SolidOutline {
        model: "rigid".to_owned(),
        region: BoxRegion {
            min: axes.clone().map(|k| along(k).fold(f64::INFINITY, f64::min)).collect(),
            max: axes.map(|k| along(k).fold(f64::NEG_INFINITY, f64::max)).collect(),
        },
        mesh: None,
        elements: vec![1; mesh.dimension],
        has_middle_nodes: false,
        wet: wet.to_vec(),
        clamped: Vec::new(),
        density: None,
        young_modulus: None,
        prescribed: false,
    }
}

/// A horizontal plate from x = 0 to `length` m, its upper face at y = 0, `thickness` m thick, wet above only; in 3-D
/// `depth` m deep. First local axis up, across the plate.
pub(crate) fn floor_plate(
    (length, thickness, depth): (f64, f64, Option<f64>),
    cells: usize,
    (response, response_mass): (Response, f64),
) -> BodyMesh {
    let (dimension, layers) = if depth.is_some() { (3, 2) } else { (2, 1) };
    let mut reference_position = Vec::new();
    for z in 0..layers {
        for k in 0..=cells {
            for y in [-thickness, 0.0] {
                reference_position.extend([length * k as f64 / cells as f64, y]);
                reference_position.extend(depth.map(|depth| depth * z as f64));
            }
        }
    }
    let column = |z: usize, k: usize| 2 * (z * (cells + 1) + k);
    let (mut mesh_cells, mut nodes) = (Vec::new(), Vec::new());
    for k in 0..cells {
        for z in 0..layers {
            for along in [k, k + 1] {
                mesh_cells.extend([column(z, along), column(z, along) + 1]);
            }
        }
        // Upper face; in 2-D outward is on the right of a -> b, in 3-D counter-clockwise seen from above.
        let top = |z: usize, along: usize| column(z, along) + 1;
        if depth.is_some() {
            nodes.extend([top(0, k), top(1, k), top(1, k + 1), top(0, k + 1)]);
        } else {
            nodes.extend([top(0, k + 1), top(0, k)]);
        }
    }
    let nodes_per_facet = if depth.is_some() { 4 } else { 2 };
    let node_count = reference_position.len() / dimension;
    BodyMesh {
        dimension,
        reference_position,
        cells: mesh_cells,
        facets: Facets { nodes_per_facet, nodes, face: vec![0; cells] },
        response_mass: vec![response_mass; node_count],
        response,
    }
}

/// An upright plate on the floor, `thickness` x `height` m with its left face at x, wet on both faces and the top.
pub(crate) fn upright_plate(
    (x, thickness, height): (f64, f64, f64),
    cells: usize,
    response: Response,
) -> BodyMesh {
    let mut reference_position = Vec::new();
    for k in 0..=cells {
        for side in [x, x + thickness] {
            reference_position.extend([side, height * k as f64 / cells as f64]);
        }
    }
    let mesh_cells = (0..cells).flat_map(|k| (2 * k)..(2 * k + 4)).collect();
    let (mut nodes, mut face) = (Vec::new(), Vec::new());
    for k in 0..cells {
        // Outward is on the right of a -> b, (dy, -dx): the left face runs down, the right one up.
        nodes.extend([2 * k + 2, 2 * k]);
        face.push(0);
        nodes.extend([2 * k + 1, 2 * k + 3]);
        face.push(1);
    }
    nodes.extend([2 * cells + 1, 2 * cells]);
    face.push(2);
    BodyMesh {
        dimension: 2,
        response_mass: vec![1.0; reference_position.len() / 2],
        reference_position,
        cells: mesh_cells,
        facets: Facets { nodes_per_facet: 2, nodes, face },
        response,
    }
}
