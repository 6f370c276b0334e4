//! The motion of a body at one instant, from where to where a step goes, and what steps took.

use serde::{Deserialize, Serialize};

use crate::assembly::At;
use crate::load::When;

/// What defines the motion at one instant; all `[n, D]`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct State {
    /// s.
    pub(crate) time: f64,
    /// m.
    pub(crate) displacement: Vec<f64>,
    /// m/s.
    pub(crate) velocity: Vec<f64>,
    /// m/s2.
    pub(crate) acceleration: Vec<f64>,
    /// N.
    pub(crate) internal_force: Vec<f64>,
    /// N.
    pub(crate) external_force: Vec<f64>,
    /// What the elements keep, `[elements, history]`.
    pub(crate) history: Vec<f64>,
}

impl State {
    /// Whether every number but the time has the same bits.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        fn columns(state: &State) -> [&[f64]; 6] {
            let State { displacement, velocity, acceleration, .. } = state;
            let State { internal_force, external_force, history, .. } = state;
            [displacement, velocity, acceleration, internal_force, external_force, history].map(Vec::as_slice)
        }
        let is_same =
            |(a, b): (&[f64], &[f64])| a.iter().map(|x| x.to_bits()).eq(b.iter().map(|x| x.to_bits()));
        columns(self).into_iter().zip(columns(other)).all(is_same)
    }

    /// For the elements.
    pub(crate) fn at(&self) -> At<'_> {
        At { displacement: &self.displacement, history: &self.history }
    }
}

/// From where to where a step goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Span {
    /// Length, s; infinite for statics.
    pub(crate) dt: f64,
    /// Loads at its end.
    pub(crate) when: When,
}

/// Counts for the report.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Counts {
    /// Steps asked for.
    pub steps: u64,
    /// Sub-steps taken in them.
    pub substeps: u64,
    /// Sub-steps in which the prediction stood.
    pub skipped: u64,
    /// Steps slept through: nothing was computed at all.
    pub slept: u64,
    /// Attempts that failed and were repeated with half the step.
    pub halvings: u64,
    /// Newton iterations.
    pub newton_iterations: u64,
    /// Tangents assembled.
    pub tangents: u64,
    /// Factorisations.
    pub factorizations: u64,
    /// Iterations of the conjugate gradients.
    pub linear_iterations: u64,
}
