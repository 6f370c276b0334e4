//! The preconditioner of a scene: multigrid over cells, or the paper's incomplete Cholesky factors.

use super::incomplete_cholesky::IncompleteCholesky;
use super::matrix::PressureMatrix;
use super::multigrid::Multigrid;
use crate::cells::Grid;
use crate::particles::Water;
use crate::scene::PressureSolver;

/// What stands in for the inverse of the pressure matrix.
#[derive(Debug)]
pub enum Preconditioner<const D: usize> {
    /// One V-cycle over the cells beside the diagonal.
    Multigrid(Box<Multigrid<D>>),
    /// IC(0), of ICCG.
    IncompleteCholesky(Box<IncompleteCholesky>),
}

impl<const D: usize> Preconditioner<D> {
    /// The one a scene asks for.
    pub fn new(solver: PressureSolver) -> Self {
        match solver {
            PressureSolver::Multigrid => Self::Multigrid(Box::default()),
            PressureSolver::IncompleteCholesky => Self::IncompleteCholesky(Box::default()),
        }
    }

    /// Prepares it for the matrix of a sub-step.
    pub fn build(&mut self, grid: &Grid<D>, water: &Water<D>, matrix: &PressureMatrix) {
        match self {
            Self::Multigrid(multigrid) => multigrid.build(grid, water, matrix),
            Self::IncompleteCholesky(factors) => factors.build(matrix),
        }
    }

    /// z = M^-1 r; returns r . z. `partial` holds one value per chunk.
    pub fn apply(
        &mut self,
        system: (&Water<D>, &PressureMatrix),
        r: &[f32],
        z: &mut [f32],
        partial: &mut [f64],
    ) -> f64 {
        match self {
            Self::Multigrid(multigrid) => multigrid.apply(system, r, z, partial),
            Self::IncompleteCholesky(factors) => factors.apply(r, z),
        }
    }
}
