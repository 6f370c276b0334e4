//! The length of the coupling steps: the smallest of what all admit, at most a tenth more than the last.

use protocol::case::{Scheme, TimeSettings};
use protocol::control::StepTime;
use serde::{Deserialize, Serialize};

/// Largest growth from one step to the next.
const GROWTH: f64 = 1.1;

/// Where a run stands in time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Moment {
    /// Coupling steps done.
    pub step: u64,
    /// Simulated time, s.
    pub time: f64,
    /// The step last wanted, s; none before the first.
    last_dt: Option<f64>,
    /// What the participants admit for the next one, s.
    admitted: f64,
    shortened: u64,
    /// Scheme of the steps after the next, where the guard changes it.
    pub next_scheme: Option<Scheme>,
}

impl Moment {
    /// The step that ends here.
    pub fn step_time(&self) -> StepTime {
        StepTime { step: self.step, time: self.time, dt: self.last_dt.unwrap_or_default() }
    }
}

/// Walks through the time of a run.
#[derive(Debug, Clone)]
pub struct Clock {
    settings: TimeSettings,
    now: Moment,
}

impl Clock {
    /// Starts at 0 with what the participants admit first, s.
    pub fn new(settings: &TimeSettings, admitted: f64) -> Self {
        let start = Moment { step: 0, time: 0.0, last_dt: None, admitted, shortened: 0, next_scheme: None };
        Self::at(settings, start)
    }

    /// Goes on from where another run stood.
    pub fn at(settings: &TimeSettings, now: Moment) -> Self {
        Self { settings: settings.clone(), now }
    }

    /// Where the run stands.
    pub fn now(&self) -> Moment {
        self.now
    }

    /// The next step, `None` at the end. The last one ends exactly at the end of the run; so that it is no sliver, the
    /// last two share what is left.
    pub fn next_step(&mut self) -> Option<StepTime> {
        let left = self.settings.end - self.now.time;
        if left <= 1e-9 * self.settings.max_dt {
            return None;
        }
        let growth = self.now.last_dt.map_or(f64::INFINITY, |last| GROWTH * last);
        let wanted = if self.settings.pinned {
            self.settings.max_dt
        } else {
            self.settings.max_dt.min(self.now.admitted).min(growth)
        };
        self.now.shortened += u64::from(wanted < self.settings.max_dt * (1.0 - 1e-9));
        let dt = if left <= wanted * (1.0 + 1e-6) {
            left
        } else if left < 2.0 * wanted && !self.settings.pinned {
            0.5 * left
        } else {
            wanted
        };
        let now = &mut self.now;
        now.step += 1;
        now.time = if dt == left { self.settings.end } else { now.time + dt };
        now.last_dt = Some(wanted);
        Some(StepTime { step: now.step, time: now.time, dt })
    }

    /// Takes what the participants admit for the next step, s.
    pub fn admit(&mut self, dt: f64) {
        self.now.admitted = dt;
    }

    /// Steps shorter than the largest the case allows.
    pub fn shortened_steps(&self) -> u64 {
        self.now.shortened
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(end: f64, max_dt: f64, pinned: bool) -> TimeSettings {
        TimeSettings { end, max_dt, pinned, silence_limit: 1.0 }
    }

    fn steps(clock: &mut Clock) -> Vec<StepTime> {
        std::iter::from_fn(|| clock.next_step()).collect()
    }

    #[test]
    fn the_run_ends_exactly_at_its_end_without_a_sliver() {
        let steps = steps(&mut Clock::new(&settings(1.0, 0.3, false), f64::INFINITY));
        assert_eq!(steps.last().unwrap().time, 1.0);
        assert!(steps.iter().all(|step| step.dt >= 0.15), "{steps:?}");
        let total: f64 = steps.iter().map(|step| step.dt).sum();
        assert!((total - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_step_grows_by_a_tenth_at_most() {
        let mut clock = Clock::new(&settings(1.0, 0.1, false), 0.01);
        let first = clock.next_step().unwrap();
        clock.admit(f64::INFINITY);
        let second = clock.next_step().unwrap();
        assert_eq!(first.dt, 0.01);
        assert!((second.dt - 0.011).abs() < 1e-15);
        assert_eq!(clock.shortened_steps(), 2);
    }

    #[test]
    fn a_clock_goes_on_from_a_moment_as_if_it_had_not_stopped() {
        let mut clock = Clock::new(&settings(1.0, 0.1, false), 0.01);
        let mut later = clock.clone();
        for step in 0..20 {
            assert_eq!(later.next_step(), clock.next_step());
            let admitted = if step % 3 == 0 { 0.02 } else { f64::INFINITY };
            clock.admit(admitted);
            later.admit(admitted);
            later = Clock::at(&settings(1.0, 0.1, false), later.now());
        }
        assert_eq!(later.shortened_steps(), clock.shortened_steps());
    }

    #[test]
    fn pinned_steps_ignore_what_is_admitted() {
        let steps = steps(&mut Clock::new(&settings(1.0, 0.25, true), 1e-6));
        assert_eq!(steps.iter().map(|step| step.dt).collect::<Vec<_>>(), [0.25; 4]);
    }
}
