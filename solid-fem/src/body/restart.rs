//! The whole state of a body in a file, and a body that goes on from it.

use serde::{Deserialize, Serialize};

use super::Body;
use crate::state::{Counts, State};

/// What the next step follows from, and what is counted over the whole run.
///
/// The tangent and its factor are kept over many steps; made anew at the state they would lead to another residual below
/// the tolerance, and so to other bits.
#[derive(Serialize, Deserialize)]
pub(crate) struct Whole {
    state: State,
    load: (Vec<f64>, Vec<f64>),
    has_traction: bool,
    is_resting: bool,
    counts: Counts,
    stiffness: Vec<f64>,
    stiffness_diagonal: Vec<f64>,
    tangent_serves: bool,
    factor: Option<Vec<f64>>,
}

impl Body {
    /// The state at the end of a step.
    pub(crate) fn keep(&self) -> Whole {
        let mut load = (Vec::new(), Vec::new());
        self.loads.save(&mut load);
        Whole {
            state: self.state.clone(),
            load,
            has_traction: self.loads.has_traction,
            is_resting: self.is_resting,
            counts: self.counts,
            stiffness: self.stiffness.values.clone(),
            stiffness_diagonal: self.stiffness_diagonal.clone(),
            tangent_serves: self.tangent_serves,
            factor: self.linear.factor().map(<[f64]>::to_vec),
        }
    }

    /// Goes on from the state of a body of the same mesh and elements.
    pub(crate) fn take_up(&mut self, whole: Whole) {
        self.state = whole.state;
        self.loads.restore(&whole.load);
        self.loads.has_traction = whole.has_traction;
        self.is_resting = whole.is_resting;
        self.counts = whole.counts;
        self.stiffness.values = whole.stiffness;
        self.stiffness_diagonal = whole.stiffness_diagonal;
        self.tangent_serves = whole.tangent_serves;
        self.combined = None;
        let pattern = &self.system.pattern;
        self.linear.set_factor(pattern, whole.factor);
        (self.linear.iterations, self.linear.factorizations) =
            (whole.counts.linear_iterations, whole.counts.factorizations);
    }
}
