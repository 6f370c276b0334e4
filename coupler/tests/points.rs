//! What a mapping must keep of points without a mesh: on the wall, inside it and outside of it, however far it has turned.

mod common;

use common::{noise, outline, resultant, surface, tube, tube_points};
use coupler::case::MappingKind;
use coupler::mapping::Mapping;
use proptest::prelude::*;
use protocol::interface::Points;

/// Places inside the wall of the outline, and outside of it by as much.
fn wall_points(dimension: usize, count: usize, seed: u64) -> Vec<f64> {
    let region = outline(dimension).region;
    let place = |(i, x): (usize, f64)| {
        let axis = i % dimension;
        region.min[axis] + region.length(axis) * (0.5 + 0.75 * x)
    };
    noise(count * dimension, seed).into_iter().enumerate().map(place).collect()
}

/// The wall rolled up along its height by `turn` rad at the top, stretched and sheared a little.
fn rolled(dimension: usize, points: &[f64], turn: f64) -> Vec<f64> {
    let point = |x: &[f64]| {
        let angle = turn * x[1] / 0.08;
        let radius = 0.08 / turn;
        let across = x[0] - 0.298;
        let depth = x.get(2).copied().unwrap_or_default();
        let bent = [
            0.298 + radius - (radius - across) * angle.cos() + 0.05 * depth,
            1.05 * (radius - across) * angle.sin(),
            1.1 * depth + 0.1 * x[1],
        ];
        bent[..dimension].to_vec()
    };
    points.chunks(dimension).flat_map(point).collect()
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn points_off_the_wall_keep_force_moment_and_work_however_far_it_has_turned(
        dimension in 2usize..=3,
        cells in prop::array::uniform3(1usize..6),
        turn in 0.1..2.5,
        seed in any::<u64>(),
    ) {
        let surface = surface(dimension, &cells);
        let points = wall_points(dimension, 40, seed);
        // Some as wide as their area, which may be that of many facets, the others as they are apart.
        let area = (0..40).map(|i| if i % 3 == 0 { 1e-4 * (1.0 + i as f64).powi(2) } else { 0.0 }).collect();
        let wide = Points { dimension, reference_position: points.clone(), area };
        let mut mapping = Mapping::of_points(MappingKind::Projection, &wide, &surface).unwrap();
        let bent = rolled(dimension, &surface.reference_position, turn);
        mapping.turn(&bent);
        let mut place = vec![0.0; points.len()];
        mapping.place(&points, &minus(&bent, &surface.reference_position), &mut place);
        let (load, motion) = (noise(points.len(), seed ^ 3), noise(bent.len(), seed ^ 7));
        let (mut carried, mut given) = (vec![0.0; load.len()], vec![0.0; motion.len()]);
        mapping.spread_motion(&motion, &mut carried);
        mapping.gather_load(&load, &mut given);
        let (there, here) = (resultant(dimension, &load, &place), resultant(dimension, &given, &bent));
        let scale: f64 = load.iter().map(|f| f.abs()).sum();
        for axis in 0..3 {
            prop_assert!((there.force[axis] - here.force[axis]).abs() < 1e-12 * scale);
            prop_assert!((there.moment[axis] - here.moment[axis]).abs() < 1e-12 * scale, "{there:?} {here:?}");
        }
        let work = |f: &[f64], u: &[f64]| f.iter().zip(u).map(|(f, u)| f * u).sum::<f64>();
        // Points far off a small facet turn fast: what is small is measured by the works' own size.
        let size = work(&load.iter().map(|f| f.abs()).collect::<Vec<_>>(), &carried.iter().map(|u| u.abs()).collect::<Vec<_>>());
        prop_assert!((work(&load, &carried) - work(&given, &motion)).abs() < 1e-12 * size);
    }

    #[test]
    fn the_motion_of_points_off_the_wall_is_the_rate_of_their_place(
        dimension in 2usize..=3,
        cells in prop::array::uniform3(2usize..5),
        turn in 0.1..2.0,
        seed in any::<u64>(),
    ) {
        let surface = surface(dimension, &cells);
        let points = wall_points(dimension, 20, seed);
        let mut mapping = Mapping::new(MappingKind::Projection, &points, &surface).unwrap();
        let place_at = |mapping: &mut Mapping, turn: f64| {
            let bent = rolled(dimension, &surface.reference_position, turn);
            mapping.turn(&bent);
            let mut place = vec![0.0; points.len()];
            mapping.place(&points, &minus(&bent, &surface.reference_position), &mut place);
            (bent, place)
        };
        let step = 1e-5;
        let ((before, early), (after, late)) = (place_at(&mut mapping, turn - step), place_at(&mut mapping, turn + step));
        place_at(&mut mapping, turn);
        let mut motion = vec![0.0; points.len()];
        mapping.spread_motion(&minus(&after, &before), &mut motion);
        for (motion, moved) in motion.iter().zip(minus(&late, &early)) {
            // Central differences: the error is of third order in the step.
            prop_assert!((motion - moved).abs() < 1e-9 * step.max(motion.abs()), "{motion} {moved}");
        }
    }

    #[test]
    fn a_turn_as_a_whole_is_followed_exactly_by_points_off_the_surface(
        turn in prop::array::uniform3(-2.0..2.0),
        radius in 0.7..1.3,
        seed in any::<u64>(),
    ) {
        let surface = tube(5, 3);
        let points = tube_points(40, radius, seed);
        let rotation = nalgebra::Rotation3::from_scaled_axis(nalgebra::Vector3::from(turn));
        let turned = |points: &[f64]| -> Vec<f64> {
            points.chunks(3).flat_map(|x| (rotation * nalgebra::Vector3::from_row_slice(x)).data.0[0]).collect()
        };
        let mut mapping = Mapping::new(MappingKind::Projection, &points, &surface).unwrap();
        let now = turned(&surface.reference_position);
        mapping.turn(&now);
        let mut place = vec![0.0; points.len()];
        mapping.place(&points, &minus(&now, &surface.reference_position), &mut place);
        for (found, expected) in place.iter().zip(turned(&points)) {
            prop_assert!((found - expected).abs() < 1e-13, "{found} {expected}");
        }
    }
}

#[test]
fn the_load_of_a_point_spreads_over_the_piece_of_the_surface_that_is_its_own() {
    // 16 facets of 5 mm along the wall; a point of 20 mm at the middle of the left face, on a node.
    let surface = surface(2, &[1, 16]);
    let points = Points { dimension: 2, reference_position: vec![0.292, 0.04], area: vec![0.02] };
    let mapping = Mapping::of_points(MappingKind::Projection, &points, &surface).unwrap();
    let mut given = vec![0.0; surface.reference_position.len()];
    mapping.gather_load(&[8.0, 0.0], &mut given);
    let mut loads: Vec<(f64, f64)> =
        surface.reference_position.chunks(2).zip(given.chunks(2)).map(|(x, f)| (x[1], f[0])).collect();
    loads.retain(|load| load.1 != 0.0);
    loads.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Four samples in the middle of four facets: half of each at either node.
    let expected = [(0.03, 1.0), (0.035, 2.0), (0.04, 2.0), (0.045, 2.0), (0.05, 1.0)];
    assert_eq!(loads.len(), expected.len());
    for (found, expected) in loads.iter().zip(expected) {
        assert!((found.0 - expected.0).abs() < 1e-12 && (found.1 - expected.1).abs() < 1e-12, "{loads:?}");
    }
}

#[test]
fn a_point_inside_a_wall_follows_both_its_faces_by_how_near_they_are() {
    // The wall is 12 mm thick: the points stand 3 mm inside the left face and 2 mm below the top.
    let surface = surface(2, &[2, 16]);
    let reference = vec![0.295, 0.04, 0.298, 0.078];
    let points = Points { dimension: 2, reference_position: reference.clone(), area: vec![0.0; 2] };
    let mut mapping = Mapping::of_points(MappingKind::Projection, &points, &surface).unwrap();
    // Squeezed to two thirds: each face comes 2 mm in.
    let squeeze = |x: &[f64]| [(0.298 - x[0]) / 3.0, 0.0];
    let displacement: Vec<f64> = surface.reference_position.chunks(2).flat_map(squeeze).collect();
    let present: Vec<f64> =
        surface.reference_position.iter().zip(&displacement).map(|(x, u)| x + u).collect();
    mapping.turn(&present);
    let mut place = vec![0.0; 4];
    mapping.place(&reference, &displacement, &mut place);
    for (found, expected) in place.iter().zip([0.296, 0.04, 0.298, 0.078]) {
        assert!((found - expected).abs() < 1e-12, "{place:?}");
    }
    // The faces bear its load as a beam's supports do.
    let mut given = vec![0.0; surface.reference_position.len()];
    mapping.gather_load(&[4.0, 0.0, 0.0, 0.0], &mut given);
    let on = |x: f64| -> f64 {
        let nodes = surface.reference_position.chunks(2).zip(given.chunks(2));
        nodes.filter(|(place, _)| (place[0] - x).abs() < 1e-9).map(|(_, force)| force[0]).sum()
    };
    assert!((on(0.292) - 3.0).abs() < 1e-12 && (on(0.304) - 1.0).abs() < 1e-12, "{given:?}");
}
