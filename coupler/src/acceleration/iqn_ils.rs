//! Interface quasi-Newton with the inverse Jacobian from a least-squares model (IQN-ILS).
//!
//! From the changes of the residual, V, and of the solid's answer, W, in the passes so far (of the last steps as well),
//! x <- x~ + W c with c = argmin |V c + r|: the change of x~ that goes with -r, as far as V can tell. The newest changes
//! come first in the orthogonalisation; those that add nothing new are filtered out.
//!
//! Source: Degroote, Bathe & Vierendeels, Comput. Struct. 87, 2009.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::change::{Basis, Change, LastPass, subtract_known};
use super::{relax, residual_of};

/// What is taken over from step to step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Reuse {
    /// Steps whose changes serve the next ones.
    pub steps: usize,
    /// Relaxation where nothing is known yet.
    pub first_relaxation: f64,
}

/// Its memory.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct IqnIls {
    reuse: Reuse,
    /// Newest first.
    changes: VecDeque<Change>,
    /// Number of changes of the current step, and of the steps before, newest first.
    in_step: usize,
    in_past: VecDeque<usize>,
    #[serde(skip)]
    last: LastPass,
    #[serde(skip)]
    residual: Vec<f64>,
    #[serde(skip)]
    basis: Basis,
    /// Room of changes given up.
    #[serde(skip)]
    spare: Vec<Change>,
}

impl IqnIls {
    /// Without memory.
    pub fn new(reuse: Reuse) -> Self {
        let (changes, in_past) = (VecDeque::new(), VecDeque::new());
        let (last, residual, basis) = (LastPass::default(), Vec::new(), Basis::default());
        Self { reuse, changes, in_step: 0, in_past, last, residual, basis, spare: Vec::new() }
    }

    pub(super) fn improve(&mut self, guess: &mut [f64], found: &[f64]) {
        residual_of(guess, found, &mut self.residual);
        let mut change = self.spare.pop().unwrap_or_default();
        match self.last.change(&self.residual, found, &mut change) {
            None => self.spare.push(change),
            Some(has_grown) => {
                self.changes.push_front(change);
                self.in_step += 1;
                // The past misled: it belongs to another state of the water, dry or not under pressure.
                if has_grown {
                    self.keep(self.in_step);
                    self.in_past.clear();
                }
            }
        }
        self.basis.clear();
        self.changes.iter().for_each(|change| self.basis.add(change));
        if self.basis.columns().is_empty() {
            return relax(guess, found, self.reuse.first_relaxation);
        }
        guess.copy_from_slice(found);
        subtract_known(self.basis.columns(), &self.residual, guess);
    }

    pub(super) fn take_up(&mut self, kept: Self) {
        (self.changes, self.in_past) = (kept.changes, kept.in_past);
    }

    fn keep(&mut self, count: usize) {
        self.spare.extend(self.changes.drain(count.min(self.changes.len())..));
    }

    pub(super) fn end_step(&mut self) {
        self.last.forget();
        // Steps that taught nothing do not push out those that did.
        if self.in_step > 0 {
            self.in_past.push_front(std::mem::take(&mut self.in_step));
        }
        self.in_past.truncate(self.reuse.steps);
        self.keep(self.in_past.iter().sum());
    }
}
