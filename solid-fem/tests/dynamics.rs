//! Motion in time: frequencies, response to a step load, order of the integrators, conservation, rest, determinism.

#![allow(clippy::unwrap_used, reason = "tests")]

use solid_fem::box_grid::{BoxGrid, Face};
use solid_fem::element::ElementKind;
use solid_fem::integrator::Integrator;
use solid_fem::load::Load;
use solid_fem::scene::{FaceLoad, FaceLoadKind, Scene};
use solid_fem::solid::Solid;

mod common;
use common::{assert_close, obstacle, pressed, tip_probe};

/// First bending frequency of the obstacle: 5.971 Hz (Euler's beam 6.03 Hz less shear and rotary inertia).
#[test]
fn first_frequency_of_the_obstacle() {
    for (dimension, cells) in [(2, [2, 24, 1]), (3, [1, 12, 6])] {
        let mut solid = Solid::new(obstacle(dimension, cells, None)).unwrap();
        assert_close(solid.modes(1).unwrap()[0].frequency, 5.971, 0.005, "first frequency");
    }
}

/// The same from zero crossings of the free vibration after a small static deflection is let go.
#[test]
fn free_vibration_has_the_first_frequency() {
    let scene = obstacle(2, [2, 24, 1], None);
    let probe = tip_probe(&scene);
    let bent = Solid::new_static(pressed(scene.clone(), 1.0, false), 1).unwrap();
    let mut solid = Solid::new(scene).unwrap();
    let zero = vec![0.0; bent.displacement().len()];
    solid.set_motion(bent.displacement(), &zero).unwrap();
    let dt = 1e-3;
    let (mut crossings, mut last) = (Vec::new(), probe.value(solid.displacement(), 2)[0]);
    while crossings.len() < 7 {
        solid.advance(dt, Load::None).unwrap();
        let tip = probe.value(solid.displacement(), 2)[0];
        if last * tip < 0.0 {
            crossings.push(solid.time() - dt * tip / (tip - last));
        }
        last = tip;
    }
    assert_close(3.0 / (crossings[6] - crossings[0]), 5.971, 0.005, "frequency");
}

/// Follower pressure of 500 Pa on the left face from t = 0: horizontal tip deflection, m, of an independent finite
/// element code (quadratic reduced-integration bricks, no numerical damping, dt 1e-3 s); tolerance 1 % of the peak.
#[test]
fn response_to_a_step_load() {
    const CURVE: [(f64, f64); 8] = [
        (0.02, 0.00458),
        (0.04, 0.01666),
        (0.06, 0.02972),
        (0.08, 0.03584),
        (0.10, 0.03307),
        (0.12, 0.02298),
        (0.14, 0.00938),
        (0.16, 0.00040),
    ];
    let scene = pressed(obstacle(2, [2, 32, 1], None), 500.0, true);
    let probe = tip_probe(&scene);
    let mut solid = Solid::new(scene).unwrap();
    let dt = 2.5e-4;
    for (time, expected) in CURVE {
        while solid.time() < time - 0.5 * dt {
            solid.advance(dt, Load::None).unwrap();
        }
        let tip = probe.value(solid.displacement(), 2)[0];
        assert!((tip - expected).abs() < 0.01 * 0.0363, "t = {time}: {tip}, expected {expected}");
    }
}

/// Order from a nonlinear oscillator: one element between rollers, pressed by a tenth of its height and let go, after
/// 1.4 periods; differences of successive halvings of the step.
fn order(integrator: Integrator) -> f64 {
    let mut scene = obstacle(2, [1, 1, 1], None);
    scene.integrator = integrator;
    scene.newton_tolerance = 1e-11;
    scene.rollers = vec!["left".to_owned(), "right".to_owned()];
    let mut pressed = scene.clone();
    pressed.loads =
        vec![FaceLoad { face: "top".to_owned(), kind: FaceLoadKind::DeadPressure(8e4), table: Vec::new() }];
    let bent = Solid::new_static(pressed, 1).unwrap();
    let probe = tip_probe(&scene);
    let tip = |steps: u32| {
        let mut solid = Solid::new(scene.clone()).unwrap();
        solid.set_motion(bent.displacement(), &vec![0.0; bent.displacement().len()]).unwrap();
        for _ in 0..steps {
            solid.advance(0.02 / f64::from(steps), Load::None).unwrap();
        }
        probe.value(solid.displacement(), 2)[1]
    };
    let [coarse, middle, fine] = [tip(200), tip(400), tip(800)];
    ((coarse - middle) / (middle - fine)).abs().log2()
}

#[test]
fn generalised_alpha_is_of_second_order() {
    let order = order(Integrator::default());
    assert!((order - 2.0).abs() < 0.1, "{order}");
}

#[test]
fn the_paper_s_newmark_is_of_first_order() {
    let order = order(Integrator::PAPER);
    assert!((order - 1.0).abs() < 0.1, "{order}");
}

/// An unloaded body under its weight does not move by a single bit, and every step is skipped.
#[test]
fn rest_is_kept_to_the_last_bit() {
    for (dimension, cells) in [(2, [2, 16, 1]), (3, [1, 6, 4])] {
        for integrator in [Integrator::default(), Integrator::PAPER] {
            let mut scene = obstacle(dimension, cells, None);
            scene.gravity = [0.0, -9.81, 0.0];
            scene.integrator = integrator;
            let mut solid = Solid::new(scene).unwrap();
            let start = solid.displacement().to_vec();
            let calm = vec![0.0; solid.surface().node_count() * dimension];
            for step in 0..50 {
                let dt = 1e-4 * f64::from(1 + step % 3);
                assert_eq!(solid.advance(dt, Load::NodalForce(&calm)).unwrap().newton_iterations, 0);
            }
            assert!(start.iter().any(|&u| u != 0.0));
            assert_eq!(solid.displacement(), start);
            assert!(solid.velocity().iter().chain(solid.acceleration()).all(|&value| value == 0.0));
            assert_eq!(solid.counts().skipped, 50);
        }
    }
}

/// A body at rest sleeps until a load comes, and nothing afterwards tells that it did. The twin is kept awake by being
/// restored before every step.
#[test]
fn a_sleeping_body_wakes_as_if_it_had_been_awake() {
    let kinds = [(2, None), (2, Some(ElementKind::Quad8)), (3, Some(ElementKind::Hex8Eas9))];
    for (dimension, element) in kinds {
        for integrator in [Integrator::default(), Integrator::PAPER, Integrator::EnergyMomentum] {
            let mut scene = obstacle(dimension, [1, 6, 4], element);
            (scene.gravity, scene.integrator) = ([0.0, -9.81, 0.0], integrator);
            let [mut sleeper, mut twin] = [(); 2].map(|()| Solid::new(scene.clone()).unwrap());
            let count = sleeper.surface().node_count() * dimension;
            let calm = vec![0.0; count];
            let push: Vec<f64> = (0..count).map(|i| if i % dimension == 0 { 0.01 } else { 0.0 }).collect();
            for step in 0..60 {
                let load = Load::NodalForce(if step < 40 { &calm } else { &push });
                let dt = 1e-4 * f64::from(1 + step % 3);
                sleeper.advance(dt, load).unwrap();
                twin.save();
                twin.restore();
                twin.advance(dt, load).unwrap();
                assert_eq!(sleeper.time(), twin.time());
                assert_eq!(sleeper.displacement(), twin.displacement());
                assert_eq!(sleeper.velocity(), twin.velocity());
                assert_eq!(sleeper.acceleration(), twin.acceleration());
            }
            assert_eq!((sleeper.counts().slept, twin.counts().slept), (39, 0));
            assert_eq!(solid_fem::Counts { slept: 0, ..sleeper.counts() }, twin.counts());
            assert!(sleeper.displacement().iter().any(|&u| u != 0.0));
        }
    }
}

/// A free body turning about its middle keeps its energy (rho_inf 0.5, 20 turns at omega dt 0.02: at least 0.998).
#[test]
fn a_spinning_body_keeps_its_energy() {
    let grid =
        BoxGrid { dimension: 2, minimum: [-0.1, -0.02, 0.0], maximum: [0.1, 0.02, 0.0], cells: [4, 1, 1] };
    let mut scene = Scene::of_box(grid, 1000.0, 1e6, 0.3);
    scene.clamped = Vec::new();
    let mut solid = Solid::new(scene).unwrap();
    let omega = 4.0;
    let position = solid.mesh().reference_position.clone();
    let velocity: Vec<f64> = position.chunks(2).flat_map(|x| [-omega * x[1], omega * x[0]]).collect();
    solid.set_motion(&vec![0.0; velocity.len()], &velocity).unwrap();
    let start = solid.energies().total();
    let dt = 0.02 / omega;
    let turns = (20.0 * std::f64::consts::TAU / 0.02) as u32;
    for _ in 0..turns {
        solid.advance(dt, Load::None).unwrap();
    }
    let kept = solid.energies().total() / start;
    assert!((0.998..1.0001).contains(&kept), "{kept}");
}

fn motion(threads: usize, dimension: usize, cells: [usize; 3], element: Option<ElementKind>) -> Vec<f64> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let mut scene = pressed(obstacle(dimension, cells, element), 300.0, true);
        scene.gravity = [0.0, -9.81, 0.0];
        let mut solid = Solid::new(scene).unwrap();
        for dt in [1e-3, 1e-3, 2e-3, 2e-2] {
            solid.advance(dt, Load::None).unwrap();
        }
        let mut motion = vec![0.0; 3 * solid.surface().node_count() * dimension];
        solid.write_interface_motion(&mut motion);
        motion
    })
}

#[test]
fn one_two_and_four_threads_give_the_same_bits() {
    for (dimension, cells, element) in
        [(3, [2, 16, 48], None), (2, [4, 600, 1], None), (3, [2, 10, 20], Some(ElementKind::Tet4))]
    {
        let one = motion(1, dimension, cells, element);
        assert!(one == motion(2, dimension, cells, element));
        assert!(one == motion(4, dimension, cells, element));
    }
}

/// Traction at the markers of a flat face is the nodal force of a dead pressure as long as nothing has turned.
#[test]
fn tractions_and_nodal_forces_act_alike() {
    for dimension in [2, 3] {
        let run = |as_traction: bool| {
            let scene = obstacle(dimension, [1, 8, 4], None);
            let probe = tip_probe(&scene);
            let mut solid = Solid::new(scene.clone()).unwrap();
            let markers = solid.surface().facets.markers();
            let pressure = 0.01;
            let mut traction = vec![0.0; markers.len() * dimension];
            for (marker, traction) in markers.iter().zip(traction.chunks_mut(dimension)) {
                traction[0] = if marker.face == Face::Left as usize { pressure } else { 0.0 };
            }
            // The same by hand: each cell edge of the left face carries its share.
            let mut force = vec![0.0; solid.surface().node_count() * dimension];
            let size = 0.08 / 8.0 * if dimension == 3 { 0.292 / 4.0 } else { 1.0 };
            for facet in 0..solid.surface().facets.len() {
                let nodes = solid.surface().facets.facet(facet);
                if solid.surface().facets.face[facet] == Face::Left as usize {
                    for &node in nodes {
                        force[node * dimension] += pressure * size / nodes.len() as f64;
                    }
                }
            }
            for _ in 0..20 {
                let load = if as_traction { Load::Traction(&traction) } else { Load::NodalForce(&force) };
                solid.advance(1e-3, load).unwrap();
            }
            probe.value(solid.displacement(), dimension)[0]
        };
        assert_close(run(true), run(false), 1e-4, "tip");
    }
}

/// Saving, stepping, restoring and stepping again gives the same motion; another load in between leaves no trace.
#[test]
fn a_restored_step_repeats() {
    let mut solid = Solid::new(obstacle(2, [2, 16, 1], None)).unwrap();
    let count = solid.surface().node_count() * 2;
    let push: Vec<f64> = (0..count).map(|i| if i % 2 == 0 { 0.3 } else { 0.0 }).collect();
    let other: Vec<f64> = push.iter().map(|f| -3.0 * f).collect();
    solid.advance(1e-3, Load::NodalForce(&push)).unwrap();
    solid.save();
    solid.advance(1e-3, Load::NodalForce(&push)).unwrap();
    let first = solid.displacement().to_vec();
    solid.restore();
    solid.advance(1e-3, Load::NodalForce(&other)).unwrap();
    solid.restore();
    solid.advance(1e-3, Load::NodalForce(&push)).unwrap();
    // Kept tangents may differ, so the iteration ends elsewhere within its tolerance.
    for (a, b) in first.iter().zip(solid.displacement()) {
        assert!((a - b).abs() < 1e-9 * 1e-3, "{a} {b}");
    }
}

/// A load that crushes elements is refused with the element named, and the state stays as it was.
#[test]
fn a_crushed_body_is_an_error_that_leaves_the_state() {
    let mut solid = Solid::new(obstacle(2, [2, 8, 1], None)).unwrap();
    let count = solid.surface().node_count() * 2;
    let mut seed = 3u64;
    let wild: Vec<f64> = (0..count)
        .map(|_| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            1e9 * ((seed >> 40) as f64 / 16777216.0 - 0.5)
        })
        .collect();
    let error = solid.advance(1e-2, Load::NodalForce(&wild)).unwrap_err();
    let failure = error.into_failure("advance");
    assert_eq!(failure.step, 1);
    assert!(!failure.hint.is_empty());
    assert!(solid.displacement().iter().all(|&u| u == 0.0));
    assert_eq!(solid.advance(1e-3, Load::None).unwrap().newton_iterations, 0);
}

/// Mass-proportional damping a: the amplitude falls as exp(-a t / 2).
#[test]
fn damped_vibration_decays_at_its_rate() {
    let mut scene = obstacle(2, [1, 8, 1], None);
    scene.integrator = Integrator::GeneralisedAlpha { rho_inf: 1.0 };
    let probe = tip_probe(&scene);
    let bent = Solid::new_static(pressed(scene.clone(), 1.0, false), 1).unwrap();
    let damping = 4.0;
    scene.damping = damping;
    let mut solid = Solid::new(scene).unwrap();
    solid.set_motion(bent.displacement(), &vec![0.0; bent.displacement().len()]).unwrap();
    let energy = solid.energies().total();
    let tip = probe.value(solid.displacement(), 2)[0];
    for _ in 0..1000 {
        solid.advance(1e-3, Load::None).unwrap();
    }
    assert!(tip > 0.0);
    let fallen = (solid.energies().total() / energy).ln();
    assert!((fallen + damping).abs() < 0.03 * damping, "{fallen}");
}

/// Stiff and thin: 2 mm of steel, 1 m long, at 10 and at 1000 times the step of its waves. No step may fail, and the
/// mean deflection under a sudden load is the static one.
#[test]
fn a_thin_steel_plate_takes_long_steps() {
    for (dt, steps) in [(1e-4, 200), (1e-2, 100)] {
        let grid = BoxGrid { dimension: 2, minimum: [0.0; 3], maximum: [1.0, 0.002, 0.0], cells: [50, 1, 1] };
        let mut scene = Scene::of_box(grid, 7850.0, 2.1e11, 0.3);
        (scene.clamped, scene.gravity) = (vec!["left".to_owned()], [0.0, -0.1, 0.0]);
        let mut solid = Solid::new(scene).unwrap();
        let count = solid.surface().node_count() * 2;
        let push: Vec<f64> = (0..count).map(|i| if i % 2 == 1 { -0.01 } else { 0.0 }).collect();
        for _ in 0..steps {
            solid.advance(dt, Load::NodalForce(&push)).unwrap();
        }
        assert_eq!(solid.counts().halvings, 0);
        assert!(solid.counts().newton_iterations < 8 * steps, "{:?}", solid.counts());
        assert!(solid.counts().tangents < steps, "{:?}", solid.counts());
    }
}
