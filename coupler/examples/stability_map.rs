//! Where each coupling scheme is stable: growth per step over added-mass ratio r = m_a/m and step omega dt, from the exact
//! one-step maps of a modal model (a mass on a spring beside incompressible water).
//!
//! `cargo run --release -p coupler --example stability_map -- docs/images/stability-map.svg`
//!
//! The structure, with m = dt = 1 and k = (omega dt)^2: m a + k u = f. The water answers the velocity w it is given for the wall:
//! f_n+1 = -m_a (w_n+1 - w_n)/dt. All that a scheme decides is w.

use std::fmt::Write as _;

use nalgebra::DMatrix;

/// Generalised-alpha of Chung and Hulbert, the load blended as the internal force is.
#[derive(Clone, Copy)]
struct Integrator {
    alpha_m: f64,
    alpha_f: f64,
    gamma: f64,
    beta: f64,
}

/// What decides the velocity of the wall that the water sees.
#[derive(Clone, Copy, PartialEq)]
enum Scheme {
    /// Displacement prediction of order 0, 1 or 2.
    Staggered(u8),
    /// The same, the structure under the load of the step before.
    Parallel(u8),
    /// v + dt a, giving way to the new pressure through the mass m_r = sigma m.
    Robin { sigma: f64 },
}

/// u, v, a, f_n, f_n-1, w, the last prediction, v_n-1.
const STATE: usize = 8;

fn generalised_alpha(rho_inf: f64) -> Integrator {
    let alpha_m = (2.0 * rho_inf - 1.0) / (rho_inf + 1.0);
    let alpha_f = rho_inf / (rho_inf + 1.0);
    let difference = alpha_f - alpha_m;
    Integrator { alpha_m, alpha_f, gamma: 0.5 + difference, beta: 0.25 * (1.0 + difference).powi(2) }
}

const NEWMARK: Integrator = Integrator { alpha_m: 0.0, alpha_f: 0.0, gamma: 0.6, beta: 0.3025 };

/// One coupling step; linear in the state.
fn step(scheme: Scheme, by: Integrator, ratio: f64, stiffness: f64, state: &[f64; STATE]) -> [f64; STATE] {
    let [u, v, a, load, load_before, wall, predicted, v_before] = *state;
    let mut prediction = predicted;
    let (new_wall, new_load) = match scheme {
        Scheme::Staggered(order) | Scheme::Parallel(order) => {
            prediction = match order {
                0 => u,
                1 => u + v,
                _ => u + 1.5 * v - 0.5 * v_before,
            };
            let new_wall = prediction - predicted;
            (new_wall, -ratio * (new_wall - wall))
        }
        Scheme::Robin { sigma } => {
            let free = v + a;
            let new_load = (-ratio * (free - wall) + ratio / sigma * load) / (1.0 + ratio / sigma);
            (free + (new_load - load) / sigma, new_load)
        }
    };
    let (felt, felt_before) = match scheme {
        Scheme::Parallel(_) => (load, load_before),
        _ => (new_load, load),
    };
    let Integrator { alpha_m, alpha_f, gamma, beta } = by;
    let explicit = u + v + (0.5 - beta) * a;
    let right = (1.0 - alpha_f) * felt + alpha_f * felt_before
        - alpha_m * a
        - stiffness * ((1.0 - alpha_f) * explicit + alpha_f * u);
    let new_a = right / (1.0 - alpha_m + stiffness * (1.0 - alpha_f) * beta);
    let new_v = v + (1.0 - gamma) * a + gamma * new_a;
    [explicit + beta * new_a, new_v, new_a, new_load, load, new_wall, prediction, v]
}

/// Growth of the fastest growing state per step: the spectral radius of the one-step map.
fn growth(scheme: Scheme, by: Integrator, ratio: f64, step_size: f64) -> f64 {
    let mut map = DMatrix::zeros(STATE, STATE);
    for column in 0..STATE {
        let mut unit = [0.0; STATE];
        unit[column] = 1.0;
        let image = step(scheme, by, ratio, step_size * step_size, &unit);
        map.column_mut(column).copy_from_slice(&image);
    }
    map.complex_eigenvalues().iter().map(|value| value.norm()).fold(0.0, f64::max)
}

/// Rounding of a radius of 1 where eigenvalues meet.
const MARGIN: f64 = 1e-6;

/// The ratio at which a small step (omega dt = 0.1) begins to grow; `None` if it never does up to 1e5.
fn limit(scheme: Scheme, by: Integrator) -> Option<f64> {
    let ratios = (0..=1400).map(|i| 10f64.powf(-2.0 + f64::from(i) / 200.0));
    ratios.into_iter().find(|&ratio| growth(scheme, by, ratio, 0.1) > 1.0 + MARGIN)
}

const COLUMNS: usize = 48;
const ROWS: usize = 32;
const CELL: f64 = 6.0;
const RATIO_DECADES: (f64, f64) = (-1.0, 3.0);
const STEP_DECADES: (f64, f64) = (-3.0, 1.0);

/// A colour from "keeps" over "grows a little" to "doubles and more".
fn colour(growth: f64) -> &'static str {
    match growth {
        g if g <= 1.0 + MARGIN => "#d6e6f2",
        g if g < 1.1 => "#f6d9a8",
        g if g < 2.0 => "#e9a26b",
        _ => "#c8442b",
    }
}

fn panel(svg: &mut String, title: &str, scheme: Scheme, by: Integrator) {
    let (width, height) = (COLUMNS as f64 * CELL, ROWS as f64 * CELL);
    let at = |index: usize, count: usize, range: (f64, f64)| {
        10f64.powf(range.0 + (index as f64 + 0.5) / count as f64 * (range.1 - range.0))
    };
    let _ = write!(svg, "<text x=\"0\" y=\"-8\" font-weight=\"600\">{title}</text>");
    for row in 0..ROWS {
        let size = at(row, ROWS, STEP_DECADES);
        let fill = |column| colour(growth(scheme, by, at(column, COLUMNS, RATIO_DECADES), size));
        let fills: Vec<_> = (0..COLUMNS).map(fill).collect();
        let y = height - (row + 1) as f64 * CELL;
        let mut x = 0.0;
        for run in fills.chunk_by(|a, b| a == b) {
            let (wide, fill) = (run.len() as f64 * CELL, run[0]);
            let _ =
                write!(svg, "<rect x=\"{x}\" y=\"{y}\" width=\"{wide}\" height=\"{CELL}\" fill=\"{fill}\"/>");
            x += wide;
        }
    }
    for power in -1..=3 {
        let x = f64::from(power + 1) / 4.0 * width;
        let label = 10f64.powi(power);
        let _ = write!(svg, "<text x=\"{x}\" y=\"{}\" text-anchor=\"middle\">{label}</text>", height + 15.0);
    }
    for power in -3..=1 {
        let y = height - f64::from(power + 3) / 4.0 * height + 4.0;
        let label = 10f64.powi(power);
        let _ = write!(svg, "<text x=\"-6\" y=\"{y}\" text-anchor=\"end\">{label}</text>");
    }
    let _ = write!(
        svg,
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">added-mass ratio r</text><text x=\"-42\" y=\"{}\" \
         text-anchor=\"middle\" transform=\"rotate(-90 -42 {2})\">omega dt</text>",
        0.5 * width,
        height + 32.0,
        0.5 * height
    );
}

fn main() -> std::io::Result<()> {
    let alpha = generalised_alpha(0.5);
    let panels = [
        ("Staggered, order 0", Scheme::Staggered(0), alpha),
        ("Staggered, order 1", Scheme::Staggered(1), alpha),
        ("Staggered, order 2", Scheme::Staggered(2), alpha),
        ("Staggered, order 1, Newmark 0.6 / 0.3025", Scheme::Staggered(1), NEWMARK),
        ("Parallel, order 1", Scheme::Parallel(1), alpha),
        ("Robin wall, sigma 0.5", Scheme::Robin { sigma: 0.5 }, alpha),
    ];
    let (width, height) = (COLUMNS as f64 * CELL + 90.0, ROWS as f64 * CELL + 80.0);
    let (whole_width, whole_height) = (3.0 * width, 2.0 * height + 26.0);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {whole_width} {whole_height}\"><style>text{{font:11px \
         system-ui,sans-serif;fill:#1d2733}}</style><rect width=\"{whole_width}\" height=\"{whole_height}\" fill=\"#fff\"/>"
    );
    for (index, (title, scheme, by)) in panels.into_iter().enumerate() {
        let (x, y) = (60.0 + (index % 3) as f64 * width, 30.0 + (index / 3) as f64 * height);
        let _ = write!(svg, "<g transform=\"translate({x} {y})\" shape-rendering=\"crispEdges\">");
        panel(&mut svg, title, scheme, by);
        svg.push_str("</g>");
        let found = limit(scheme, by).map_or("none up to 1e5".to_owned(), |ratio| format!("{ratio:.2}"));
        println!("{title:<42} stable up to r = {found}");
    }
    let keys = [
        (1.0, "keeps or damps"),
        (1.05, "grows by up to 10 % a step"),
        (1.5, "up to 2 times"),
        (3.0, "more"),
    ];
    for (index, (growth, words)) in keys.into_iter().enumerate() {
        let x = 60.0 + 230.0 * index as f64;
        let y = whole_height - 14.0;
        let _ = write!(
            svg,
            "<rect x=\"{x}\" y=\"{}\" width=\"12\" height=\"12\" fill=\"{}\"/><text x=\"{}\" y=\"{y}\">{words}</text>",
            y - 10.0,
            colour(growth),
            x + 18.0
        );
    }
    svg.push_str("</svg>\n");
    match std::env::args().nth(1) {
        Some(path) => std::fs::write(path, svg),
        None => Ok(()),
    }
}
