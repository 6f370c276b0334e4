//! Preconditioned conjugate gradients (Hestenes & Stiefel 1952) for the pressure matrix, in single precision with
//! sums in double precision over fixed chunks.

use rayon::prelude::*;

use super::matrix::PressureMatrix;
use super::preconditioner::Preconditioner;
use crate::error::StepFault;
use crate::parallel::{CHUNK, LIGHT, chunk_count, dot_product};
use crate::particles::Water;

/// More iterations than any scene that converges has needed (tens).
const ITERATION_LIMIT: u32 = 500;

/// Vectors of the iteration; memory is kept from step to step.
#[derive(Debug, Default)]
pub struct ConjugateGradient {
    residual: Vec<f32>,
    direction: Vec<f32>,
    image: Vec<f32>,
    preconditioned: Vec<f32>,
    partial: Vec<f64>,
}

/// When a solve is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Largest |r| / |b|.
    pub tolerance: f64,
    /// A right side with |b| up to this is what rounding leaves of zero, and its answer is zero, Pa/m2.
    pub rounding: f64,
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solved {
    /// Iterations.
    pub iterations: u32,
    /// |r| / |b|.
    pub residual: f64,
}

impl ConjugateGradient {
    /// Solves A p = b from the first guess in `pressure` until |r| <= tolerance |b|; p = 0 for a b of mere rounding.
    ///
    /// # Errors
    /// [`StepFault::PressureSolveStalled`] after 500 iterations, [`StepFault::NonFinite`].
    pub fn solve<const D: usize>(
        &mut self,
        (water, matrix, preconditioner): (&Water<D>, &PressureMatrix, &mut Preconditioner<D>),
        source: &[f32],
        pressure: &mut [f32],
        Accuracy { tolerance, rounding }: Accuracy,
    ) -> Result<Solved, StepFault> {
        self.resize(source.len());
        let source_norm = sum_of_squares(source, &mut self.partial).sqrt();
        if !source_norm.is_finite() {
            return Err(StepFault::NonFinite { what: "source of the pressure equation" });
        }
        if source_norm <= rounding {
            pressure.fill(0.0);
            return Ok(Solved { iterations: 0, residual: 0.0 });
        }
        matrix.multiply(pressure, &mut self.image, &mut self.partial);
        self.residual.copy_from_slice(source);
        // A step of length 1 along the first guess, which is already in the pressure.
        let mut norm = self.advance_residual(1.0).sqrt();
        let mut rho = 0.0;
        for iterations in 0..ITERATION_LIMIT {
            let residual = norm / source_norm;
            if residual <= tolerance {
                return Ok(Solved { iterations, residual });
            }
            if !residual.is_finite() {
                return Err(StepFault::NonFinite { what: "pressure" });
            }
            let columns = (&self.residual[..], &mut self.preconditioned[..]);
            let last_rho = rho;
            rho = preconditioner.apply((water, matrix), columns.0, columns.1, &mut self.partial);
            let beta = if iterations == 0 { 0.0 } else { (rho / last_rho) as f32 };
            self.turn(beta);
            let curvature = matrix.multiply(&self.direction, &mut self.image, &mut self.partial);
            norm = self.advance(pressure, (rho / curvature) as f32).sqrt();
        }
        let residual = norm / source_norm;
        Err(StepFault::PressureSolveStalled { iterations: ITERATION_LIMIT, residual, tolerance })
    }

    fn resize(&mut self, count: usize) {
        for column in [&mut self.residual, &mut self.direction, &mut self.image, &mut self.preconditioned] {
            column.resize(count, 0.0);
        }
        self.partial.resize(chunk_count(count), 0.0);
    }

    /// direction = preconditioned + beta direction.
    fn turn(&mut self, beta: f32) {
        let columns = self.direction.par_chunks_mut(CHUNK).zip(self.preconditioned.par_chunks(CHUNK));
        columns.with_min_len(LIGHT).for_each(|(direction, z)| {
            for (direction, &z) in direction.iter_mut().zip(z) {
                *direction = z + beta * *direction;
            }
        });
    }

    /// residual -= step image; returns |residual|^2.
    fn advance_residual(&mut self, step: f32) -> f64 {
        let columns = (self.residual.par_chunks_mut(CHUNK), self.image.par_chunks(CHUNK));
        let columns = (columns, self.partial.par_iter_mut()).into_par_iter();
        columns.with_min_len(LIGHT).for_each(|((residual, image), partial)| {
            for (residual, image) in residual.iter_mut().zip(image) {
                *residual -= step * image;
            }
            *partial = dot_product(residual, residual);
        });
        self.partial.iter().sum()
    }

    /// pressure += step direction, residual -= step image; returns |residual|^2.
    fn advance(&mut self, pressure: &mut [f32], step: f32) -> f64 {
        let columns = pressure.par_chunks_mut(CHUNK).zip(self.direction.par_chunks(CHUNK));
        columns.with_min_len(LIGHT).for_each(|(pressure, direction)| {
            for (pressure, direction) in pressure.iter_mut().zip(direction) {
                *pressure += step * direction;
            }
        });
        self.advance_residual(step)
    }
}

fn sum_of_squares(column: &[f32], partial: &mut [f64]) -> f64 {
    column.par_chunks(CHUNK).zip(partial.par_iter_mut()).with_min_len(LIGHT).for_each(|(column, partial)| {
        *partial = dot_product(column, column);
    });
    partial.iter().sum()
}
