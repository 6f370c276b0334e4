//! Time per named phase: one phase, one tracing span, one column of the report.

use std::time::Instant;

use serde::{Deserialize, Serialize};

/// Calls and wall time of one phase.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PhaseTime {
    /// Its name, as in the `step.rs` it belongs to.
    pub name: String,
    /// How often it ran.
    pub calls: u64,
    /// Wall time in it, s.
    pub wall_s: f64,
}

/// The phases a scene has, in the order of their first run; a phase that never runs does not appear.
#[derive(Debug, Default)]
pub struct PhaseClock {
    phases: Vec<(&'static str, u64, f64)>,
}

impl PhaseClock {
    /// Runs one phase and books its time.
    pub fn run<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let span = tracing::debug_span!("phase", name);
        let _entered = span.enter();
        let start = Instant::now();
        let result = work();
        self.add(name, start.elapsed().as_secs_f64());
        result
    }

    /// Books time measured elsewhere.
    pub fn add(&mut self, name: &'static str, seconds: f64) {
        match self.phases.iter_mut().find(|phase| phase.0 == name) {
            Some(phase) => {
                phase.1 += 1;
                phase.2 += seconds;
            }
            None => self.phases.push((name, 1, seconds)),
        }
    }

    /// The table so far.
    pub fn table(&self) -> Vec<PhaseTime> {
        let row =
            |&(name, calls, wall_s): &(&str, u64, f64)| PhaseTime { name: name.to_owned(), calls, wall_s };
        self.phases.iter().map(row).collect()
    }
}
