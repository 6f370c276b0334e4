//! Properties the method must have whatever the scene: symmetry, balance, invariance, repeatability.

#![expect(clippy::unwrap_used, reason = "a failing helper must fail the test")]

mod common;

use common::{at_rest, floor_plate, upright_plate};
use fluid_isph::scene::{Scene, Source, Tank, WaterBox};
use fluid_isph::{Fluid, Structure};
use proptest::prelude::*;
use protocol::interface::Response;

fn dam<const D: usize>(spacing: f64, at: f64) -> Scene<D> {
    let mut tank = Tank { min: [at; D], max: [at + 0.4; D], open: [[false; 2]; D] };
    let mut water = WaterBox { min: [at; D], max: [at + 0.2; D], velocity: [0.0; D] };
    if D == 3 {
        (tank.max[D - 1], water.max[D - 1]) = (at + 0.1, at + 0.1);
    }
    tank.open[1][1] = true;
    Scene::new(tank, vec![water], spacing)
}

fn run<const D: usize>(scene: Scene<D>, steps: usize) -> Fluid<D> {
    let mut fluid = Fluid::new(scene, None).unwrap();
    for _ in 0..steps {
        fluid.advance(1e-3, None).unwrap();
    }
    fluid
}

/// Entries of the matrix as (row, column, value).
fn entries<const D: usize>(fluid: &Fluid<D>) -> Vec<(u32, u32, f32)> {
    let mut all = Vec::new();
    let mut row = 0;
    for chunk in &fluid.matrix().chunks {
        for k in 0..chunk.end.len() {
            let (columns, values) = chunk.row(k);
            all.extend(columns.iter().zip(values).map(|(&j, &a)| (row, j, a)));
            row += 1;
        }
    }
    all
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Bitwise symmetric and strictly dominant, hence positive definite, on lattices disturbed by up to 0.3 spacings.
    #[test]
    fn the_pressure_matrix_is_symmetric_positive_definite(jitter in 0.0..0.3f64, steps in 1usize..4) {
        let mut scene = dam::<2>(0.02, 0.0);
        scene.jitter = Some(jitter);
        let fluid = run(scene, steps);
        let entries = entries(&fluid);
        let known: std::collections::HashMap<_, _> = entries.iter().map(|&(i, j, a)| ((i, j), a)).collect();
        let mut excess = vec![0.0; fluid.matrix().len()];
        for &(i, j, a) in &entries {
            prop_assert_eq!(known.get(&(j, i)).copied().unwrap_or(0.0).to_bits(), a.to_bits());
            excess[i as usize] += if i == j { f64::from(a) } else { -f64::from(a).abs() };
        }
        prop_assert!(excess.iter().all(|&excess| excess > 0.0));
    }
}

/// Without walls, gravity and bodies the momentum of the water stays what it is to round-off.
#[test]
fn momentum_is_conserved() {
    let tank = Tank { min: [-1.0; 2], max: [1.0; 2], open: [[true; 2]; 2] };
    let boxes = [([-0.2, 0.0], [0.0, 0.2], [1.0, 0.3]), ([0.02, 0.1], [0.2, 0.2], [-2.0, 0.0])];
    let water = boxes.map(|(min, max, velocity)| WaterBox { min, max, velocity });
    let mut scene = Scene::new(tank, water.to_vec(), 0.02);
    scene.gravity.vector = [0.0; 2];
    let mut fluid = Fluid::new(scene, None).unwrap();
    let before = fluid.momentum();
    for _ in 0..50 {
        fluid.advance(1e-3, None).unwrap();
    }
    let after = fluid.momentum();
    assert!(fluid.water().pressure.iter().any(|&p| p > 100.0), "the boxes must collide");
    for k in 0..2 {
        assert!((after[k] - before[k]).abs() < 1e-11 * 40.0, "{before:?} -> {after:?}");
    }
}

/// What the water loses in momentum is what the body gets: pair forces, ghosts and guard impulses together.
#[test]
fn action_is_reaction_on_a_body() {
    let tank = Tank { min: [-1.0, -0.5], max: [1.0, 1.0], open: [[true; 2]; 2] };
    let water = WaterBox { min: [-0.22, 0.0], max: [-0.02, 0.2], velocity: [2.0, 0.0] };
    let mut scene = Scene::new(tank, vec![water], 0.02);
    scene.gravity.vector = [0.0; 2];
    let mesh = upright_plate((0.0, 0.04, 0.3), 6, Response::Given);
    let mut fluid = Fluid::new(scene, Some(&Structure::Mesh(mesh.clone()))).unwrap();
    let still = vec![0.0; mesh.reference_position.len()];
    let dt = 5e-4;
    let mut largest = 0.0f64;
    for _ in 0..120 {
        let before = fluid.momentum();
        let motion = at_rest(&mesh.reference_position, &still);
        fluid.advance(dt, Some(motion)).unwrap();
        let after = fluid.momentum();
        for k in 0..2 {
            let force: f64 = fluid.pair_force().iter().skip(k).step_by(2).sum();
            let error = (after[k] - before[k] + force * dt).abs();
            assert!(error < 1e-5 * 40.0 * 2.0 * 0.1, "component {k}: {error}");
            largest = largest.max(force.abs());
        }
    }
    assert!(largest > 100.0, "the water must hit the plate: {largest} N/m");
}

/// A scene moved as a whole gives the same motion, moved as a whole.
#[test]
fn results_do_not_depend_on_the_origin() {
    let here = run(dam::<2>(0.02, 0.0), 10);
    let there = run(dam::<2>(0.02, 4.0), 10);
    let sorted = |fluid: &Fluid<2>, shift: f64| {
        let water = fluid.water();
        let mut all: Vec<_> =
            water.id.iter().zip(&water.position).map(|(&id, x)| (id, x.map(|x| x - shift))).collect();
        all.sort_by_key(|particle| particle.0);
        all
    };
    for (a, b) in sorted(&here, 0.0).iter().zip(&sorted(&there, 4.0)) {
        for k in 0..2 {
            assert!((a.1[k] - b.1[k]).abs() < 1e-3 * 0.02, "{a:?} {b:?}");
        }
    }
}

fn in_pool<const D: usize>(threads: usize, scene: &Scene<D>) -> Vec<u64> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let fluid = pool.install(|| run(scene.clone(), 25));
    let water = fluid.water();
    let positions = water.position.iter().flatten().map(|x| x.to_bits());
    positions.chain(water.pressure.iter().map(|p| u64::from(p.to_bits()))).collect()
}

#[test]
fn threads_do_not_change_a_bit() {
    let mut plane = dam::<2>(0.004, 0.0);
    plane.kinematic_viscosity = Some(1e-6);
    plane.smagorinsky = Some(0.15);
    let space = dam::<3>(0.0125, 0.0);
    let (one, solid) = (in_pool(1, &plane), in_pool(1, &space));
    for threads in [2, 4] {
        assert_eq!(one, in_pool(threads, &plane));
        assert_eq!(solid, in_pool(threads, &space));
    }
}

/// A closed tank full of water has no free surface: pressure only up to a constant, no clamp.
#[test]
fn a_full_tank_has_no_level_and_stays_finite() {
    let tank = Tank { min: [0.0; 2], max: [0.2; 2], open: [[false; 2]; 2] };
    let water = WaterBox { min: [0.0; 2], max: [0.2; 2], velocity: [0.0; 2] };
    let mut scene = Scene::new(tank, vec![water], 0.01);
    // The linear field is the smoothest there is: at 1e-3 its residual is small while it is still 4 % off.
    scene.pressure_tolerance = 1e-4;
    let mut fluid = Fluid::new(scene, None).unwrap();
    for _ in 0..100 {
        fluid.advance(1e-3, None).unwrap();
    }
    assert!(fluid.health().max_speed < 0.05, "{:?}", fluid.health());
    // Pressure is known up to a constant: its difference over the height is hydrostatic.
    let rise = fluid.pressure_at(&[0.1, 0.02]) - fluid.pressure_at(&[0.1, 0.18]);
    assert!((rise / (9810.0 * 0.16) - 1.0).abs() < 0.02, "{rise}");
}

/// A single particle and no water at all are no reason to fail.
#[test]
fn degenerate_water_is_survived() {
    let tank = Tank { min: [0.0; 2], max: [0.2; 2], open: [[false; 2]; 2] };
    let single = WaterBox { min: [0.1, 0.1], max: [0.11, 0.11], velocity: [0.0; 2] };
    let mut fluid = Fluid::new(Scene::new(tank.clone(), vec![single], 0.01), None).unwrap();
    for _ in 0..300 {
        fluid.advance(1e-3, None).unwrap();
    }
    assert_eq!(fluid.water().len(), 1);
    let dry = Scene::new(tank, Vec::new(), 0.01);
    let mut fluid = Fluid::new(dry, None).unwrap();
    fluid.advance(1e-3, None).unwrap();
    assert!(fluid.water().is_empty());
}

/// Divergence-free, density-invariance, alpha and time forms all run and keep a resting tank at rest.
#[test]
fn every_source_term_keeps_still_water_still() {
    for source in [Source::DivergenceFree, Source::DensityInvariance, Source::Alpha(0.1), Source::Time(0.005)]
    {
        let tank = Tank { min: [0.0; 2], max: [0.2, 0.3], open: [[false; 2], [false, true]] };
        let water = WaterBox { min: [0.0; 2], max: [0.2, 0.2], velocity: [0.0; 2] };
        let mut scene = Scene::new(tank, vec![water], 0.01);
        scene.source = source;
        let mut fluid = Fluid::new(scene, None).unwrap();
        for _ in 0..200 {
            fluid.advance(5e-4, None).unwrap();
        }
        let floor = fluid.pressure_at(&[0.1, 0.0]);
        assert!((floor / 1962.0 - 1.0).abs() < 0.02, "{source:?}: {floor}");
        assert!(fluid.health().max_speed < 0.2, "{source:?}: {:?}", fluid.health());
    }
}

/// A plate that fills the floor of a 3-D column carries the whole weight, ghost rows included, evenly along its depth.
#[test]
fn ghost_rows_carry_the_load_to_the_edge() {
    let tank =
        Tank { min: [0.0, -0.1, 0.0], max: [0.2, 0.3, 0.1], open: [[false; 2], [true; 2], [false; 2]] };
    let water = WaterBox { min: [0.0; 3], max: [0.2, 0.1, 0.1], velocity: [0.0; 3] };
    let mesh = floor_plate((0.2, 0.04, Some(0.1)), 4, (Response::Given, 1.0));
    let structure = Structure::Mesh(mesh.clone());
    let mut fluid = Fluid::new(Scene::new(tank, vec![water], 0.01), Some(&structure)).unwrap();
    let still = vec![0.0; mesh.reference_position.len()];
    for _ in 0..40 {
        let motion = at_rest(&mesh.reference_position, &still);
        fluid.advance(1e-3, Some(motion)).unwrap();
    }
    let load: f64 = fluid.pair_force().iter().skip(1).step_by(3).sum();
    let weight = 9810.0 * 0.2 * 0.1 * 0.1;
    assert!((load / -weight - 1.0).abs() < 0.01, "{load} N of {weight} N");
    assert_eq!(fluid.health().guard_hits, 0);
}
