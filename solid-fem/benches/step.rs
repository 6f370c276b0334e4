//! Time and memory of a step of the obstacle under a growing pressure: `cargo bench -p solid-fem`; with a word, only the
//! rows whose name holds it.

use std::time::Instant;

use solid_fem::box_grid::BoxGrid;
use solid_fem::element::{ElementKind, Kinematics};
use solid_fem::load::Load;
use solid_fem::scene::Scene;
use solid_fem::solid::Solid;

/// One row of the table.
struct Row {
    name: &'static str,
    dimension: usize,
    cells: [usize; 3],
    element: ElementKind,
    dt: f64,
    young_modulus: f64,
    kinematics: Kinematics,
}

const SOFT: f64 = 1e6;
const STEEL: f64 = 2.1e11;

fn main() {
    let wanted = std::env::args().skip(1).find(|argument| !argument.starts_with('-'));
    let head =
        ["unknowns", "start ms", "step ms", "newton", "iterations", "tangents", "factors", "memory MB"];
    print!("{:<34}", "obstacle");
    println!("{}", head.map(|word| format!("{word:>11}")).concat());
    for row in rows().into_iter().filter(|row| wanted.as_ref().is_none_or(|word| row.name.contains(word))) {
        measure(&row);
    }
}

fn rows() -> Vec<Row> {
    use ElementKind::{Hex8Eas9, Quad4Eas4, Tet4, Tet10};
    let row = |name, cells, element: ElementKind, dt, young_modulus| Row {
        name,
        dimension: element.dimension(),
        cells,
        element,
        dt,
        young_modulus,
        kinematics: Kinematics::TotalLagrangian,
    };
    vec![
        row("quad4_eas4 1x16, dt 2.5e-4", [1, 16, 1], Quad4Eas4, 2.5e-4, SOFT),
        row("hex8_eas9 1x4x6, dt 2.5e-4", [1, 4, 6], Hex8Eas9, 2.5e-4, SOFT),
        row("tet10 1x4x6, dt 2.5e-4", [1, 4, 6], Tet10, 2.5e-4, SOFT),
        row("hex8_eas9 3x20x73, dt 1e-4", [3, 20, 73], Hex8Eas9, 1e-4, SOFT),
        row("tet4 3x20x73 (paper), dt 1e-4", [3, 20, 73], Tet4, 1e-4, SOFT),
        row("tet4 3x20x73, dt 1e-3", [3, 20, 73], Tet4, 1e-3, SOFT),
        row("tet4 3x20x73, steel, dt 1e-3", [3, 20, 73], Tet4, 1e-3, STEEL),
        Row {
            kinematics: Kinematics::Linear,
            ..row("tet4 3x20x73, steel, linear, dt 1e-3", [3, 20, 73], Tet4, 1e-3, STEEL)
        },
        row("hex8_eas9 8x48x150 (200k), dt 1e-4", [8, 48, 150], Hex8Eas9, 1e-4, SOFT),
        row("hex8_eas9 14x86x250 (1M), dt 1e-4", [14, 86, 250], Hex8Eas9, 1e-4, SOFT),
    ]
}

fn measure(row: &Row) {
    let Row { dimension, cells, dt, .. } = *row;
    let grid = BoxGrid { dimension, minimum: [0.0; 3], maximum: [0.012, 0.08, 0.292], cells };
    let mut scene = Scene::of_box(grid, 2500.0, row.young_modulus, 0.0);
    scene.element = row.element;
    scene.substance.kinematics = row.kinematics;
    let start = Instant::now();
    let mut solid = Solid::in_reference(scene).expect("the obstacle is no nonsense");
    let start_ms = 1e3 * start.elapsed().as_secs_f64();
    let total = 100.0 * 0.08 * if dimension == 3 { 0.292 } else { 1.0 };
    let count = solid.surface().node_count();
    let mut force = vec![0.0; count * dimension];
    let unknowns = solid.displacement().len();
    let steps = if unknowns > 100_000 {
        5
    } else if unknowns > 3000 {
        40
    } else {
        600
    };
    let start = Instant::now();
    for step in 1..=steps {
        // Grows and trembles, as water does.
        let now = total / count as f64 * (1.0 + 0.1 * f64::from(step % 7)) * f64::from(step) / 100.0;
        force.iter_mut().step_by(dimension).for_each(|force| *force = now);
        solid.advance(dt, Load::NodalForce(&force)).expect("the obstacle bends");
    }
    let step_ms = 1e3 * start.elapsed().as_secs_f64() / f64::from(steps);
    let counts = solid.counts();
    let per_step = |count: u64| count as f64 / f64::from(steps);
    println!(
        "{:<34}{unknowns:>11}{start_ms:>11.1}{step_ms:>11.3}{:>11.2}{:>11.1}{:>11}{:>11}{:>11.0}",
        row.name,
        per_step(counts.newton_iterations),
        per_step(counts.linear_iterations),
        counts.tangents,
        counts.factorizations,
        resident_mb()
    );
}

/// Memory of the process now, MB; all rows before have given theirs back, as far as the allocator does.
fn resident_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmRSS")).unwrap_or_default();
    line.split_whitespace().nth(1).and_then(|number| number.parse::<f64>().ok()).unwrap_or_default() / 1024.0
}
