//! What one step of the fluid costs: the dam break of the paper without its obstacle, phase by phase.
//!
//! ```text
//! cargo bench -p fluid-isph --bench step -- [plane|100k|461k|2m ...] [--threads 1,2] [--steps 10]
//! ```
//!
//! Every scene runs in a process of its own, so that its largest memory is its own. Times are medians over the steps;
//! the least is what a quiet machine would give.

use std::process::Command;
use std::time::Instant;

use fluid_isph::Fluid;
use fluid_isph::pressure::matrix::PressureMatrix;
use fluid_isph::scene::{Scene, Tank, WaterBox};
use protocol::usage::{cpu_seconds, peak_rss_bytes};
use rayon::prelude::*;

/// Steps before the clock starts: pressure and buffers settle.
const WARM_UP: usize = 4;

/// Time step over spacing, s/m: 0.25 ms at 3 mm.
const STEP_PER_SPACING: f64 = 1.0 / 12.0;

/// Name, dimension and spacing (m) of the scenes.
const SCENES: [(&str, usize, f64); 4] =
    [("plane", 2, 0.001), ("100k", 3, 0.005), ("461k", 3, 0.003), ("2m", 3, 0.00184)];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let after = |name: &str| {
        let at = arguments.iter().position(|argument| argument == name)?;
        arguments.get(at + 1)
    };
    let steps = after("--steps").map_or(10, |text| text.parse().expect("--steps takes a number"));
    let threads = after("--threads").map_or("1,2", String::as_str);
    let counts: Vec<usize> =
        threads.split(',').map(|text| text.parse().expect("--threads takes numbers")).collect();
    if let Some(name) = after("--in-this-process") {
        let scene = SCENES.iter().find(|scene| scene.0 == name).expect("a name from the list");
        return measure(scene, counts[0], steps);
    }
    let asked = |scene: &(&str, usize, f64)| arguments.iter().any(|argument| argument == scene.0);
    let all = !SCENES.iter().any(asked);
    for scene in SCENES.iter().filter(|scene| all || asked(scene)) {
        for count in &counts {
            let mut one = Command::new(std::env::current_exe().expect("a running program has a path"));
            one.args(["--in-this-process", scene.0, "--threads", &count.to_string()]);
            one.args(["--steps", &steps.to_string()]);
            assert!(one.status().expect("this program starts again").success());
        }
    }
}

fn measure(&(name, dimension, spacing): &(&str, usize, f64), threads: usize, steps: usize) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
    println!("\n## {name}, {:.2} mm, threads: {threads}", 1e3 * spacing);
    pool.install(|| match dimension {
        2 => measure_scene(dam_break([0.584, 0.6], [0.146, 0.292], spacing), steps),
        _ => measure_scene(dam_break([0.584, 0.6, 0.292], [0.146, 0.292, 0.292], spacing), steps),
    });
}

/// Water at the left wall of a closed tank.
fn dam_break<const D: usize>(tank: [f64; D], water: [f64; D], spacing: f64) -> Scene<D> {
    let tank = Tank { min: [0.0; D], max: tank, open: [[false; 2]; D] };
    let column = WaterBox { min: [0.0; D], max: water, velocity: [0.0; D] };
    Scene { kinematic_viscosity: Some(1e-6), ..Scene::new(tank, vec![column], spacing) }
}

/// One step as measured: wall time of each phase, of all, and CPU time, s.
struct Sample {
    phases: Vec<f64>,
    wall: f64,
    cpu: f64,
}

fn measure_scene<const D: usize>(scene: Scene<D>, steps: usize) {
    let before = peak_rss_bytes();
    let mut fluid = Fluid::new(scene, None).expect("the scene is a good one");
    let (water, walls) = (fluid.water().len(), fluid.walls().len());
    let dt = STEP_PER_SPACING * fluid.spacing();
    for _ in 0..WARM_UP {
        fluid.advance(dt, None).expect("water at rest can be advanced");
    }
    let booked = |fluid: &Fluid<D>| fluid.phases().iter().map(|phase| phase.wall_s).collect::<Vec<_>>();
    let iterations = |fluid: &Fluid<D>| {
        let health = fluid.health();
        health.mean_pressure_iterations * health.substeps as f64
    };
    let first_iterations = iterations(&fluid);
    let samples: Vec<Sample> = (0..steps)
        .map(|_| {
            let (phases, cpu, clock) = (booked(&fluid), cpu_seconds(), Instant::now());
            fluid.advance(dt, None).expect("water at rest can be advanced");
            let (wall, cpu) = (clock.elapsed().as_secs_f64(), cpu_seconds() - cpu);
            let phases = booked(&fluid).iter().zip(phases).map(|(after, before)| after - before).collect();
            Sample { phases, wall, cpu }
        })
        .collect();
    println!("{water} water and {walls} wall particles, dt {:.3} ms, {steps} steps", 1e3 * dt);
    println!("| phase | median ms | least ms |\n|---|---|---|");
    let row = |name: &str, times: Vec<f64>| {
        let (middle, least) = (median(times.clone()), times.iter().copied().fold(f64::INFINITY, f64::min));
        println!("| {name} | {:.2} | {:.2} |", 1e3 * middle, 1e3 * least);
        (middle, least)
    };
    for (k, phase) in fluid.phases().iter().enumerate() {
        row(&phase.name, samples.iter().map(|sample| sample.phases[k]).collect());
    }
    let (middle, least) = row("whole step", samples.iter().map(|sample| sample.wall).collect());
    row("CPU time", samples.iter().map(|sample| sample.cpu).collect());
    let per_particle = |seconds: f64| 1e6 * seconds / water as f64;
    println!("{:.3} us per particle-step (least {:.3})", per_particle(middle), per_particle(least));
    println!("{:.1} iterations a step", (iterations(&fluid) - first_iterations) / steps as f64);
    let memory = peak_rss_bytes();
    let bytes = (memory - before) as f64 / water as f64;
    println!("{} MB at most, {bytes:.0} bytes per water particle", memory / 1_000_000);
    measure_product(fluid.matrix());
}

/// Time of a matrix product against the time its bytes take.
fn measure_product(matrix: &PressureMatrix) {
    let count = matrix.len();
    let (x, mut y) = (vec![1.0; count], vec![0.0; count]);
    let mut partial = vec![0.0; count];
    let seconds = least_of(10, || {
        std::hint::black_box(matrix.multiply(&x, &mut y, &mut partial));
    });
    let (bytes, bandwidth) = (matrix.product_bytes() as f64, read_bandwidth());
    println!(
        "matrix product {:.2} ms, {:.1} entries a row, {:.0} bytes a row: {:.1} GB/s of the {:.1} GB/s read from memory",
        1e3 * seconds,
        matrix.entry_count() as f64 / count as f64,
        bytes / count as f64,
        1e-9 * bytes / seconds,
        1e-9 * bandwidth
    );
}

/// Bytes a second all threads of the pool together read from memory.
fn read_bandwidth() -> f64 {
    let column = vec![1.0f32; 64 << 20];
    let seconds = least_of(5, || {
        let sum: f32 = column
            .par_chunks(1 << 16)
            .map(|chunk| {
                let mut lanes = [0.0f32; 32];
                for values in chunk.chunks_exact(32) {
                    for k in 0..32 {
                        lanes[k] += values[k];
                    }
                }
                lanes.iter().sum::<f32>()
            })
            .sum();
        std::hint::black_box(sum);
    });
    4.0 * column.len() as f64 / seconds
}

fn least_of(times: usize, mut work: impl FnMut()) -> f64 {
    let mut time = || {
        let clock = Instant::now();
        work();
        clock.elapsed().as_secs_f64()
    };
    (0..times).map(|_| time()).fold(f64::INFINITY, f64::min)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
