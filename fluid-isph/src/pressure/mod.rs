//! The pressure equation: matrix, preconditioner, solver.

pub mod conjugate_gradient;
pub mod incomplete_cholesky;
pub mod matrix;
pub mod multigrid;
pub mod preconditioner;
