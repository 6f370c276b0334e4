//! The schemes the paper names beside the default ones, on scenes with a known answer.

#![expect(clippy::unwrap_used, reason = "a failing helper must fail the test")]

use fluid_isph::Fluid;
use fluid_isph::scene::{Face, PressureSolver, Scene, Source, Tank, WaterBox};
use fluid_isph::weakly_compressible::Explicit;

fn still_water() -> Scene<2> {
    let tank = Tank { min: [0.0; 2], max: [0.2, 0.3], open: [[false; 2], [false, true]] };
    let water = WaterBox { min: [0.0; 2], max: [0.2, 0.2], velocity: [0.0; 2] };
    Scene::new(tank, vec![water], 0.01)
}

fn dam() -> Scene<2> {
    let tank = Tank { min: [0.0; 2], max: [0.584, 0.6], open: [[false; 2], [false, true]] };
    let water = WaterBox { min: [0.0; 2], max: [0.146, 0.292], velocity: [0.0; 2] };
    Scene::new(tank, vec![water], 0.146 / 16.0)
}

fn run(scene: Scene<2>, dt: f64, end: f64) -> Fluid<2> {
    let mut fluid = Fluid::new(scene, None).unwrap();
    while fluid.time() < end - 0.5 * dt {
        fluid.advance(dt, None).unwrap();
    }
    fluid
}

/// Both preconditioners solve the same equation; the factors take more iterations, and fewer than 60.
#[test]
fn incomplete_cholesky_solves_what_multigrid_solves() {
    let solve = |solver| {
        let mut scene = dam();
        (scene.solver, scene.pressure_tolerance) = (solver, 1e-5);
        run(scene, 5e-4, 0.05)
    };
    let (multigrid, factors) = (solve(PressureSolver::Multigrid), solve(PressureSolver::IncompleteCholesky));
    assert!((multigrid.front(0, true) - factors.front(0, true)).abs() < 1e-4);
    let largest = multigrid.water().pressure.iter().copied().fold(0.0, f32::max);
    let of_id = |fluid: &Fluid<2>| {
        let mut by_id = vec![0.0; fluid.water().len()];
        for (&id, &p) in fluid.water().id.iter().zip(&fluid.water().pressure) {
            by_id[id as usize] = p;
        }
        by_id
    };
    for (a, b) in of_id(&multigrid).iter().zip(of_id(&factors)) {
        assert!((a - b).abs() < 0.02 * largest, "{a} and {b} Pa");
    }
    let iterations = factors.health().mean_pressure_iterations;
    assert!((2.0..60.0).contains(&iterations), "{iterations}");
    assert!(factors.phases().iter().any(|phase| phase.name == "precondition"));
}

/// (6), (8) and (9) at the paper's alpha all hold still water.
#[test]
fn every_source_term_holds_still_water() {
    let sources =
        [Source::DivergenceFree, Source::DensityInvariance, Source::Alpha(0.1), Source::Alpha(0.01)];
    for source in sources {
        let mut scene = still_water();
        scene.source = source;
        let fluid = run(scene, 5e-4, 0.3);
        assert!(fluid.hydrostatic_error() < 0.02, "{source:?}: {}", fluid.hydrostatic_error());
        assert_eq!(fluid.health().escaped_particles, 0, "{source:?}");
    }
}

/// The explicit scheme holds still water and has neither a system nor a preconditioner.
#[test]
fn the_explicit_scheme_holds_still_water() {
    let mut scene = still_water();
    scene.explicit = Some(Explicit { sound_speed: 20.0, artificial_viscosity: 0.1 });
    let fluid = run(scene, 5e-4, 0.5);
    assert!(fluid.hydrostatic_error() < 0.05, "{}", fluid.hydrostatic_error());
    let floor = fluid.force_on_face(Face { axis: 1, upper: false }, &[0.0; 2]).force[1];
    assert!((floor / -392.4 - 1.0).abs() < 0.05, "{floor} N/m");
    let (kinetic, ..) = fluid.energy();
    assert!(kinetic < 1e-3 * 40.0 * 9.81 * 0.2, "{kinetic} J/m");
    let names: Vec<_> = fluid.phases().iter().map(|phase| phase.name.clone()).collect();
    assert!(!names.iter().any(|name| name == "solve" || name == "precondition"), "{names:?}");
    assert!(names.iter().any(|name| name == "density"), "{names:?}");
}

/// Its dam break follows the projection's front.
#[test]
fn the_explicit_front_follows_the_projected_one() {
    let mut scene = dam();
    scene.explicit = Some(Explicit { sound_speed: 24.0, artificial_viscosity: 0.02 });
    let (explicit, projected) = (run(scene, 5e-4, 0.2), run(dam(), 5e-4, 0.2));
    let fronts = [&explicit, &projected].map(|fluid| fluid.front(0, true) / 0.146);
    assert!((fronts[0] - fronts[1]).abs() < 0.15, "{fronts:?} a");
    assert_eq!(explicit.health().escaped_particles, 0);
}
