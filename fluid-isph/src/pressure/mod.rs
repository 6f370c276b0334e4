//! The pressure equation: matrix, preconditioner, solver.

pub mod conjugate_gradient;
pub mod matrix;
pub mod multigrid;
