//! What a mapping must keep, on surfaces that match and surfaces that do not.

use coupler::case::MappingKind;
use coupler::dummy_mesh::DummyMesh;
use coupler::ledger::{moment, sum};
use coupler::mapping::Mapping;
use proptest::prelude::*;
use protocol::case::{BoxFace, BoxRegion, SolidOutline};
use protocol::interface::Surface;

fn outline(dimension: usize) -> SolidOutline {
    let (min, max) = ([0.292, 0.0, 0.0], [0.304, 0.08, 0.292]);
    SolidOutline {
        model: "fem".to_owned(),
        region: BoxRegion { min: min[..dimension].to_vec(), max: max[..dimension].to_vec() },
        elements: vec![1; dimension],
        wet: vec![BoxFace::Left, BoxFace::Right, BoxFace::Top],
        clamped: vec![BoxFace::Bottom],
        density: Some(2500.0),
        prescribed: false,
    }
}

/// A solid's surface with these many elements along each axis, one across the wall.
fn surface(dimension: usize, elements: &[usize]) -> Surface {
    let mesh = DummyMesh::span(&outline(dimension), elements);
    Surface {
        dimension,
        reference_position: mesh.reference_position().to_vec(),
        facets: mesh.facets().clone(),
        areal_mass: vec![15.0; mesh.node_count()],
    }
}

fn sides(dimension: usize, fluid: &[usize], solid: &[usize]) -> (DummyMesh, Surface, Mapping) {
    let dummy = DummyMesh::span(&outline(dimension), fluid);
    let surface = surface(dimension, solid);
    let mapping = Mapping::new(MappingKind::Projection, &dummy, &surface).expect("a box has facets");
    (dummy, surface, mapping)
}

/// A repeatable sequence of numbers in [-1, 1).
fn noise(count: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    (0..count).map(|_| next()).collect()
}

proptest! {
    #[test]
    fn force_moment_and_work_are_kept(
        dimension in 2usize..=3,
        fluid in prop::array::uniform3(1usize..7),
        solid in prop::array::uniform3(1usize..7),
        seed in any::<u64>(),
    ) {
        let (dummy, surface, mapping) = sides(dimension, &fluid, &solid);
        let load = noise(dummy.node_count() * dimension, seed);
        let motion = noise(surface.node_count() * dimension, seed ^ 7);
        let mut carried = vec![0.0; load.len()];
        let mut given = vec![0.0; motion.len()];
        mapping.spread_motion(&motion, &mut carried);
        mapping.gather_load(&load, &mut given);
        let scale: f64 = load.iter().map(|f| f.abs()).sum();
        for axis in 0..3 {
            prop_assert!((sum(&load, dimension)[axis] - sum(&given, dimension)[axis]).abs() < 1e-13 * scale);
            // The faces are flat, so the moment is kept as well.
            let there = moment(dummy.reference_position(), &load, dimension)[axis];
            let here = moment(&surface.reference_position, &given, dimension)[axis];
            prop_assert!((there - here).abs() < 1e-13 * scale, "{there} {here}");
        }
        let work = |f: &[f64], u: &[f64]| f.iter().zip(u).map(|(f, u)| f * u).sum::<f64>();
        prop_assert!((work(&load, &carried) - work(&given, &motion)).abs() < 1e-13 * scale);
    }

    #[test]
    fn a_linear_motion_is_carried_exactly(
        dimension in 2usize..=3,
        fluid in prop::array::uniform3(1usize..7),
        solid in prop::array::uniform3(1usize..7),
        gradient in prop::array::uniform9(-1.0..1.0),
    ) {
        let (dummy, surface, mapping) = sides(dimension, &fluid, &solid);
        let field = |points: &[f64]| -> Vec<f64> {
            let value = |x: &[f64]| (0..dimension).map(|i| (0..dimension).map(|j| gradient[3 * i + j] * x[j]).sum()).collect::<Vec<f64>>();
            points.chunks(dimension).flat_map(value).collect()
        };
        let mut carried = vec![0.0; dummy.reference_position().len()];
        mapping.spread_motion(&field(&surface.reference_position), &mut carried);
        for (carried, expected) in carried.iter().zip(field(dummy.reference_position())) {
            prop_assert!((carried - expected).abs() < 1e-13);
        }
    }
}

#[test]
fn identity_takes_equal_meshes_and_refuses_others() {
    let dummy = DummyMesh::span(&outline(2), &[1, 5]);
    assert!(Mapping::new(MappingKind::Identity, &dummy, &surface(2, &[1, 5])).is_ok());
    let refused = Mapping::new(MappingKind::Identity, &dummy, &surface(2, &[1, 4])).unwrap_err();
    assert!(refused.to_string().contains("identity mapping: node"), "{refused}");
}
