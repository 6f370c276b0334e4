//! A water column on a piston held by a spring: the coupled frequency is sqrt(k/(m + m_a)) with m_a = rho_f h, and a
//! Robin wall must stay stable however large the ratio r = m_a/m.

#![expect(clippy::unwrap_used, reason = "a failing helper must fail the test")]

mod common;

use common::{column_on_plate, floor_plate};
use fluid_isph::{Fluid, Motion};
use protocol::interface::Response;

const WIDTH: f64 = 0.1;
const HEIGHT: f64 = 0.1;
const PERIOD: f64 = 0.1;

/// Generalised-alpha (Chung & Hulbert 1993) for one degree of freedom, rho_inf = 0.5, load blended.
struct Piston {
    mass: f64,
    stiffness: f64,
    state: [f64; 3],
    load: f64,
}

impl Piston {
    fn advance(&mut self, load: f64, dt: f64) {
        let rho = 0.5;
        let (am, af) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
        let gamma = 0.5 - am + af;
        let beta = 0.25 * (1.0 - am + af) * (1.0 - am + af);
        let [u, v, a] = self.state;
        let free = u + dt * v + dt * dt * (0.5 - beta) * a;
        let blended = (1.0 - af) * load + af * self.load;
        let known = blended - self.mass * am * a - self.stiffness * ((1.0 - af) * free + af * u);
        let new_a = known / (self.mass * (1.0 - am) + self.stiffness * (1.0 - af) * beta * dt * dt);
        self.state = [free + beta * dt * dt * new_a, v + dt * ((1.0 - gamma) * a + gamma * new_a), new_a];
        self.load = load;
    }
}

/// Runs the piston with mass ratio r and returns (measured period, largest |u|, largest jump of the load over mean).
fn run(ratio: f64, steps_per_period: f64, spacing: f64) -> (f64, f64, f64) {
    let areal_mass = 1000.0 * HEIGHT / ratio;
    let total = (areal_mass + 1000.0 * HEIGHT) * WIDTH;
    let stiffness = total * (std::f64::consts::TAU / PERIOD).powi(2);
    let mesh = floor_plate((WIDTH, 0.04, None), 4, (Response::Robin, 0.5 * areal_mass));
    let mut scene = column_on_plate(WIDTH, HEIGHT, 0.04, spacing);
    scene.source = fluid_isph::scene::Source::Time(0.02);
    let mut fluid = Fluid::new(scene, Some(&mesh)).unwrap();
    // Half the weight hangs in the spring at the start: an oscillation of half the static sag about it.
    let sag = -total * 9.81 / stiffness;
    let mut piston =
        Piston { mass: areal_mass * WIDTH, stiffness, state: [0.5 * sag, 0.0, -4.905], load: 0.0 };
    piston.load = -0.5 * 9.81 * HEIGHT * 1000.0 * WIDTH - piston.mass * 9.81;
    let dt = PERIOD / steps_per_period;
    let nodes = mesh.node_count();
    let (mut crossings, mut largest, mut last_load, mut jump) = (Vec::new(), 0.0f64, 0.0, 0.0f64);
    for step in 0..(4.2 * steps_per_period) as usize {
        let [u, v, a] = piston.state;
        let lift = |k: usize, value: f64| if k % 2 == 1 { value } else { 0.0 };
        let position: Vec<f64> =
            mesh.reference_position.iter().enumerate().map(|(k, x)| x + lift(k, u - 0.5 * sag)).collect();
        let velocity: Vec<f64> = (0..2 * nodes).map(|k| lift(k, v + dt * a)).collect();
        let motion = Motion { position: &position, velocity: &velocity, acceleration: None };
        fluid.advance(dt, Some(motion)).unwrap();
        let load: f64 = fluid.pair_force().iter().skip(1).step_by(2).sum();
        let before = piston.state[0] - sag;
        piston.advance(load - piston.mass * 9.81, dt);
        let after = piston.state[0] - sag;
        if before > 0.0 && after <= 0.0 {
            crossings.push((step as f64 + before / (before - after)) * dt);
        }
        largest = largest.max(after.abs());
        if step > 10 {
            jump = jump.max((load - last_load).abs() / (9.81 * HEIGHT * 1000.0 * WIDTH));
        }
        last_load = load;
    }
    let periods = crossings.len() - 1;
    ((crossings[periods] - crossings[0]) / periods as f64, largest / sag.abs(), jump)
}

#[test]
fn the_robin_wall_is_stable_and_has_the_coupled_frequency() {
    // Dynamics error of the scheme at this many steps a period: below 0.5 %; spatial error of the column: below 1.5 %.
    for (ratio, steps) in [(0.5, 300.0), (5.0, 300.0), (50.0, 600.0)] {
        let (period, largest, jump) = run(ratio, steps, 0.01);
        println!(
            "r = {ratio}: period/exact {:.4}, largest/sag {largest:.3}, jump {jump:.3}",
            period / PERIOD
        );
        assert!((period / PERIOD - 1.0).abs() < 0.02, "r = {ratio}: period {period}");
        assert!(largest < 0.55, "r = {ratio}: amplitude {largest} of the sag, 0.5 at the start");
        assert!(jump < 0.2, "r = {ratio}: load jumps by {jump} of the weight");
    }
}
