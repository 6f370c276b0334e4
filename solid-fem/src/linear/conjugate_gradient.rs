//! Preconditioned conjugate gradients (Hestenes and Stiefel 1952).

use super::block_matrix::BlockMatrix;
use super::vector::Summation;

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// Iterations taken.
    pub iterations: u32,
    /// Residual over the norm of the right-hand side, in the energy of the preconditioner.
    pub residual: f64,
    /// Whether the tolerance was met.
    pub is_converged: bool,
    /// Whether a direction of negative curvature was met.
    pub is_indefinite: bool,
}

/// Work vectors, `[n D]` each.
#[derive(Debug, Default, Clone)]
pub struct ConjugateGradient {
    residual: Vec<f64>,
    preconditioned: Vec<f64>,
    direction: Vec<f64>,
    image: Vec<f64>,
    summation: Summation,
}

impl ConjugateGradient {
    /// For systems of this size.
    pub fn new(size: usize) -> Self {
        let zeros = || vec![0.0; size];
        let summation = Summation::new(size);
        Self { residual: zeros(), preconditioned: zeros(), direction: zeros(), image: zeros(), summation }
    }

    /// Solves A x = b from x = 0 until the preconditioned residual has fallen by `tolerance`.
    pub fn solve(
        &mut self,
        matrix: &BlockMatrix,
        mut precondition: impl FnMut(&[f64], &mut [f64]),
        right_hand_side: &[f64],
        solution: &mut [f64],
        (tolerance, max_iterations): (f64, u32),
    ) -> Convergence {
        solution.fill(0.0);
        self.residual.copy_from_slice(right_hand_side);
        precondition(&self.residual, &mut self.preconditioned);
        self.direction.copy_from_slice(&self.preconditioned);
        let mut energy = self.summation.dot(&self.residual, &self.preconditioned);
        let start = energy;
        let mut convergence =
            Convergence { iterations: 0, residual: 1.0, is_converged: start == 0.0, is_indefinite: false };
        while !convergence.is_converged && convergence.iterations < max_iterations {
            matrix.multiply(&self.direction, &mut self.image);
            let curvature = self.summation.dot(&self.direction, &self.image);
            if curvature <= 0.0 || curvature.is_nan() {
                convergence.is_indefinite = true;
                break;
            }
            let length = energy / curvature;
            for i in 0..solution.len() {
                solution[i] += length * self.direction[i];
                self.residual[i] -= length * self.image[i];
            }
            precondition(&self.residual, &mut self.preconditioned);
            let next = self.summation.dot(&self.residual, &self.preconditioned);
            for i in 0..solution.len() {
                self.direction[i] = self.preconditioned[i] + next / energy * self.direction[i];
            }
            energy = next;
            convergence.iterations += 1;
            convergence.residual = (next.abs() / start).sqrt();
            convergence.is_converged = convergence.residual <= tolerance;
        }
        convergence
    }
}
