//! Obstacles, moving walls, holes, a shaken tank and periodic ends, each against what theory says.

#![expect(clippy::unwrap_used, reason = "a failing helper must fail the test")]

use std::f64::consts::{PI, TAU};

use fluid_isph::Fluid;
use fluid_isph::flow::Flow;
use fluid_isph::obstacle::{Obstacle, Outline};
use fluid_isph::scene::{Face, Opening, Scene, Source, Tank, WallFriction, WaterBox};
use fluid_isph::surface::Surface;
use protocol::case::Prescribed;

fn pool(length: f64, depth: f64, spacing: f64) -> Scene<2> {
    let tank = Tank { min: [0.0; 2], max: [length, 2.0 * depth], open: [[false; 2], [false, true]] };
    let water = WaterBox { min: [0.0; 2], max: [length, depth], velocity: [0.0; 2] };
    Scene::new(tank, vec![water], spacing)
}

fn run<const D: usize>(fluid: &mut Fluid<D>, dt: f64, end: f64) {
    while fluid.time() < end - 0.5 * dt {
        fluid.advance(dt, None).unwrap();
    }
}

/// A submerged box is lifted by the weight of the water it displaces.
#[test]
fn archimedes_lifts_a_submerged_box() {
    let mut scene = pool(0.4, 0.3, 0.01);
    scene.carve = true;
    let outline = Outline::Box { min: [0.14, 0.1], max: [0.26, 0.18] };
    scene.obstacles.push(Obstacle { outline, motion: None });
    let mut fluid = Fluid::new(scene, None).unwrap();
    run(&mut fluid, 1e-3, 0.4);
    let lift = fluid.force_on_obstacles(&[0.0; 2]).force;
    let weight = 1000.0 * 9.81 * 0.12 * 0.08;
    assert!((lift[1] / weight - 1.0).abs() < 0.02, "{lift:?} N/m against {weight}");
    assert!(lift[0].abs() < 0.02 * weight, "{lift:?}");
    assert!(fluid.hydrostatic_error() < 0.01, "{}", fluid.hydrostatic_error());
    assert_eq!(fluid.health().escaped_particles, 0);
}

/// The same box from triangles, in 3-D.
#[test]
fn a_surface_of_triangles_is_lifted_like_its_box() {
    let tank = Tank { min: [0.0; 3], max: [0.32, 0.4, 0.16], open: [[false; 2], [false, true], [false; 2]] };
    let water = WaterBox { min: [0.0; 3], max: [0.32, 0.24, 0.16], velocity: [0.0; 3] };
    let mut scene = Scene::new(tank, vec![water], 0.02);
    let (low, high) = ([0.12, 0.06, 0.0], [0.20, 0.14, 0.16]);
    let corner = |n: usize| std::array::from_fn(|k| if n >> k & 1 == 1 { high[k] } else { low[k] });
    let points: Vec<[f64; 3]> = (0..8).map(corner).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces: Vec<_> = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    let surface = Surface::new(&points, &faces, "box".to_owned()).unwrap();
    scene.obstacles.push(Obstacle { outline: Outline::Surface(surface), motion: None });
    let mut fluid = Fluid::new(scene, None).unwrap();
    run(&mut fluid, 2e-3, 0.2);
    let weight = 1000.0 * 9.81 * 0.08 * 0.08 * 0.16;
    let lift = fluid.force_on_obstacles(&[0.0; 3]).force[1];
    // Four spacings across: 5.6 % low.
    assert!((lift / weight - 1.0).abs() < 0.08, "{lift} N against {weight}");
}

/// A piston that comes in by 0.1 m over 1 s raises the level by the volume it displaces, and does the work that the
/// water gains.
#[test]
fn a_piston_raises_the_level_by_what_it_displaces() {
    let mut scene = pool(1.0, 0.2, 0.02);
    scene.water[0].min[0] = 0.2;
    let outline = Outline::Box { min: [0.1, 0.0], max: [0.2, 0.36] };
    let table = Prescribed::Table { time: vec![0.0, 1.0], displacement: vec![vec![0.0; 2], vec![0.1, 0.0]] };
    scene.obstacles.push(Obstacle { outline, motion: Some(table) });
    let mut fluid = Fluid::new(scene, None).unwrap();
    let (mut samples, mut levels) = (0, 0.0);
    while fluid.time() < 4.0 {
        fluid.advance(2e-3, None).unwrap();
        if fluid.time() > 1.5 {
            levels += fluid.centre()[1] * 2.0;
            samples += 1;
        }
    }
    // Mean height of the centre over some swings; the wave that remains lifts it by less than 1 %.
    let level = levels / f64::from(samples);
    assert!((level / (0.2 * 0.8 / 0.7) - 1.0).abs() < 0.02, "{level}");
    let foremost = fluid.front(0, false);
    assert!((foremost - 0.3).abs() < 0.01, "the water follows the piston: {foremost}");
    let health = fluid.health();
    assert_eq!(health.escaped_particles + health.outflow_particles, 0, "{health:?}");
    assert!(health.energy_error < 0.01, "{health:?}");
    let (_, _, work) = fluid.energy();
    let lifted = 1000.0 * 9.81 * 0.16 * 0.5 * (0.2 * 0.8 / 0.7 - 0.2);
    assert!(work > 0.95 * lifted && work < 1.5 * lifted, "work {work} J/m against {lifted}");
}

/// Water leaves a tank through a hole near its floor at sqrt(2 g h) by Torricelli, and through nothing else.
#[test]
fn water_leaves_through_the_hole() {
    let mut scene = pool(0.4, 0.3, 0.01);
    let face = Face { axis: 0, upper: true };
    scene.openings.push(Opening { face, min: [0.0, 0.0], max: [1.0, 0.05] });
    let mut fluid = Fluid::new(scene, None).unwrap();
    run(&mut fluid, 1e-3, 0.4);
    let health = fluid.health();
    assert_eq!(health.escaped_particles, 0, "{health:?}");
    // 0.4 s of a jet 0.05 m high at sqrt(2 g 0.275) contracted to 0.6, less the start.
    let full = 0.4 * 0.05 * (2.0f64 * 9.81 * 0.275).sqrt() / 1e-4;
    let out = health.outflow_particles as f64;
    assert!(out > 0.35 * full && out < full, "{out} of {full}");
}

/// The tank's frame: a tank accelerated evenly tilts its water by a/g.
#[test]
fn an_accelerated_tank_presses_on_its_rear_wall() {
    let mut scene = pool(0.3, 0.2, 0.01);
    scene.tank.open[1][1] = false;
    scene.tank.max[1] = 0.2;
    // u = a t2/2 with a = 2 m/s2 through two rows far apart is no parabola; a slow sine is one near its trough.
    let omega: f64 = 0.1;
    let amplitude = vec![2.0 / (omega * omega), 0.0];
    scene.gravity.frame = Some(Prescribed::Sine { amplitude, frequency: omega / TAU, phase: -0.5 * PI });
    let mut fluid = Fluid::new(scene, None).unwrap();
    run(&mut fluid, 1e-3, 0.1);
    // The tank is full: p falls from rear (left) to front wall by rho a L.
    let fall = fluid.pressure_at(&[0.0, 0.1]) - fluid.pressure_at(&[0.3, 0.1]);
    assert!((fall / (1000.0 * 2.0 * 0.3) - 1.0).abs() < 0.02, "{fall} Pa");
    let side = |upper| fluid.force_on_face(Face { axis: 0, upper }, &[0.0; 2]).force[0];
    let force = side(true) + side(false);
    assert!((force / (-1000.0 * 2.0 * 0.06) - 1.0).abs() < 0.02, "{force} N/m");
}

/// Between periodic ends still water has no ends, and moving water keeps its speed.
#[test]
fn periodic_ends_are_not_felt() {
    let mut scene = pool(0.2, 0.2, 0.01);
    scene.periodic[0] = true;
    let mut fluid = Fluid::new(scene.clone(), None).unwrap();
    run(&mut fluid, 1e-3, 0.3);
    assert!(fluid.hydrostatic_error() < 0.004, "{}", fluid.hydrostatic_error());
    scene.water[0].velocity = [0.5, 0.0];
    let mut fluid = Fluid::new(scene, None).unwrap();
    let before = fluid.momentum();
    run(&mut fluid, 1e-3, 0.5);
    // Layers that slide along the fixed floor: noisier than at rest, with walls at the ends or without.
    assert!(fluid.hydrostatic_error() < 0.02, "{}", fluid.hydrostatic_error());
    let after = fluid.momentum();
    assert!((after[0] / before[0] - 1.0).abs() < 2e-3, "{before:?} -> {after:?}");
    let odd = fluid.water().velocity.iter().map(|v| (v[0] - 0.5).abs().max(v[1].abs())).fold(0.0, f64::max);
    assert!(odd < 0.1, "{odd} m/s");
    let floor = fluid.force_on_face(Face { axis: 1, upper: false }, &[0.0; 2]).force[1];
    assert!((floor / (-1000.0 * 9.81 * 0.04) - 1.0).abs() < 0.01, "{floor}");
    assert_eq!(fluid.health().escaped_particles, 0);
}

/// Plane Couette flow dies at rough walls and lives between planes of symmetry.
#[test]
fn planes_of_symmetry_do_not_brake() {
    let speed = |symmetric: bool| {
        let tank = Tank { min: [0.0; 2], max: [0.2, 0.1], open: [[false; 2]; 2] };
        let water = WaterBox { min: [0.0; 2], max: [0.2, 0.1], velocity: [0.1, 0.0] };
        let mut scene = Scene::new(tank, vec![water], 0.01);
        scene.gravity.vector = [0.0; 2];
        scene.periodic[0] = true;
        (scene.kinematic_viscosity, scene.friction) = (Some(0.01), WallFriction::NoSlip);
        scene.symmetry[1] = [symmetric; 2];
        let mut fluid = Fluid::new(scene, None).unwrap();
        run(&mut fluid, 1e-3, 0.1);
        fluid.momentum()[0] / 20.0 / 0.1
    };
    // Between rough walls the mean falls as 8/pi2 exp(-nu (pi/h)2 t), h = 0.1 m.
    let theory = 8.0 / (PI * PI) * (-0.01 * (PI / 0.1).powi(2) * 0.1).exp();
    // What is left is the lattice of the walls itself: 4 % over a spacing's way.
    assert!((speed(true) - 1.0).abs() < 0.06, "{}", speed(true));
    assert!((speed(false) - theory).abs() < 0.1, "{} against {theory}", speed(false));
}

/// A drop that comes down just outside the rim has gone over it, not through the wall.
#[test]
fn what_is_past_the_wall_above_its_rim_has_gone_over_it() {
    let tank = Tank { min: [0.0; 2], max: [0.1; 2], open: [[false; 2], [false, true]] };
    // Four particles, above the rim from 0.04 to 0.16 s, and then 4 to 14 mm past the wall.
    let drop = WaterBox { min: [0.06; 2], max: [0.08; 2], velocity: [0.25, 1.0] };
    let mut fluid = Fluid::new(Scene::new(tank, vec![drop], 0.01), None).unwrap();
    run(&mut fluid, 1e-3, 0.3);
    let health = fluid.health();
    assert_eq!((health.outflow_particles, health.escaped_particles), (4, 0));
}

/// Water that falls out below and comes in again above has gained no energy by it.
#[test]
fn coming_in_again_above_is_no_gain_of_energy() {
    let tank = Tank { min: [0.0; 2], max: [0.1; 2], open: [[false; 2]; 2] };
    let water = WaterBox { min: [0.0; 2], max: [0.1; 2], velocity: [0.0; 2] };
    let mut scene = Scene::new(tank, vec![water], 0.01);
    scene.periodic = [true; 2];
    let mut fluid = Fluid::new(scene, None).unwrap();
    // g t2 / 2 = 0.2 m: every particle goes round once or twice.
    run(&mut fluid, 1e-3, 0.2);
    assert!((fluid.momentum()[1] / (-1000.0 * 0.01 * 9.81 * 0.2) - 1.0).abs() < 1e-3);
    assert!(fluid.health().energy_error < 1e-3, "{}", fluid.health().energy_error);
}

/// With images the matrix stays bitwise symmetric and strictly dominant.
#[test]
fn the_matrix_stays_symmetric_across_periodic_ends() {
    let tank = Tank { min: [0.0; 2], max: [0.1; 2], open: [[false; 2]; 2] };
    let water = WaterBox { min: [0.0; 2], max: [0.1; 2], velocity: [0.0; 2] };
    let mut scene = Scene::new(tank, vec![water], 0.01);
    (scene.periodic, scene.jitter) = ([true; 2], Some(0.2));
    let mut fluid = Fluid::new(scene, None).unwrap();
    run(&mut fluid, 1e-3, 2e-3);
    let count = fluid.matrix().len();
    let mut dense = vec![0.0f64; count * count];
    for (number, chunk) in fluid.matrix().chunks.iter().enumerate() {
        for k in 0..chunk.end.len() {
            let (columns, values) = chunk.row(k);
            for (&j, &a) in columns.iter().zip(values) {
                dense[(number * 256 + k) * count + j as usize] += f64::from(a);
            }
        }
    }
    for i in 0..count {
        let row = &dense[i * count..(i + 1) * count];
        let (mut off, full) = (0.0, row[i]);
        for j in (0..count).filter(|&j| j != i) {
            assert!((row[j] - dense[j * count + i]).abs() <= 1e-6 * full, "{i}, {j}");
            off += row[j].abs();
        }
        assert!(full > off, "row {i}: {full} against {off}");
    }
}

/// Taylor-Green vortices at Re = 100 lose speed as exp(-8 pi2 t/Re); from 0.1 s on, when the disturbed start is forgotten.
#[test]
fn taylor_green_vortices_decay() {
    let tank = Tank { min: [0.0; 2], max: [1.0; 2], open: [[false; 2]; 2] };
    let water = WaterBox { min: [0.0; 2], max: [1.0; 2], velocity: [0.0; 2] };
    let mut scene = Scene::new(tank, vec![water], 0.02);
    scene.gravity.vector = [0.0; 2];
    scene.periodic = [true; 2];
    scene.kinematic_viscosity = Some(0.01);
    scene.source = Source::Time(0.05);
    (scene.shifting, scene.jitter) = (Some(10.0), Some(0.2));
    scene.flow = Some(Flow::TaylorGreen { origin: [0.0; 2], speed: 1.0, length: 1.0 });
    let mut fluid = Fluid::new(scene, None).unwrap();
    run(&mut fluid, 2.5e-3, 0.1);
    let (start, ..) = fluid.energy();
    run(&mut fluid, 2.5e-3, 0.6);
    let (end, ..) = fluid.energy();
    let (rate, expected) = ((start / end).ln() / (2.0 * 0.5), 8.0 * PI * PI * 0.01);
    assert!((rate / expected - 1.0).abs() < 0.06, "{rate} against {expected}");
}
