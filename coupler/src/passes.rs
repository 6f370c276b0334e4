//! The passes over one step of the strong scheme: the guess, the comparison, the next guess.

use serde::{Deserialize, Serialize};

use crate::acceleration::Acceleration;
use crate::motion::SolidMotion;

/// Share of the displacement itself in the scale of the residual: at rest the motion over a step is no scale.
const AT_REST: f64 = 0.01;

/// When a step stands.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// |x~ - x| over max(|x~ - u_n|, 0.01 |x~|).
    pub tolerance: f64,
    /// Most passes; then the step stands as it is, and is counted.
    pub most_passes: u32,
}

/// The current step and what all took.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Passes {
    agreement: Agreement,
    acceleration: Acceleration,
    /// Displacement at the start of the step, `[n, D]` m.
    pub start: Vec<f64>,
    /// Displacement at its end as the fluid is told, `[n, D]` m.
    pub guess: Vec<f64>,
    /// The guess with the smallest residual of this step, and that residual, m.
    best: (Vec<f64>, f64),
    count: u32,
    steps: u64,
    passes: u64,
    unsettled: u64,
}

impl Passes {
    /// Before the first step.
    pub fn new(agreement: Agreement, acceleration: Acceleration) -> Self {
        let (start, guess) = (Vec::new(), Vec::new());
        let best = (Vec::new(), f64::INFINITY);
        Self { agreement, acceleration, start, guess, best, count: 0, steps: 0, passes: 0, unsettled: 0 }
    }

    /// Goes on from what another run has learnt and counted.
    pub fn take_up(&mut self, kept: Self) {
        self.acceleration.take_up(kept.acceleration);
        (self.steps, self.passes, self.unsettled) = (kept.steps, kept.passes, kept.unsettled);
    }

    /// Begins a step with u_n + dt v_n + dt^2/2 a_n.
    pub fn begin(&mut self, dt: f64, solid: &SolidMotion) {
        self.start.clone_from(&solid.displacement);
        self.guess.clone_from(&solid.displacement);
        let rates = solid.velocity.iter().zip(&solid.acceleration);
        self.guess.iter_mut().zip(rates).for_each(|(x, (v, a))| *x += dt * (v + 0.5 * dt * a));
        self.best.1 = f64::INFINITY;
        self.count = 1;
    }

    /// Takes the solid's answer; whether another pass is needed.
    pub fn compare(&mut self, found: &[f64]) -> bool {
        let residual = distance(found, &self.guess);
        let moved = distance(found, &self.start);
        let size = found.iter().map(|u| u * u).sum::<f64>().sqrt();
        let scale = moved.max(AT_REST * size);
        tracing::debug!(pass = self.count, residual, moved, scale, "compared");
        let agree = residual <= self.agreement.tolerance * scale;
        let is_open = !agree && self.count < self.agreement.most_passes;
        if !is_open {
            self.steps += 1;
            self.passes += u64::from(self.count);
            self.unsettled += u64::from(!agree);
        }
        is_open
    }

    /// A better guess from the solid's answer, no further from the best one than that has been off: water only adds
    /// mass, so the way to go is shorter than the residual. Where the map is not smooth (a pressure that would be
    /// negative is none) the acceleration alone may run away.
    pub fn correct(&mut self, found: &[f64]) {
        let residual = distance(found, &self.guess);
        if residual < self.best.1 {
            self.best.0.clone_from(&self.guess);
            self.best.1 = residual;
        }
        self.acceleration.improve(&mut self.guess, found);
        let (best, limit) = &self.best;
        let way = distance(&self.guess, best);
        if way > *limit {
            let share = limit / way;
            self.guess.iter_mut().zip(best).for_each(|(x, best)| *x = best + share * (*x - best));
        }
        self.count += 1;
    }

    /// The step stands; gives the number of passes over it.
    pub fn settle(&mut self) -> u32 {
        self.acceleration.end_step();
        self.count
    }

    /// Whether both sides agreed at the end of all but at most one step in a hundred.
    pub fn agrees(&self) -> bool {
        100 * self.unsettled <= self.steps
    }

    /// For the health table, where any step was passed over: passes a step, and steps that did not agree within the
    /// most passes.
    pub fn health(&self) -> impl Iterator<Item = (&'static str, f64)> + use<> {
        let per_step = self.passes as f64 / self.steps.max(1) as f64;
        let table = [("coupling_passes", per_step), ("unsettled_steps", self.unsettled as f64)];
        table.into_iter().filter({
            let steps = self.steps;
            move |_| steps > 0
        })
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acceleration::{IqnIls, Reuse};

    fn passes(tolerance: f64, most_passes: u32) -> Passes {
        let newton = IqnIls::new(Reuse { steps: 10, first_relaxation: 0.1 });
        Passes::new(Agreement { tolerance, most_passes }, Acceleration::IqnIls(newton))
    }

    /// One step with the answer `map(x)`; its passes.
    fn step(passes: &mut Passes, solid: &SolidMotion, map: impl Fn(&[f64]) -> Vec<f64>) -> u32 {
        passes.begin(0.1, solid);
        loop {
            let found = map(&passes.guess);
            if !passes.compare(&found) {
                return passes.settle();
            }
            passes.correct(&found);
        }
    }

    #[test]
    fn a_heavy_fluid_is_settled_in_a_few_passes_a_step() {
        let mut all = passes(1e-3, 30);
        let solid = SolidMotion {
            displacement: vec![0.0; 3],
            velocity: vec![1.0, 0.5, 0.2],
            acceleration: vec![0.1; 3],
        };
        let map = |x: &[f64]| x.iter().zip([-50.0, -5.0, -0.5]).map(|(x, l)| l * x + 0.3).collect();
        let counts: Vec<u32> = (0..10).map(|_| step(&mut all, &solid, map)).collect();
        assert!(counts[0] <= 6 && counts[9] <= 3, "{counts:?}");
        assert_eq!(all.health().last(), Some(("unsettled_steps", 0.0)));
        assert!(all.agrees());
    }

    #[test]
    fn a_map_without_an_answer_does_not_run_away() {
        let mut all = passes(1e-3, 30);
        let solid =
            SolidMotion { displacement: vec![0.0; 2], velocity: vec![1.0; 2], acceleration: vec![0.0; 2] };
        // Jumps over its own fixed point.
        let map = |x: &[f64]| x.iter().map(|&x| if x > 0.05 { -5.0 } else { 5.0 }).collect();
        assert_eq!(step(&mut all, &solid, map), 30);
        assert!(all.guess.iter().all(|x| x.abs() < 10.0), "{:?}", all.guess);
        assert_eq!(all.health().last(), Some(("unsettled_steps", 1.0)));
        assert!(!all.agrees());
    }
}
