//! Aitken's relaxation for vectors: omega_k = -omega_(k-1) r_(k-1).(r_k - r_(k-1)) / |r_k - r_(k-1)|^2.
//!
//! Source: Irons & Tuck, Int. J. Numer. Meth. Eng. 1, 1969; Kuettler & Wall, Comput. Mech. 43, 2008.

use super::{dot, relax};

/// Its memory within a step.
#[derive(Debug, Clone)]
pub struct Aitken {
    first: f64,
    relaxation: f64,
    residual: Vec<f64>,
}

impl Aitken {
    /// `first` is omega of the first correction; later steps begin with the last one of the step before, at most this.
    pub fn new(first: f64) -> Self {
        Self { first, relaxation: first, residual: Vec::new() }
    }

    pub(super) fn improve(&mut self, guess: &mut [f64], found: &[f64]) {
        let residual: Vec<f64> = found.iter().zip(guess.iter()).map(|(found, x)| found - x).collect();
        if self.residual.is_empty() {
            self.relaxation = self.relaxation.clamp(-self.first, self.first);
        } else {
            let change: Vec<f64> = residual.iter().zip(&self.residual).map(|(new, old)| new - old).collect();
            let square = dot(&change, &change);
            if square > 0.0 {
                self.relaxation *= -dot(&self.residual, &change) / square;
            }
        }
        self.residual = residual;
        relax(guess, found, self.relaxation);
    }

    pub(super) fn end_step(&mut self) {
        self.residual.clear();
    }
}
