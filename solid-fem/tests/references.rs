//! Benchmarks of the literature, on meshes that are no boxes, at the locking limit and beyond yield.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::sync::Arc;

use solid_fem::box_grid::BoxGrid;
use solid_fem::element::{ElementKind, Kinematics};
use solid_fem::integrator::Integrator;
use solid_fem::load::Load;
use solid_fem::material::LawKind;
use solid_fem::mesh::Mesh;
use solid_fem::probe::Probe;
use solid_fem::scene::{FaceLoad, FaceLoadKind, Geometry, Scene};
use solid_fem::solid::Solid;

mod common;
use common::assert_close;

/// A scene whose mesh is a unit square or cube of cells taken to another shape.
fn mapped(kind: ElementKind, cells: [usize; 3], map: impl Fn(&mut [f64])) -> Scene {
    let grid = BoxGrid { dimension: kind.dimension(), minimum: [0.0; 3], maximum: [1.0; 3], cells };
    let mut mesh = Mesh::of_box(&grid, kind.cell());
    mesh.reference_position.chunks_exact_mut(kind.dimension()).for_each(map);
    let mut scene = Scene::of_box(grid, 1.0, 1.0, 0.0);
    (scene.element, scene.geometry) = (kind, Geometry::Mesh(Arc::new(mesh)));
    scene.clamped.clear();
    scene
}

/// Cook's membrane: corners (0,0) (48,44) (48,60) (0,44), unit shear force on the right edge, E 1.
fn cook(kind: ElementKind, cells: usize, poisson_ratio: f64, is_plane_stress: bool) -> f64 {
    let mut scene = mapped(kind, [cells, cells, 1], |x| {
        let (s, t) = (x[0], x[1]);
        (x[0], x[1]) = (48.0 * s, 44.0 * s + t * (44.0 - 28.0 * s));
    });
    scene.clamped = vec!["left".to_owned()];
    scene.substance.poisson_ratio = poisson_ratio;
    scene.substance.is_plane_stress = is_plane_stress;
    scene.substance.kinematics = Kinematics::Linear;
    if kind.dimension() == 3 {
        scene.rollers = vec!["back".to_owned(), "front".to_owned()];
    }
    let kind = FaceLoadKind::DeadTraction([0.0, 1.0 / 16.0, 0.0]);
    scene.loads = vec![FaceLoad { face: "right".to_owned(), kind, table: Vec::new() }];
    let solid = Solid::new_static(scene, 1).unwrap();
    let dimension = solid.mesh().dimension;
    let probe = Probe::at(solid.mesh(), &[48.0, 52.0, 0.5][..dimension]).unwrap();
    probe.value(solid.displacement(), dimension)[1]
}

/// Plane stress, nu 1/3: 23.96 (R. D. Cook, J. Struct. Div. 100 (1974) 1851; limit of refinement).
#[test]
fn cook_s_membrane_in_plane_stress() {
    for (kind, tolerance) in
        [(ElementKind::Quad4Eas4, 0.005), (ElementKind::Quad8, 0.005), (ElementKind::Tri6, 0.005)]
    {
        assert_close(cook(kind, 32, 1.0 / 3.0, true), 23.96, tolerance, kind.name());
    }
}

/// Plane strain up to the incompressible limit; limits of refinement of enhanced and quadratic elements.
#[test]
fn cook_s_membrane_in_plane_strain() {
    for (ratio, expected) in [(0.3333, 21.519), (0.49, 18.696), (0.499, 18.475), (0.4999, 18.450)] {
        // Quadratic elements with full integration still stiffen a little at the limit.
        for (kind, tolerance) in
            [(ElementKind::Quad4Eas4, 0.005), (ElementKind::Quad8, 0.012), (ElementKind::Tri6, 0.015)]
        {
            assert_close(cook(kind, 32, ratio, false), expected, tolerance, kind.name());
        }
    }
}

/// Locking at nu 0.4999 on 16 x 16 cells, in space one cell between rollers: the enhanced and the quadratic elements within
/// 2.5 %. The constant strain triangle is worse even in mirrored pairs, where it locks least (all cut one way it is 71 %
/// short).
#[test]
fn only_the_paper_s_elements_lock() {
    let error = |kind| cook(kind, 16, 0.4999, false) / 18.450 - 1.0;
    assert!(error(ElementKind::Quad4Eas4).abs() < 0.015, "{}", error(ElementKind::Quad4Eas4));
    assert!(error(ElementKind::Tri6).abs() < 0.025, "{}", error(ElementKind::Tri6));
    assert!(error(ElementKind::Quad8).abs() < 0.015, "{}", error(ElementKind::Quad8));
    assert!(error(ElementKind::Hex8Eas9).abs() < 0.015, "{}", error(ElementKind::Hex8Eas9));
    assert!(error(ElementKind::Tet10).abs() < 0.025, "{}", error(ElementKind::Tet10));
    assert!(error(ElementKind::Tri3) < -0.05, "{}", error(ElementKind::Tri3));
}

/// The obstacle under 10 Pa by every element in space: Tet10 and Hex20 within 1 % at the coarsest mesh.
#[test]
fn quadratic_elements_bend_without_locking() {
    for (kind, cells, tolerance) in [
        (ElementKind::Tet10, [1, 4, 6], 0.015),
        (ElementKind::Tet10, [1, 7, 24], 0.006),
        (ElementKind::Hex20, [1, 4, 6], 0.01),
        (ElementKind::Hex20, [2, 7, 10], 0.003),
    ] {
        let scene = common::pressed(common::obstacle(3, cells, Some(kind)), 10.0, false);
        assert_close(common::static_tip(scene, 1)[0], 3.6197e-4, tolerance, kind.name());
    }
    for kind in [ElementKind::Quad8, ElementKind::Tri6] {
        let scene = common::pressed(common::obstacle(2, [1, 8, 1], Some(kind)), 10.0, false);
        assert_close(common::static_tip(scene, 1)[0], 3.6197e-4, 0.01, kind.name());
    }
}

/// Thick-walled cylinder, radii 0.1 and 0.2 m, plane strain, ideally plastic steel (E 210 GPa, nu 0.3, 240 MPa): limit
/// pressure 2/sqrt3 sy ln(b/a) = 192.1 MPa; before it, with the plastic front at c, p = 2 k (ln(c/a) + (1 - c2/b2)/2) and
/// u(b) = 2 k c2 (1 - nu2)/(E b), k = sy/sqrt3 (R. Hill, The Mathematical Theory of Plasticity, 1950; mesh and numbers as
/// in de Souza Neto, Peric and Owen, Computational Methods for Plasticity, 2008, 7.5.1).
#[test]
fn thick_walled_cylinder_yields_at_its_limit_pressure() {
    let (inner, outer, modulus, ratio, limit) = (0.1, 0.2, 2.1e11, 0.3, 2.4e8);
    let k = limit / 3.0f64.sqrt();
    let cylinder = |kind: ElementKind, pressure: f64| {
        let mut scene = mapped(kind, [12, 8, 1], |x| {
            let (radius, angle) = (inner + (outer - inner) * x[0], std::f64::consts::FRAC_PI_2 * x[1]);
            (x[0], x[1]) = (radius * angle.cos(), radius * angle.sin());
        });
        scene.rollers = vec!["bottom".to_owned(), "top".to_owned()];
        (scene.substance.young_modulus, scene.substance.poisson_ratio) = (modulus, ratio);
        scene.substance.law = LawKind::Plasticity { hardening: vec![(0.0, limit)] };
        let kind = FaceLoadKind::FollowerPressure(pressure);
        scene.loads = vec![FaceLoad { face: "left".to_owned(), kind, table: Vec::new() }];
        let solid = Solid::new_static(scene, 10)?;
        let probe = Probe::at(solid.mesh(), &[outer, 0.0]).unwrap();
        Ok::<f64, solid_fem::error::SolidError>(probe.value(solid.displacement(), 2)[0])
    };
    let front = 0.16;
    let pressure = 2.0 * k * ((front / inner).ln() + 0.5 * (1.0 - front * front / (outer * outer)));
    let expected = 2.0 * k * front * front * (1.0 - ratio * ratio) / (modulus * outer);
    for kind in [ElementKind::Quad8, ElementKind::Quad4Eas4] {
        assert_close(cylinder(kind, pressure).unwrap(), expected, 0.02, kind.name());
    }
    let collapse = 2.0 * k * (outer / inner).ln();
    assert!(cylinder(ElementKind::Quad8, 0.985 * collapse).is_ok());
    assert!(cylinder(ElementKind::Quad8, 1.015 * collapse).is_err());
}

/// A free body turning about its middle for 20 turns at omega dt 0.02: the energy-momentum method keeps energy and angular
/// momentum to the tolerance of its solver.
#[test]
fn the_energy_momentum_method_keeps_energy_and_angular_momentum() {
    let grid =
        BoxGrid { dimension: 2, minimum: [-0.1, -0.02, 0.0], maximum: [0.1, 0.02, 0.0], cells: [4, 1, 1] };
    for kind in [ElementKind::Quad4Eas4, ElementKind::Quad8] {
        let mut scene = Scene::of_box(grid, 1000.0, 1e6, 0.3);
        (scene.element, scene.integrator, scene.newton_tolerance) = (kind, Integrator::EnergyMomentum, 1e-11);
        scene.clamped = Vec::new();
        let mut solid = Solid::new(scene).unwrap();
        let omega = 4.0;
        let position = solid.mesh().reference_position.clone();
        let velocity: Vec<f64> = position.chunks(2).flat_map(|x| [-omega * x[1], omega * x[0]]).collect();
        solid.set_motion(&vec![0.0; velocity.len()], &velocity).unwrap();
        let start = (solid.energies().total(), solid.angular_momentum()[2]);
        for _ in 0..(20.0 * std::f64::consts::TAU / 0.02) as u32 {
            solid.advance(0.02 / omega, Load::None).unwrap();
        }
        assert!(
            (solid.energies().total() / start.0 - 1.0).abs() < 1e-8,
            "{}",
            solid.energies().total() / start.0
        );
        assert!((solid.angular_momentum()[2] / start.1 - 1.0).abs() < 1e-8);
        assert_eq!(solid.counts().halvings, 0);
    }
}

/// In linear kinematics one tangent and one factor serve all steps and all loads of a static run.
#[test]
fn a_linear_body_is_factored_once() {
    let mut scene = common::pressed(common::obstacle(2, [2, 16, 1], None), 10.0, true);
    scene.substance.kinematics = Kinematics::Linear;
    scene.loads[0].table = vec![(0.0, 0.0), (1.0, 1.0)];
    let mut solid = Solid::new_at_weight(scene.clone()).unwrap();
    for _ in 0..20 {
        solid.advance_static(0.05, Load::None).unwrap();
    }
    assert_eq!((solid.counts().tangents, solid.counts().factorizations), (0, 1));
    let tip = common::tip_probe(&scene).value(solid.displacement(), 2)[0];
    assert_close(tip, 3.6197e-4, 0.005, "linear tip");
}

/// Three of bending and one axial, Hz: Timoshenko's beam and sqrt(E/rho)/(4 L), by converged quadratic elements.
#[test]
fn the_lowest_frequencies_of_the_obstacle() {
    let mut solid = Solid::in_reference(common::obstacle(2, [2, 24, 1], Some(ElementKind::Quad8))).unwrap();
    for (mode, expected) in solid.modes(4).unwrap().iter().zip([5.971, 34.61, 62.50, 87.73]) {
        assert_close(mode.frequency, expected, 0.005, "frequency");
    }
}

/// Stiffness-proportional damping b: the first mode decays as exp(-b w^2 t / 2).
#[test]
fn stiffness_damping_decays_at_its_rate() {
    let mut scene = common::obstacle(2, [1, 8, 1], None);
    scene.integrator = Integrator::GeneralisedAlpha { rho_inf: 1.0 };
    let bent = Solid::new_static(common::pressed(scene.clone(), 1.0, false), 1).unwrap();
    scene.stiffness_damping = 2e-3;
    let mut solid = Solid::new(scene).unwrap();
    solid.set_motion(bent.displacement(), &vec![0.0; bent.displacement().len()]).unwrap();
    let energy = solid.energies().total();
    for _ in 0..1000 {
        solid.advance(1e-3, Load::None).unwrap();
    }
    let omega = std::f64::consts::TAU * 5.971;
    let fallen = (solid.energies().total() / energy).ln() / (-2e-3 * omega * omega);
    assert!((fallen - 1.0).abs() < 0.05, "{fallen}");
}

/// A face that moves as told: the body follows, and the support feels the inertia of the whole body.
#[test]
fn a_prescribed_face_carries_the_body() {
    use protocol::case::Prescribed;
    use solid_fem::support::Support;
    let grid = BoxGrid { dimension: 2, minimum: [0.0; 3], maximum: [1.0, 0.5, 0.0], cells: [4, 2, 1] };
    let mut scene = Scene::of_box(grid, 1000.0, 1e9, 0.0);
    scene.clamped.clear();
    // u = a t^2 / 2 by a table is a cubic through its rows: a slow sine is smoother.
    let motion = Prescribed::Sine { amplitude: vec![0.1, 0.0], frequency: 1.0, phase: 0.0 };
    scene.supports = vec![Support { face: "left".to_owned(), axes: [true; 3], motion }];
    let mut solid = Solid::in_reference(scene).unwrap();
    let omega = std::f64::consts::TAU;
    let start: Vec<f64> =
        (0..solid.displacement().len()).map(|i| if i % 2 == 0 { 0.1 * omega } else { 0.0 }).collect();
    solid.set_motion(&vec![0.0; start.len()], &start).unwrap();
    for _ in 0..250 {
        solid.advance(1e-3, Load::None).unwrap();
    }
    let probe = Probe::at(solid.mesh(), &[1.0, 0.25]).unwrap();
    assert!((probe.value(solid.displacement(), 2)[0] - 0.1).abs() < 1e-4);
    // Mass 500 kg/m at -a w^2.
    assert_close(solid.reaction().force[0], -500.0 * 0.1 * omega * omega, 0.02, "inertia on the support");
}

/// What the supports leave free is refused by name.
#[test]
fn a_mechanism_is_named() {
    let mut scene = common::obstacle(2, [1, 8, 1], None);
    let refused = |scene: &Scene| scene.check_supports(&scene.mesh()).map_err(|error| error.to_string());
    assert_eq!(refused(&scene), Ok(()));
    scene.clamped.clear();
    scene.rollers = vec!["bottom".to_owned()];
    assert!(refused(&scene).unwrap_err().contains("move"));
    scene.rollers.push("left".to_owned());
    assert_eq!(refused(&scene), Ok(()));
    scene.rollers = vec!["chimney".to_owned()];
    assert!(refused(&scene).unwrap_err().contains("chimney"));
}
