//! Interface quasi-Newton with the inverse Jacobian from a least-squares model (IQN-ILS).
//!
//! From the changes of the residual, V, and of the solid's answer, W, in the passes so far (of the last steps as well),
//! x <- x~ + W c with c = argmin |V c + r|: the change of x~ that goes with -r, as far as V can tell. The newest changes
//! come first in the orthogonalisation; those that add nothing new are filtered out.
//!
//! Source: Degroote, Bathe & Vierendeels, Comput. Struct. 87, 2009; filter: Haelterman et al., Comput. Struct. 171, 2016.

use std::collections::VecDeque;

use super::{dot, relax};

/// A column whose part orthogonal to the newer ones is smaller than this, relative to itself, is left out.
const FILTER: f64 = 1e-6;

/// What is taken over from step to step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reuse {
    /// Steps whose changes serve the next ones.
    pub steps: usize,
    /// Relaxation where nothing is known yet.
    pub first_relaxation: f64,
}

/// One change from a pass to the next.
#[derive(Debug, Clone)]
struct Change {
    residual: Vec<f64>,
    answer: Vec<f64>,
}

/// Its memory.
#[derive(Debug, Clone)]
pub struct IqnIls {
    reuse: Reuse,
    /// Newest first.
    changes: VecDeque<Change>,
    /// Number of changes of the current step, and of the steps before, newest first.
    in_step: usize,
    in_past: VecDeque<usize>,
    last: Option<Change>,
}

impl IqnIls {
    /// Without memory.
    pub fn new(reuse: Reuse) -> Self {
        Self { reuse, changes: VecDeque::new(), in_step: 0, in_past: VecDeque::new(), last: None }
    }

    pub(super) fn improve(&mut self, guess: &mut [f64], found: &[f64]) {
        let residual: Vec<f64> = found.iter().zip(guess.iter()).map(|(found, x)| found - x).collect();
        if let Some(last) = &self.last {
            let minus = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect();
            let change =
                Change { residual: minus(&residual, &last.residual), answer: minus(found, &last.answer) };
            self.changes.push_front(change);
            self.in_step += 1;
            // The past misled: it belongs to another state of the water, dry or not under pressure.
            if dot(&residual, &residual) > dot(&last.residual, &last.residual) {
                self.changes.truncate(self.in_step);
                self.in_past.clear();
            }
        }
        match self.step_of_the_answer(&residual) {
            Some(step) => guess.iter_mut().zip(found.iter().zip(step)).for_each(|(x, (f, s))| *x = f + s),
            None => relax(guess, found, self.reuse.first_relaxation),
        }
        self.last = Some(Change { residual, answer: found.to_vec() });
    }

    /// W c with c = argmin |V c + r|; `None` where nothing is known.
    fn step_of_the_answer(&self, residual: &[f64]) -> Option<Vec<f64>> {
        // Modified Gram-Schmidt on V; W goes through the same combinations, so that W c = -sum (q.r) w.
        let mut basis: Vec<Change> = Vec::new();
        for change in &self.changes {
            if basis.len() == residual.len() {
                break;
            }
            let mut column = change.clone();
            let size = dot(&column.residual, &column.residual).sqrt();
            for earlier in &basis {
                let share = dot(&earlier.residual, &column.residual);
                subtract(&mut column.residual, share, &earlier.residual);
                subtract(&mut column.answer, share, &earlier.answer);
            }
            let length = dot(&column.residual, &column.residual).sqrt();
            if length > FILTER * size {
                column.residual.iter_mut().chain(&mut column.answer).for_each(|value| *value /= length);
                basis.push(column);
            }
        }
        if basis.is_empty() {
            return None;
        }
        let mut step = vec![0.0; residual.len()];
        for column in &basis {
            subtract(&mut step, dot(&column.residual, residual), &column.answer);
        }
        Some(step)
    }

    pub(super) fn end_step(&mut self) {
        self.last = None;
        // Steps that taught nothing do not push out those that did.
        if self.in_step > 0 {
            self.in_past.push_front(std::mem::take(&mut self.in_step));
        }
        self.in_past.truncate(self.reuse.steps);
        self.changes.truncate(self.in_past.iter().sum());
    }
}

/// target -= share * column.
fn subtract(target: &mut [f64], share: f64, column: &[f64]) {
    for (target, value) in target.iter_mut().zip(column) {
        *target -= share * value;
    }
}
