//! Order in the time step of the coupling schemes, on the one mode that decides: a spring-held wall and the mass of the
//! water before it, which is what incompressible water is to a wall. Generalised-alpha with rho_inf = 0.5 moves the wall.
//!
//! The water's step is the fluid's own: the load is the change of its momentum from one step to the next,
//! F = -m_a (w_n+1 - w_n)/dt, with w the velocity of the wall it was given.

use coupler::acceleration::{Acceleration, IqnIls, Reuse};
use coupler::motion::{DisplacementPredictor, SolidMotion};
use coupler::passes::{Agreement, Passes};

const OMEGA: f64 = std::f64::consts::TAU;
const RATIO: f64 = 0.5;

/// Per mass of the wall; the spring gives the wall with its water the frequency 1 Hz.
struct Wall {
    state: [f64; 3],
    load: f64,
}

impl Wall {
    fn advance(&mut self, load: f64, dt: f64) {
        let (rho, stiffness) = (0.5, (1.0 + RATIO) * OMEGA * OMEGA);
        let (am, af) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
        let (gamma, beta) = (0.5 - am + af, 0.25 * (1.0 - am + af) * (1.0 - am + af));
        let [u, v, a] = self.state;
        let free = u + dt * v + dt * dt * (0.5 - beta) * a;
        let known = (1.0 - af) * load + af * self.load - am * a - stiffness * ((1.0 - af) * free + af * u);
        let next = known / (1.0 - am + stiffness * (1.0 - af) * beta * dt * dt);
        self.state = [free + beta * dt * dt * next, v + dt * ((1.0 - gamma) * a + gamma * next), next];
        self.load = load;
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Scheme {
    Staggered,
    Robin,
    Strong,
}

/// Largest error of the wall's place over two periods, relative to the swing.
fn error(scheme: Scheme, steps_a_period: usize) -> f64 {
    let dt = 1.0 / steps_a_period as f64;
    let exact = |time: f64| (OMEGA * time).cos();
    let mut wall = Wall { state: [1.0, 0.0, -OMEGA * OMEGA], load: RATIO * OMEGA * OMEGA };
    let mut water = (exact(0.0) - exact(-dt)) / dt;
    let mut predictor = DisplacementPredictor::new(1, &[1.0]);
    let reuse = Reuse { steps: 10, first_relaxation: 0.5 };
    let agreement = Agreement { tolerance: 1e-12, most_passes: 50 };
    let mut passes = Passes::new(agreement, Acceleration::IqnIls(IqnIls::new(reuse)));
    let mut largest = 0.0_f64;
    for step in 1..=2 * steps_a_period {
        let [u, v, a] = wall.state;
        match scheme {
            Scheme::Staggered => {
                let (mut position, mut velocity) = ([u], [v]);
                predictor.predict(dt, &mut position, &mut velocity);
                let load = -RATIO * (velocity[0] - water) / dt;
                water = velocity[0];
                wall.advance(load, dt);
            }
            Scheme::Robin => {
                // The wall gives way to the load it has not felt yet: w = w* + (F_n+1 - F_n) dt/m_r.
                let (give, before) = (2.0 * RATIO, wall.load);
                let load = (give * before - RATIO * (v + dt * a - water) / dt) / (1.0 + give);
                water = v + dt * a + 2.0 * dt * (load - before);
                wall.advance(load, dt);
            }
            Scheme::Strong => {
                let state = Wall { ..wall };
                let motion = SolidMotion { displacement: vec![u], velocity: vec![v], acceleration: vec![a] };
                passes.begin(dt, &motion);
                loop {
                    wall = Wall { ..state };
                    let velocity = (passes.guess[0] - u) / dt;
                    wall.advance(-RATIO * (velocity - water) / dt, dt);
                    if !passes.compare(&wall.state[..1]) {
                        water = velocity;
                        break;
                    }
                    passes.correct(&wall.state[..1]);
                }
                passes.settle();
            }
        }
        largest = largest.max((wall.state[0] - exact(dt * step as f64)).abs());
    }
    largest
}

#[test]
fn the_place_of_the_wall_converges_with_the_first_power_of_the_time_step() {
    for scheme in [Scheme::Staggered, Scheme::Robin, Scheme::Strong] {
        let errors = [200, 400, 800, 1600].map(|steps| error(scheme, steps));
        let orders: Vec<f64> = errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect();
        println!("{scheme:?}: errors {errors:.2?}, orders {orders:.2?}");
        assert!((orders[2] - 1.0).abs() < 0.1, "{scheme:?}: {orders:?}");
    }
}
