//! A wall, its surface, and numbers to try mappings with.

use coupler::dummy_mesh::DummyMesh;
use coupler::resultant::Resultant;
use protocol::case::{BoxFace, BoxRegion, SolidOutline};
use protocol::interface::Surface;

/// A wall of 12 mm and 8 cm (in space 29.2 cm deep), held at its foot.
pub(crate) fn outline(dimension: usize) -> SolidOutline {
    let (min, max) = ([0.292, 0.0, 0.0], [0.304, 0.08, 0.292]);
    SolidOutline {
        model: "fem".to_owned(),
        mesh: None,
        region: BoxRegion { min: min[..dimension].to_vec(), max: max[..dimension].to_vec() },
        elements: vec![1; dimension],
        has_middle_nodes: false,
        wet: vec![BoxFace::Left, BoxFace::Right, BoxFace::Top],
        clamped: vec![BoxFace::Bottom],
        density: Some(2500.0),
        young_modulus: Some(1e6),
        prescribed: false,
    }
}

/// A solid's surface with these many elements along each axis, one across the wall.
pub(crate) fn surface(dimension: usize, elements: &[usize]) -> Surface {
    let mesh = DummyMesh::span(&outline(dimension), elements);
    Surface {
        dimension,
        reference_position: mesh.reference_position().to_vec(),
        facets: mesh.facets().clone(),
        areal_mass: vec![15.0; mesh.node_count()],
    }
}

/// Force and moment of nodal forces, `[n, D]` N, at these places, `[n, D]` m.
pub(crate) fn resultant(dimension: usize, force: &[f64], position: &[f64]) -> Resultant {
    Resultant::new(dimension, force, |i| position[i], |i| position[i])
}

/// A repeatable sequence of numbers in [-1, 1).
pub(crate) fn noise(count: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    (0..count).map(|_| next()).collect()
}

/// A quarter of a tube of radius 1 m and length 1 m, with this many quadrilaterals around and along.
pub(crate) fn tube(around: usize, along: usize) -> Surface {
    let mut surface = Surface { dimension: 3, ..Surface::default() };
    for row in 0..=along {
        for column in 0..=around {
            let angle = std::f64::consts::FRAC_PI_2 * column as f64 / around as f64;
            surface.reference_position.extend([angle.cos(), angle.sin(), row as f64 / along as f64]);
        }
    }
    surface.facets.nodes_per_facet = 4;
    for row in 0..along {
        for column in 0..around {
            let corner = row * (around + 1) + column;
            surface.facets.nodes.extend([corner, corner + 1, corner + around + 2, corner + around + 1]);
            surface.facets.face.push(0);
        }
    }
    surface.areal_mass = vec![1.0; surface.node_count()];
    surface
}

/// Points on the true tube of this radius: off the quadrilaterals by the sagitta and more.
pub(crate) fn tube_points(count: usize, radius: f64, seed: u64) -> Vec<f64> {
    let numbers = noise(2 * count, seed);
    let point = |pair: &[f64]| {
        let angle = std::f64::consts::FRAC_PI_4 * (1.0 + pair[0]);
        [radius * angle.cos(), radius * angle.sin(), 0.5 * (1.0 + pair[1])]
    };
    numbers.chunks(2).flat_map(point).collect()
}
