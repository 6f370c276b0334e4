//! The passes over one step of the strong scheme: the guess, the comparison, the next guess.

use crate::acceleration::Acceleration;
use crate::motion::SolidMotion;

/// Share of the displacement itself in the scale of the residual: at rest the motion over a step is no scale.
const AT_REST: f64 = 0.01;

/// When a step stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Agreement {
    /// |x~ - x| over max(|x~ - u_n|, 0.01 |x~|).
    pub tolerance: f64,
    /// Most passes; then the step stands as it is, and is counted.
    pub most_passes: u32,
}

/// The current step and what all took.
#[derive(Debug, Clone)]
pub struct Passes {
    agreement: Agreement,
    acceleration: Acceleration,
    /// Displacement at the start of the step, `[n, D]` m.
    pub start: Vec<f64>,
    /// Displacement at its end as the fluid is told, `[n, D]` m.
    pub guess: Vec<f64>,
    count: u32,
    steps: u64,
    passes: u64,
    unsettled: u64,
}

impl Passes {
    /// Before the first step.
    pub fn new(agreement: Agreement, acceleration: Acceleration) -> Self {
        let (start, guess) = (Vec::new(), Vec::new());
        Self { agreement, acceleration, start, guess, count: 0, steps: 0, passes: 0, unsettled: 0 }
    }

    /// Begins a step with u_n + dt v_n + dt^2/2 a_n.
    pub fn begin(&mut self, dt: f64, solid: &SolidMotion) {
        self.start.clone_from(&solid.displacement);
        self.guess.clone_from(&solid.displacement);
        let rates = solid.velocity.iter().zip(&solid.acceleration);
        self.guess.iter_mut().zip(rates).for_each(|(x, (v, a))| *x += dt * (v + 0.5 * dt * a));
        self.count = 1;
    }

    /// Takes the solid's answer; whether another pass is needed.
    pub fn compare(&mut self, found: &[f64]) -> bool {
        let norm = |difference: &mut dyn Iterator<Item = f64>| difference.map(|d| d * d).sum::<f64>().sqrt();
        let residual = norm(&mut found.iter().zip(&self.guess).map(|(found, x)| found - x));
        let moved = norm(&mut found.iter().zip(&self.start).map(|(found, start)| found - start));
        let scale = moved.max(AT_REST * norm(&mut found.iter().copied()));
        let agree = residual <= self.agreement.tolerance * scale;
        let is_open = !agree && self.count < self.agreement.most_passes;
        if !is_open {
            self.steps += 1;
            self.passes += u64::from(self.count);
            self.unsettled += u64::from(!agree);
        }
        is_open
    }

    /// A better guess from the solid's answer.
    pub fn correct(&mut self, found: &[f64]) {
        self.acceleration.improve(&mut self.guess, found);
        self.count += 1;
    }

    /// The step stands.
    pub fn settle(&mut self) {
        self.acceleration.end_step();
    }

    /// For the health table: passes a step, and steps that did not agree within the most passes.
    pub fn health(&self) -> [(&'static str, f64); 2] {
        [
            ("coupling_passes", self.passes as f64 / self.steps.max(1) as f64),
            ("unsettled_steps", self.unsettled as f64),
        ]
    }
}
