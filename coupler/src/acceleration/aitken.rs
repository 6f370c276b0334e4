//! Aitken's relaxation for vectors: omega_k = -omega_(k-1) r_(k-1).(r_k - r_(k-1)) / |r_k - r_(k-1)|^2.
//!
//! Source: Irons & Tuck, Int. J. Numer. Meth. Eng. 1, 1969; Kuettler & Wall, Comput. Mech. 43, 2008.

use serde::{Deserialize, Serialize};

use super::relax;

/// Its memory within a step.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Aitken {
    first: f64,
    relaxation: f64,
    /// Of the last pass; empty before the second one.
    residual: Vec<f64>,
}

impl Aitken {
    /// `first` is omega of the first correction; later steps begin with the last one of the step before, at most this.
    pub fn new(first: f64) -> Self {
        Self { first, relaxation: first, residual: Vec::new() }
    }

    pub(super) fn improve(&mut self, guess: &mut [f64], found: &[f64]) {
        let residuals = || found.iter().zip(guess.iter()).map(|(found, x)| found - x);
        if self.residual.is_empty() {
            self.relaxation = self.relaxation.clamp(-self.first, self.first);
            self.residual.extend(residuals());
        } else {
            let (mut product, mut square) = (0.0, 0.0);
            for (old, new) in self.residual.iter_mut().zip(residuals()) {
                product += *old * (new - *old);
                square += (new - *old) * (new - *old);
                *old = new;
            }
            if square > 0.0 {
                self.relaxation *= -product / square;
            }
        }
        relax(guess, found, self.relaxation);
    }

    pub(super) fn take_up(&mut self, kept: Self) {
        self.relaxation = kept.relaxation;
    }

    pub(super) fn end_step(&mut self) {
        self.residual.clear();
    }
}
