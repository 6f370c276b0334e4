//! Scenes shared by the tests.
#![allow(dead_code, reason = "each test program uses its own part")]
#![allow(clippy::unwrap_used, reason = "tests")]

use solid_fem::box_grid::BoxGrid;
use solid_fem::element::ElementKind;
use solid_fem::probe::Probe;
use solid_fem::scene::{FaceLoad, FaceLoadKind, Scene};
use solid_fem::solid::Solid;

/// The paper's obstacle: 12 mm thick, 80 mm high, 292 mm deep, E 1e6 Pa, rho 2500 kg/m3, nu 0.
pub(crate) fn obstacle(dimension: usize, cells: [usize; 3], element: Option<ElementKind>) -> Scene {
    let grid = BoxGrid { dimension, minimum: [0.0; 3], maximum: [0.012, 0.08, 0.292], cells };
    let mut scene = Scene::of_box(grid, 2500.0, 1e6, 0.0);
    scene.element = element.unwrap_or(scene.element);
    scene
}

/// The scene with a pressure on its left face.
pub(crate) fn pressed(mut scene: Scene, pressure: f64, is_follower: bool) -> Scene {
    let kind = if is_follower {
        FaceLoadKind::FollowerPressure(pressure)
    } else {
        FaceLoadKind::DeadPressure(pressure)
    };
    scene.loads = vec![FaceLoad { face: "left".to_owned(), kind, table: Vec::new() }];
    scene
}

/// Probe in the middle of the depth at the top of the left face.
pub(crate) fn tip_probe(scene: &Scene) -> Probe {
    let (low, high) = scene.bounding_box();
    Probe::at(&scene.mesh(), &[low[0], high[1], 0.5 * (low[2] + high[2])]).unwrap()
}

/// Static displacement of the tip, m.
pub(crate) fn static_tip(scene: Scene, load_steps: u32) -> [f64; 3] {
    let probe = tip_probe(&scene);
    let dimension = scene.dimension();
    let solid = Solid::new_static(scene, load_steps).unwrap();
    probe.value(solid.displacement(), dimension)
}

/// Fails unless `value` is within a relative tolerance of `expected`.
pub(crate) fn assert_close(value: f64, expected: f64, tolerance: f64, what: &str) {
    let error = value / expected - 1.0;
    assert!(
        error.abs() <= tolerance,
        "{what}: {value:e}, expected {expected:e}, error {:.3} %",
        100.0 * error
    );
}
