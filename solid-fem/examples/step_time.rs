//! Time of a step of the obstacle under a growing pressure: `cargo run --release -p solid-fem --example step_time`.

use std::time::Instant;

use solid_fem::box_grid::BoxGrid;
use solid_fem::element::ElementKind;
use solid_fem::load::Load;
use solid_fem::scene::Scene;
use solid_fem::solid::Solid;

fn main() {
    println!(
        "{:<10} {:>12} {:>8} {:>10} {:>10} {:>8} {:>9}",
        "element", "cells", "dt s", "static ms", "step ms", "newton", "tangents"
    );
    for (dimension, cells, element, dt) in [
        (2, [1, 16, 1], ElementKind::Quad4Eas4, 2.5e-4),
        (2, [2, 16, 1], ElementKind::Quad4Eas4, 2.5e-4),
        (3, [1, 8, 6], ElementKind::Hex8Eas9, 2.5e-4),
        (3, [1, 8, 24], ElementKind::Hex8Eas9, 2.5e-4),
        (3, [3, 20, 73], ElementKind::Hex8Eas9, 1e-4),
        (3, [3, 20, 73], ElementKind::Tet4, 1e-4),
    ] {
        measure(dimension, cells, element, dt);
    }
}

fn measure(dimension: usize, cells: [usize; 3], element: ElementKind, dt: f64) {
    let grid = BoxGrid { dimension, minimum: [0.0; 3], maximum: [0.012, 0.08, 0.292], cells };
    let mut scene = Scene::of_box(grid, 2500.0, 1e6, 0.0);
    (scene.element, scene.gravity) = (element, [0.0, -9.81, 0.0]);
    let start = Instant::now();
    let mut solid = Solid::new(scene).expect("the obstacle carries its weight");
    let static_ms = 1e3 * start.elapsed().as_secs_f64();
    let total = 100.0 * 0.08 * if dimension == 3 { 0.292 } else { 1.0 };
    let count = solid.surface().node_count();
    let mut force = vec![0.0; count * dimension];
    let steps = if count > 1000 { 40 } else { 600 };
    let start = Instant::now();
    for step in 0..steps {
        // Grows and trembles, as water does.
        let now = total / count as f64 * (1.0 + 0.1 * f64::from(step % 7)) * f64::from(step) / 100.0;
        force.iter_mut().step_by(dimension).for_each(|force| *force = now);
        solid.advance(dt, Load::NodalForce(&force)).expect("the obstacle bends");
    }
    let step_ms = 1e3 * start.elapsed().as_secs_f64() / f64::from(steps);
    let counts = solid.counts();
    let name = format!("{}x{}x{}", cells[0], cells[1], if dimension == 3 { cells[2] } else { 0 });
    println!(
        "{:<10} {name:>12} {dt:>8.1e} {static_ms:>10.2} {step_ms:>10.3} {:>8.2} {:>9}",
        element.name(),
        counts.newton_iterations as f64 / f64::from(steps),
        counts.tangents
    );
    for phase in solid.phases() {
        println!("    {:<18} {:>8} calls {:>9.3} ms", phase.name, phase.calls, 1e3 * phase.wall_s);
    }
}
