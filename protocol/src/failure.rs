//! How a run ends when it does not end well: one cause, with place, value, limit and hint.

use serde::{Deserialize, Serialize};

/// What kind of failure it is; decides the exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureClass {
    /// Case, usage, version or interface rejected.
    Case,
    /// The numerics failed: no convergence, inverted element, a value that is not finite.
    Numerical,
    /// A process died or fell silent.
    Process,
    /// Files, disk or shared memory.
    Resource,
    /// The user asked to stop.
    Interrupted,
    /// A bug in Tidewall.
    Bug,
}

impl FailureClass {
    /// The exit code of `tidewall` and of every participant.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Case => 2,
            Self::Numerical => 3,
            Self::Process => 4,
            Self::Resource => 5,
            Self::Bug => 70,
            Self::Interrupted => 130,
        }
    }
}

/// The first cause of a failed run, as it stands in `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// Kind, deciding the exit code.
    pub class: FailureClass,
    /// Process that failed.
    pub process: String,
    /// Coupling step, 0 before the first.
    pub step: u64,
    /// Simulated time, s.
    pub time_s: f64,
    /// Phase of the step, or of the start.
    pub phase: String,
    /// What happened, in one line.
    pub what: String,
    /// The offending value, where there is one.
    pub value: Option<f64>,
    /// The limit it broke.
    pub limit: Option<f64>,
    /// What to try.
    pub hint: String,
}

impl Failure {
    /// A failure before the first step, without value and hint.
    pub fn new(class: FailureClass, process: &str, phase: &str, what: impl Into<String>) -> Self {
        let (process, phase, what) = (process.to_owned(), phase.to_owned(), what.into());
        Self {
            class,
            process,
            step: 0,
            time_s: 0.0,
            phase,
            what,
            value: None,
            limit: None,
            hint: String::new(),
        }
    }

    /// The same failure, placed at a step.
    pub fn at(mut self, step: u64, time_s: f64) -> Self {
        (self.step, self.time_s) = (step, time_s);
        self
    }

    /// The same failure with the value that broke a limit.
    pub fn with_value(mut self, value: f64, limit: f64) -> Self {
        (self.value, self.limit) = (Some(value), Some(limit));
        self
    }

    /// The same failure with advice.
    pub fn with_hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = hint.into();
        self
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} failed in {}", self.process, self.phase)?;
        // What is refused before the first step has no place in time.
        if self.step > 0 || matches!(self.class, FailureClass::Process | FailureClass::Numerical) {
            write!(f, " at step {} (t = {:.6} s)", self.step, self.time_s)?;
        }
        write!(f, ": {}", self.what)?;
        if let Some(value) = self.value {
            write!(f, "; value {value:.6e}")?;
        }
        if let Some(limit) = self.limit {
            write!(f, ", limit {limit:.6e}")?;
        }
        if !self.hint.is_empty() {
            write!(f, ". {}", self.hint)?;
        }
        Ok(())
    }
}

impl std::error::Error for Failure {}
