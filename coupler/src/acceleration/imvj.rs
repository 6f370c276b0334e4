//! Interface quasi-Newton with a multi-vector inverse Jacobian (IMVJ).
//!
//! As IQN-ILS within a step, but what earlier steps have taught is kept as a Jacobian J (of the answer with respect to
//! the residual) and corrected by each step only where the step has looked: with orthonormal changes of the residual q
//! and their answers w, J <- J + sum (w - J q) q', and x <- x~ - J r. J is kept as the list of its terms, those of the
//! oldest steps dropped, so that its cost grows with the passes and not with the square of the interface.
//!
//! Source: Bogaers, Kok, Reddy & Franz, Comput. Methods Appl. Mech. Eng. 279, 2014; list of terms: Scheufele & Mehl,
//! SIAM J. Sci. Comput. 39, 2017.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::change::{Basis, Change, LastPass, subtract_known};
use super::{Reuse, relax, residual_of};

/// Its memory.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Imvj {
    reuse: Reuse,
    /// q and w - J q of the steps before, newest first.
    terms: VecDeque<Change>,
    /// Number of terms of each of them, newest first.
    in_past: VecDeque<usize>,
    /// The same of the current step.
    #[serde(skip)]
    basis: Basis,
    #[serde(skip)]
    last: LastPass,
    #[serde(skip)]
    change: Change,
    #[serde(skip)]
    residual: Vec<f64>,
    /// Room of terms given up.
    #[serde(skip)]
    spare: Vec<Change>,
}

impl Imvj {
    /// Without memory.
    pub fn new(reuse: Reuse) -> Self {
        let (terms, in_past) = (VecDeque::new(), VecDeque::new());
        let (basis, last, change) = (Basis::default(), LastPass::default(), Change::default());
        Self { reuse, terms, in_past, basis, last, change, residual: Vec::new(), spare: Vec::new() }
    }

    pub(super) fn improve(&mut self, guess: &mut [f64], found: &[f64]) {
        residual_of(guess, found, &mut self.residual);
        if let Some(has_grown) = self.last.change(&self.residual, found, &mut self.change) {
            // The past misled: it belongs to another state of the water, dry or not under pressure.
            if has_grown {
                self.forget();
            }
            let Change { residual, answer } = &mut self.change;
            subtract_known(&self.terms, residual, answer);
            self.basis.add(&self.change);
        }
        if self.basis.columns().is_empty() && self.terms.is_empty() {
            return relax(guess, found, self.reuse.first_relaxation);
        }
        guess.copy_from_slice(found);
        subtract_known(self.basis.columns().iter().chain(&self.terms), &self.residual, guess);
    }

    pub(super) fn take_up(&mut self, kept: Self) {
        (self.terms, self.in_past) = (kept.terms, kept.in_past);
    }

    fn forget(&mut self) {
        self.spare.extend(self.terms.drain(..));
        self.in_past.clear();
        self.basis.clear();
    }

    pub(super) fn end_step(&mut self) {
        self.last.forget();
        let learnt = self.basis.columns();
        if !learnt.is_empty() {
            self.in_past.push_front(learnt.len());
        }
        for column in learnt {
            let mut term = self.spare.pop().unwrap_or_default();
            term.copy(column);
            self.terms.push_front(term);
        }
        self.basis.clear();
        self.in_past.truncate(self.reuse.steps);
        let kept = self.in_past.iter().sum::<usize>().min(self.terms.len());
        self.spare.extend(self.terms.drain(kept..));
    }
}
