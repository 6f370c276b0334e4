//! Noise of the pressure an impact sensor shows: the rigid dam break of `docs/fluid-tried.md`, in one process.
//!
//! ```text
//! cargo run --release -p fluid-isph --example sensor_noise -- [relaxation_time=0.005] [kernel=cubic_spline|wendland_c2]
//!     [courant=0.3] [max_dt=5e-4] [tolerance=1e-3] [shifting=0] [runs=4]
//! ```
//!
//! Column a x 2a, a = 0.146 m, spacing a/32, tank 4a. Sensor: mean of the pressure at 5, 10 and 15 mm on the far wall.
//! Noise: root mean square about its 5 ms running mean from 0.42 to 0.9 s, over the mean. The flow is chaotic, so runs
//! that differ by an initial displacement of a thousandth of a spacing stand behind a figure.

use fluid_isph::Fluid;
use fluid_isph::kernel_shape::KernelShape;
use fluid_isph::scene::{Scene, Source, Tank, WaterBox};
use protocol::usage::cpu_seconds;

/// Side of the column, m.
const SIDE: f64 = 0.146;

/// Length of the running mean, s.
const WINDOW: f64 = 5e-3;

/// Times between which the noise is taken, s.
const SPAN: (f64, f64) = (0.42, 0.9);

/// What one run gave.
struct Run {
    /// (t, p) of every step, s and Pa.
    samples: Vec<(f64, f64)>,
    iterations: f64,
    density_error: f64,
    volume_error: f64,
    escaped: u64,
    cpu: f64,
    steps: u64,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let text = |name: &str| {
        arguments.iter().find_map(|one| one.strip_prefix(name)?.strip_prefix('=')).map(str::to_owned)
    };
    let number = |name: &str, default: f64| {
        text(name).map_or(default, |text| text.parse().expect("the option takes a number"))
    };
    let mut scene = dam_break();
    scene.kernel = match text("kernel").as_deref() {
        None | Some("cubic_spline") => KernelShape::CubicSpline,
        Some("wendland_c2") => KernelShape::WendlandC2,
        Some(other) => panic!("no kernel {other}"),
    };
    scene.source = Source::Time(number("relaxation_time", 0.005));
    scene.courant = number("courant", scene.courant);
    scene.pressure_tolerance = number("tolerance", scene.pressure_tolerance);
    scene.shifting = Some(number("shifting", 0.0)).filter(|&factor| factor > 0.0);
    let max_dt = number("max_dt", 5e-4);
    println!(
        "noise %, mean Pa, least and greatest 5 ms mean Pa, iterations, density, volume error %, escaped, CPU s, steps"
    );
    let mut all = Vec::new();
    for run in 0..number("runs", 4.0) as usize {
        scene.jitter = Some(1e-3 * run as f64).filter(|&jitter| jitter > 0.0);
        let run = follow(&scene, max_dt);
        let (noise, mean, least, greatest) = judge(&run.samples);
        println!(
            "{:5.2} {mean:7.1} {least:7.1} {greatest:7.1} {:5.2} {:6.3} {:6.2} {:3} {:6.2} {:5}",
            100.0 * noise,
            run.iterations,
            run.density_error,
            100.0 * run.volume_error,
            run.escaped,
            run.cpu,
            run.steps
        );
        all.push((noise, mean));
    }
    let count = all.len() as f64;
    let means = all.iter().fold((0.0, 0.0), |sum, one| (sum.0 + one.0 / count, sum.1 + one.1 / count));
    println!("mean: noise {:.2} %, pressure {:.1} Pa", 100.0 * means.0, means.1);
}

fn dam_break() -> Scene<2> {
    let tank = Tank { min: [0.0; 2], max: [4.0 * SIDE, 1.0], open: [[false; 2], [false, true]] };
    let column = WaterBox { min: [0.0; 2], max: [SIDE, 2.0 * SIDE], velocity: [0.0; 2] };
    Scene::new(tank, vec![column], SIDE / 32.0)
}

fn follow(scene: &Scene<2>, max_dt: f64) -> Run {
    let before = cpu_seconds();
    let mut fluid = Fluid::new(scene.clone(), None).expect("the scene is a good one");
    let mut samples = Vec::new();
    while fluid.time() < SPAN.1 + WINDOW {
        fluid.advance(fluid.admitted_time_step().min(max_dt), None).expect("the step succeeds");
        let at = |height: f64| fluid.pressure_at(&[4.0 * SIDE, height]);
        samples.push((fluid.time(), (at(0.005) + at(0.010) + at(0.015)) / 3.0));
    }
    let health = fluid.health();
    Run {
        samples,
        iterations: health.mean_pressure_iterations,
        density_error: health.max_density_error,
        volume_error: health.volume_error,
        escaped: health.escaped_particles,
        cpu: cpu_seconds() - before,
        steps: health.substeps,
    }
}

/// Noise, mean, least and greatest running mean over the span.
fn judge(samples: &[(f64, f64)]) -> (f64, f64, f64, f64) {
    let (mut square, mut mean, mut time) = (0.0, 0.0, 0.0);
    let (mut least, mut greatest) = (f64::INFINITY, 0.0f64);
    for pair in samples.windows(2).filter(|pair| SPAN.0 <= pair[1].0 && pair[1].0 <= SPAN.1) {
        let (dt, p) = (pair[1].0 - pair[0].0, pair[1].1);
        let running = running_mean(samples, pair[1].0);
        square += dt * (p - running).powi(2);
        mean += dt * p;
        time += dt;
        (least, greatest) = (least.min(running), greatest.max(running));
    }
    ((square / time).sqrt() / (mean / time), mean / time, least, greatest)
}

/// Mean of the steps whose end lies within half a window of a time; each counts with its length.
fn running_mean(samples: &[(f64, f64)], time: f64) -> f64 {
    let near = |at: f64| (at - time).abs() <= 0.5 * WINDOW;
    let pairs = samples.windows(2).filter(|pair| near(pair[1].0));
    let sum = pairs.fold((0.0, 0.0), |sum, pair| {
        let dt = pair[1].0 - pair[0].0;
        (sum.0 + dt * pair[1].1, sum.1 + dt)
    });
    sum.0 / sum.1
}
