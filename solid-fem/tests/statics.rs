//! Static problems with known answers.

#![allow(clippy::unwrap_used, reason = "tests")]

use solid_fem::box_grid::BoxGrid;
use solid_fem::element::ElementKind;
use solid_fem::probe::Probe;
use solid_fem::scene::{FaceLoad, FaceLoadKind, Scene};
use solid_fem::solid::Solid;

mod common;
use common::{assert_close, obstacle, pressed, static_tip};

/// Obstacle 1.2 x 8 x 29.2 cm, clamped foot, 10 Pa on the left face: 3.6197e-4 m at the middle of the top's left edge,
/// the limit of four families of quadratic and enhanced elements under refinement (nu 0, so 2-D and 3-D agree).
const TIP: f64 = 3.6197e-4;

#[test]
fn obstacle_under_uniform_pressure_in_2d() {
    for cells in [[1, 16, 1], [2, 16, 1]] {
        let tip = static_tip(pressed(obstacle(2, cells, None), 10.0, false), 1);
        assert_close(tip[0], TIP, 0.005, "2-D tip");
    }
}

#[test]
fn obstacle_under_uniform_pressure_in_3d() {
    for cells in [[1, 8, 6], [2, 12, 4]] {
        let tip = static_tip(pressed(obstacle(3, cells, None), 10.0, false), 1);
        assert_close(tip[0], TIP, 0.005, "3-D tip");
    }
}

/// The paper's mesh of about 29,000 linear tetrahedra is a third too stiff.
#[test]
fn the_paper_s_tetrahedra_are_a_quarter_short() {
    let tip = static_tip(pressed(obstacle(3, [3, 20, 73], Some(ElementKind::Tet4)), 10.0, false), 1);
    let short = tip[0] / TIP - 1.0;
    assert!((short + 0.246).abs() < 0.02, "{:.1} %", 100.0 * short);
}

/// 1000 Pa follower pressure: 0.0363 m (the Euler beam in linear theory has 0.0356).
#[test]
fn obstacle_under_strong_follower_pressure() {
    let tip = static_tip(pressed(obstacle(2, [2, 32, 1], None), 1000.0, true), 4);
    assert_close(tip[0], 0.0363, 0.005, "follower tip");
}

/// The same by cells 20 times as wide as high, whose fibres are strained by 13 % at the foot: without the energy of their own
/// for the square of the bending, the tangent would lose its sign at 8 %. One cell across is 1.6 % too stiff.
#[test]
fn slender_cells_bear_strong_bending() {
    for (dimension, cells) in [(2, [1, 134, 1]), (3, [1, 134, 1])] {
        let tip = static_tip(pressed(obstacle(dimension, cells, None), 1000.0, true), 8);
        assert_close(tip[0], 0.0363, 0.02, "follower tip");
    }
}

/// A column under its own weight: u(H) = -rho g H^2 / (2 E) for nu 0 and small strain; the support carries the weight.
#[test]
fn a_column_carries_its_weight() {
    for dimension in [2, 3] {
        let grid = BoxGrid { dimension, minimum: [0.0; 3], maximum: [1.0, 2.0, 0.5], cells: [2, 8, 2] };
        let mut scene = Scene::of_box(grid, 2000.0, 1e12, 0.0);
        scene.gravity = [0.0, -9.81, 0.0];
        let mut solid = Solid::new(scene).unwrap();
        let probe = Probe::at(solid.mesh(), &[0.5, 2.0, 0.25]).unwrap();
        let top = probe.value(solid.displacement(), dimension);
        assert_close(top[1], -2000.0 * 9.81 * 4.0 / (2.0 * 1e12), 1e-6, "top of the column");
        let volume = if dimension == 2 { 2.0 } else { 1.0 };
        assert_close(solid.reaction().force[1], 2000.0 * 9.81 * volume, 1e-9, "weight on the support");
        let middle = if dimension == 2 { [0.0, 0.0, 0.5] } else { [-0.25, 0.0, 0.5] };
        for (moment, arm) in solid.reaction().moment.iter().zip(middle) {
            assert!((moment - arm * 2000.0 * 9.81 * volume).abs() < 1e-6 * 2000.0 * 9.81, "{moment}");
        }
    }
}

/// Elastica: cantilever of slenderness 100 with a dead load P across its tip; dx/L and dy/L for P L^2 / (E I)
/// (K. E. Bisshopp and D. C. Drucker, Q. Appl. Math. 3 (1945) 272; values by elliptic integrals).
#[test]
fn elastica() {
    const ROWS: [(f64, f64, f64); 7] = [
        (0.25, 0.08275, 0.00412),
        (0.5, 0.16214, 0.01592),
        (1.0, 0.30172, 0.05643),
        (2.0, 0.49346, 0.16064),
        (3.0, 0.60325, 0.25442),
        (5.0, 0.71379, 0.38763),
        (10.0, 0.81061, 0.55500),
    ];
    let (length, height, modulus) = (1.0, 0.01, 1e9);
    let grid = BoxGrid { dimension: 2, minimum: [0.0; 3], maximum: [length, height, 0.0], cells: [80, 1, 1] };
    for (load, dy, dx) in ROWS {
        let mut scene = Scene::of_box(grid, 1000.0, modulus, 0.0);
        scene.clamped = vec!["left".to_owned()];
        let inertia = height * height * height / 12.0;
        let traction = load * modulus * inertia / (length * length) / height;
        let kind = FaceLoadKind::DeadTraction([0.0, -traction, 0.0]);
        scene.loads = vec![FaceLoad { face: "right".to_owned(), kind, table: Vec::new() }];
        let solid = Solid::new_static(scene, 16).unwrap();
        let tip =
            Probe::at(solid.mesh(), &[length, 0.5 * height, 0.0]).unwrap().value(solid.displacement(), 2);
        assert!((-tip[1] / length - dy).abs() < 0.005 * dy, "{load}: dy {} {dy}", -tip[1]);
        assert!((-tip[0] / length - dx).abs() < 0.005 * dx.max(0.01), "{load}: dx {} {dx}", -tip[0]);
    }
}

/// Beam 0.35 x 0.02 m clamped at its left end under a body force of 2 m/s2, plane strain, nu 0.4, rho 1000, shear
/// modulus 0.5e6 Pa (CSM1) and 2e6 Pa (CSM2): S. Turek and J. Hron, LNCSE 53 (2006) 371. Their beam is clamped on the
/// arc of a cylinder whose corners lie 1 mm behind the straight clamp used here, hence a tolerance of 1 % in uy (which
/// goes with the fourth power of the length) and 2 % in ux (which goes with the seventh).
#[test]
fn turek_hron_csm1_and_csm2() {
    for (shear, ux, uy) in [(0.5e6, -7.188e-3, -66.10e-3), (2e6, -0.4690e-3, -16.97e-3)] {
        let grid =
            BoxGrid { dimension: 2, minimum: [0.0; 3], maximum: [0.35, 0.02, 0.0], cells: [140, 8, 1] };
        let mut scene = Scene::of_box(grid, 1000.0, 2.0 * 1.4 * shear, 0.4);
        scene.clamped = vec!["left".to_owned()];
        scene.gravity = [0.0, -2.0, 0.0];
        let solid = Solid::new_static(scene, 2).unwrap();
        let tip = Probe::at(solid.mesh(), &[0.35, 0.01, 0.0]).unwrap().value(solid.displacement(), 2);
        assert_close(tip[0], ux, 0.02, "ux");
        assert_close(tip[1], uy, 0.01, "uy");
    }
}

/// Plate of 1 m x 0.05 m clamped at both ends under its weight and 2 m of water, plane strain, E 67.5 GPa, rho 2700:
/// q L4 / (384 D) + q L2 / (8 k G t), k = 5/6. Without the second term, the shear of a plate of slenderness 20, it is the
/// -6.85e-5 m (nu 0.34) or -7.05e-5 m (nu 0.3) of thin plate theory that coupled codes are compared with. A clamp that
/// keeps its section from warping takes 1 % off (7.03e-5 m on 80 x 4 elements at nu 0.34), hence a tolerance of 1.5 %.
#[test]
fn hydrostatic_plate() {
    for (ratio, thin) in [(0.34, -6.85e-5), (0.3, -7.05e-5)] {
        let (modulus, thickness) = (67.5e9, 0.05);
        let load = 2.0 * 9810.0 + 2700.0 * 9.81 * thickness;
        let bending = modulus * thickness * thickness * thickness / (12.0 * (1.0 - ratio * ratio));
        let shear = load / (8.0 * 5.0 / 6.0 * modulus / (2.0 * (1.0 + ratio)) * thickness);
        assert_close(-load / (384.0 * bending), thin, 0.002, "thin plate");
        let expected = -load / (384.0 * bending) - shear;
        let grid = BoxGrid { dimension: 2, minimum: [0.0; 3], maximum: [1.0, 0.05, 0.0], cells: [80, 4, 1] };
        let mut scene = Scene::of_box(grid, 2700.0, modulus, ratio);
        scene.clamped = vec!["left".to_owned(), "right".to_owned()];
        scene.gravity = [0.0, -9.81, 0.0];
        let kind = FaceLoadKind::FollowerPressure(2.0 * 9810.0);
        scene.loads = vec![FaceLoad { face: "top".to_owned(), kind, table: Vec::new() }];
        let solid = Solid::new_static(scene, 1).unwrap();
        let middle = Probe::at(solid.mesh(), &[0.5, 0.025, 0.0]).unwrap().value(solid.displacement(), 2);
        assert_close(middle[1], expected, 0.015, "mid deflection");
    }
}

/// Between rollers a prismatic body of hexahedra is the plane strain body of quadrilaterals.
#[test]
fn hexahedra_between_rollers_are_plane_strain() {
    let tip = |dimension: usize, element| {
        let cells = [2, 6, 2];
        let mut scene = pressed(obstacle(dimension, cells, element), 400.0, true);
        scene.substance.poisson_ratio = 0.4;
        if dimension == 3 {
            scene.rollers = vec!["back".to_owned(), "front".to_owned()];
        }
        static_tip(scene, 2)
    };
    let (plane, solid) = (tip(2, None), tip(3, None));
    assert_close(solid[0], plane[0], 1e-8, "ux");
    assert_close(solid[1], plane[1], 1e-8, "uy");
}

/// Slender cells under pressure across them: a stack of cells 20 times as wide as high bears its weight, and a pressure of a
/// tenth of its modulus, as a stack of squat ones does: at Poisson's ratio 0 nothing depends on x.
#[test]
fn slender_cells_bear_pressure_across() {
    for dimension in [2, 3] {
        let top = |across: usize, pressure: f64| {
            let cells = [across, 60, 1];
            let grid = BoxGrid { dimension, minimum: [0.0; 3], maximum: [0.024, 0.072, 0.024], cells };
            let mut scene = Scene::of_box(grid, 2500.0, 1e5, 0.0);
            scene.gravity = [0.0, -9.81, 0.0];
            let kind = FaceLoadKind::DeadPressure(pressure);
            scene.loads = vec![FaceLoad { face: "top".to_owned(), kind, table: Vec::new() }];
            // Held against buckling as a whole.
            scene.rollers = ["left", "back"][..dimension - 1].iter().map(|&face| face.to_owned()).collect();
            let solid = Solid::new_static(scene, 4);
            let mut solid = solid.unwrap_or_else(|error| panic!("{across} x {pressure} Pa: {error}"));
            let probe = Probe::at(solid.mesh(), &[0.012, 0.072, 0.012]).unwrap();
            assert!(solid.modes(1).unwrap()[0].frequency > 1.0);
            probe.value(solid.displacement(), dimension)[1]
        };
        for pressure in [0.0, 1e4] {
            assert_close(top(1, pressure), top(4, pressure), 1e-6, "top of the stack");
        }
    }
}

/// Weight beyond the buckling load is refused by name, not computed.
#[test]
fn a_body_crushed_by_its_weight_is_an_error() {
    let mut scene = obstacle(2, [2, 16, 1], None);
    scene.substance.young_modulus = 100.0;
    scene.gravity = [0.0, -9.81, 0.0];
    assert!(Solid::new(scene).is_err());
}
