//! What a scene does not need holds no memory: the bytes of every column a term brings with it, with the term and without.

use protocol::case::Prescribed;

use crate::fluid::Fluid;
use crate::obstacle::{Obstacle, Outline};
use crate::scene::{Scene, Tank, WaterBox};

/// Bytes of a column, unused room included.
fn bytes<T>(column: &Vec<T>) -> usize {
    column.capacity() * size_of::<T>()
}

/// Bytes of the columns that belong to one term each.
fn held<const D: usize>(fluid: &Fluid<D>) -> [(&'static str, usize); 6] {
    let viscosity = fluid.viscosity.as_ref().map_or(0, |term| bytes(&term.acceleration));
    let turbulence = fluid.turbulence.as_ref().map_or(0, |term| bytes(&term.eddy_viscosity));
    let shifting = fluid.shifting.as_ref().map_or(0, |term| bytes(&term.sums));
    let body = fluid.body.as_ref().map_or(0, |body| bytes(&body.load));
    let loads = bytes(&fluid.marker_pressure) + bytes(&fluid.pair_force) + bytes(&fluid.moments.robin);
    let obstacles = fluid.walls.obstacles().len();
    [
        ("viscosity", viscosity),
        ("turbulence", turbulence),
        ("shifting", shifting),
        ("body", body),
        ("loads", loads),
        ("obstacles", obstacles),
    ]
}

fn scene<const D: usize>() -> Scene<D> {
    let tank = Tank { min: [0.0; D], max: [0.12; D], open: [[false; 2]; D] };
    let mut max = [0.12; D];
    max[0] = 0.06;
    Scene::new(tank, vec![WaterBox { min: [0.0; D], max, velocity: [0.0; D] }], 0.01)
}

fn run<const D: usize>(scene: Scene<D>) -> Fluid<D> {
    let mut fluid = Fluid::new(scene, None).unwrap();
    for _ in 0..3 {
        fluid.advance(1e-3, None).unwrap();
    }
    fluid
}

/// The names of what is held, and of the phases that were run.
fn seen<const D: usize>(scene: Scene<D>) -> (Vec<&'static str>, Vec<String>) {
    let fluid = run(scene);
    let held = held(&fluid).into_iter().filter(|(_, bytes)| *bytes > 0).map(|(name, _)| name);
    (held.collect(), fluid.phases().into_iter().map(|phase| phase.name).collect())
}

#[test]
fn each_term_brings_its_own_columns_and_phases_only() {
    let bare = seen(scene::<2>());
    assert_eq!(bare.0, [""; 0]);
    for absent in ["viscosity", "eddy viscosity", "shift", "images", "place obstacles", "place body", "load"]
    {
        assert!(!bare.1.iter().any(|name| name == absent), "{absent} in {:?}", bare.1);
    }
    let obstacle = || Obstacle {
        outline: Outline::Box { min: [0.09, 0.0], max: [0.12, 0.03] },
        motion: Some(Prescribed::Sine { amplitude: vec![0.001, 0.0], frequency: 1.0, phase: 0.0 }),
    };
    let with = |change: &dyn Fn(&mut Scene<2>)| {
        let mut scene = scene();
        change(&mut scene);
        seen(scene)
    };
    let cases = [
        (with(&|scene| scene.kinematic_viscosity = Some(1e-6)), vec!["viscosity"], vec!["viscosity"]),
        (
            with(&|scene| scene.smagorinsky = Some(0.12)),
            vec!["viscosity", "turbulence"],
            vec!["eddy viscosity", "viscosity"],
        ),
        (with(&|scene| scene.shifting = Some(2.0)), vec!["shifting"], vec!["shift"]),
        (
            with(&|scene| scene.obstacles = vec![obstacle()]),
            vec!["obstacles"],
            vec!["place obstacles", "obstacle load"],
        ),
    ];
    for ((held, phases), expected, expected_phases) in cases {
        assert_eq!(held, expected);
        let more: Vec<_> = phases.iter().filter(|phase| !bare.1.contains(phase)).collect();
        assert_eq!(more, expected_phases);
        assert_eq!(phases.len(), bare.1.len() + more.len(), "the others are all there");
    }
}

#[test]
fn two_dimensions_pay_for_two() {
    let entries = |count: usize, entries: usize| entries as f64 / count as f64;
    let (plane, space) = (run(scene::<2>()), run(scene::<3>()));
    // The lattice within 2.4 spacings: 20 and 56 neighbours, and the particle itself.
    assert!(entries(plane.water().len(), plane.matrix().entry_count()) <= 21.0);
    assert!(entries(space.water().len(), space.matrix().entry_count()) > 30.0);
    assert_eq!(size_of_val(&plane.water().position[0]), 16);
}
