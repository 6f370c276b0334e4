//! Linear systems: Jacobi-preconditioned conjugate gradients for systems that the mass dominates, a sparse Cholesky
//! factor for stiff ones, kept as preconditioner while it serves.

pub mod block_matrix;
pub mod cholesky;
pub mod conjugate_gradient;
mod ordering;
pub mod vector;

use block_matrix::{BlockMatrix, BlockPattern};
use cholesky::Cholesky;
use conjugate_gradient::ConjugateGradient;

use crate::error::Trouble;

/// Below this number of nodes vectors and products are done by one thread: handing out costs more.
pub(crate) const PARALLEL_NODES: usize = 2000;

/// Courant number of the longitudinal wave, c dt / h, above which a factor is cheaper than Jacobi iterations (measured
/// at 20 k unknowns: 12 iterations at 0.5, 69 at 5, 580 at 50).
pub const FACTOR_ABOVE_COURANT: f64 = 20.0;

/// Iterations a kept factor may need as preconditioner before it is made anew.
const KEEP_BELOW_ITERATIONS: u32 = 10;

/// Iteration limit of the conjugate gradients.
const MAX_ITERATIONS: u32 = 2000;

/// Which way a system is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinearMethod {
    /// Conjugate gradients with the diagonal as preconditioner.
    JacobiConjugateGradient,
    /// Sparse Cholesky factor.
    Cholesky,
}

impl LinearMethod {
    /// The choice for a Courant number c dt / h.
    pub fn for_courant(courant: f64) -> Self {
        if courant < FACTOR_ABOVE_COURANT { Self::JacobiConjugateGradient } else { Self::Cholesky }
    }

    /// Its name in the plan.
    pub fn name(self) -> &'static str {
        match self {
            Self::JacobiConjugateGradient => "Jacobi-preconditioned conjugate gradients",
            Self::Cholesky => "sparse Cholesky factor",
        }
    }
}

/// The solver and what it keeps.
pub(crate) struct LinearSolver {
    gradient: ConjugateGradient,
    /// Of the nodes, for the ordering of the factor.
    position: Vec<f64>,
    diagonal: Vec<f64>,
    factor: Option<Box<Cholesky>>,
    factor_serves: bool,
    /// Sum of iterations, for the report.
    pub(crate) iterations: u64,
    /// Factorisations, for the report.
    pub(crate) factorizations: u64,
}

impl LinearSolver {
    pub(crate) fn new(pattern: &BlockPattern, position: &[f64]) -> Self {
        let size = pattern.node_count() * pattern.dimension;
        Self {
            gradient: ConjugateGradient::new(size),
            position: position.to_vec(),
            diagonal: vec![1.0; size],
            factor: None,
            factor_serves: false,
            iterations: 0,
            factorizations: 0,
        }
    }

    /// Makes the old factor no longer serve, after a large change of the matrix.
    pub(crate) fn forget(&mut self) {
        self.factor_serves = false;
    }

    /// The values of the factor, where one serves.
    pub(crate) fn factor(&self) -> Option<&[f64]> {
        self.factor.as_ref().filter(|_| self.factor_serves).map(|factor| factor.values())
    }

    /// Takes the values of a factor on the same pattern; without them none serves.
    pub(crate) fn set_factor(&mut self, pattern: &BlockPattern, values: Option<Vec<f64>>) {
        self.factor_serves = values.is_some();
        if let Some(values) = values {
            let factor = self.factor.get_or_insert_with(|| Box::new(Cholesky::new(pattern, &self.position)));
            factor.set_values(values);
        }
    }

    /// Solves A x = b to a relative tolerance.
    pub(crate) fn solve(
        &mut self,
        method: LinearMethod,
        matrix: &BlockMatrix,
        right_hand_side: &[f64],
        solution: &mut [f64],
        tolerance: f64,
    ) -> Result<(), Trouble> {
        match method {
            LinearMethod::JacobiConjugateGradient => {
                self.solve_with_diagonal(matrix, right_hand_side, solution, tolerance)
            }
            LinearMethod::Cholesky => self.solve_with_factor(matrix, right_hand_side, solution, tolerance),
        }
    }

    fn solve_with_diagonal(
        &mut self,
        matrix: &BlockMatrix,
        right_hand_side: &[f64],
        solution: &mut [f64],
        tolerance: f64,
    ) -> Result<(), Trouble> {
        matrix.diagonal(&mut self.diagonal);
        if self.diagonal.iter().any(|&value| value <= 0.0 || value.is_nan()) {
            return Err(Trouble::Indefinite);
        }
        let diagonal = &self.diagonal;
        let precondition = |from: &[f64], to: &mut [f64]| {
            for i in 0..to.len() {
                to[i] = from[i] / diagonal[i];
            }
        };
        let limits = (tolerance, MAX_ITERATIONS);
        let end = self.gradient.solve(matrix, precondition, right_hand_side, solution, limits);
        self.iterations += u64::from(end.iterations);
        match (end.is_converged, end.is_indefinite) {
            (true, _) => Ok(()),
            (false, true) => Err(Trouble::Indefinite),
            (false, false) => Err(Trouble::LinearStalled { residual: end.residual, limit: tolerance }),
        }
    }

    fn solve_with_factor(
        &mut self,
        matrix: &BlockMatrix,
        right_hand_side: &[f64],
        solution: &mut [f64],
        tolerance: f64,
    ) -> Result<(), Trouble> {
        let factor =
            self.factor.get_or_insert_with(|| Box::new(Cholesky::new(&matrix.pattern, &self.position)));
        if self.factor_serves {
            let precondition = |from: &[f64], to: &mut [f64]| {
                to.copy_from_slice(from);
                factor.solve(to);
            };
            let limits = (tolerance, KEEP_BELOW_ITERATIONS);
            let end = self.gradient.solve(matrix, precondition, right_hand_side, solution, limits);
            self.iterations += u64::from(end.iterations);
            if end.is_converged {
                return Ok(());
            }
        }
        self.factor_serves = false;
        factor.factorize(matrix).map_err(|_| Trouble::Indefinite)?;
        self.factor_serves = true;
        self.factorizations += 1;
        solution.copy_from_slice(right_hand_side);
        factor.solve(solution);
        Ok(())
    }
}
