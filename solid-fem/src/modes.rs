//! The lowest natural frequencies and their shapes by subspace iteration over the Cholesky factor.
//!
//! Source: K.-J. Bathe and E. L. Wilson, Numer. Math. 23 (1973) 385. Each pass multiplies the subspace by K^-1 M and
//! takes the best approximations within it (Rayleigh and Ritz); an error falls by (lambda / lambda_p+1)^2 a pass, p being
//! the size of the subspace.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::body::Body;
use crate::error::Trouble;
use crate::linear::cholesky::Cholesky;

/// Most passes.
const PASSES: usize = 200;

/// Relative change of an eigenvalue below which it is found.
const TOLERANCE: f64 = 1e-10;

/// A natural vibration of the body about its present state.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    /// Hz.
    pub frequency: f64,
    /// Displacement, `[n, D]`; the greatest component is 1 m.
    pub shape: Vec<f64>,
}

/// The `count` lowest modes of K x = (2 pi f)^2 M x with the tangent K at the body's state.
pub(crate) fn lowest(body: &mut Body, count: usize) -> Result<Vec<Mode>, Trouble> {
    let free = body.fixed.iter().filter(|fixed| !**fixed).count();
    if free == 0 {
        return Ok(Vec::new());
    }
    let position = body.assembly.mesh.reference_position.clone();
    let stiffness = body.stiffness_at_state()?;
    let mut factor = Cholesky::new(&stiffness.pattern, &position);
    factor.factorize(stiffness).map_err(|_| Trouble::Indefinite)?;
    let size = (2 * count).min(count + 8).max(count + 2).min(free);
    let mut space = Subspace::new(body, size);
    let mut values = vec![0.0; size];
    for _ in 0..PASSES {
        let next = space.iterate(body, &mut factor)?;
        let is_settled =
            next.iter().zip(&values).take(count).all(|(next, old)| (next - old).abs() <= TOLERANCE * next);
        values = next;
        if is_settled {
            break;
        }
    }
    let modes = values.iter().zip(space.shape).take(count);
    Ok(modes.map(|(value, shape)| Mode::new(value.sqrt() / std::f64::consts::TAU, shape)).collect())
}

impl Mode {
    fn new(frequency: f64, mut shape: Vec<f64>) -> Self {
        let greatest = shape.iter().fold(0.0f64, |a, &b| if b.abs() > a.abs() { b } else { a });
        shape.iter_mut().for_each(|value| *value /= greatest);
        Self { frequency, shape }
    }
}

/// Vectors `[size][n D]`: approximations of the shapes, and M times them.
struct Subspace {
    shape: Vec<Vec<f64>>,
    momentum: Vec<Vec<f64>>,
}

impl Subspace {
    /// Starts from vectors without a symmetry that a shape could be orthogonal to.
    fn new(body: &mut Body, size: usize) -> Self {
        let length = body.fixed.len();
        let value = |order: usize, i: usize| match order {
            0 => 1.0 + (i as f64 * 0.7).sin(),
            _ => (i as f64 * (0.31 + 0.57 * order as f64)).sin(),
        };
        let shape = |order: usize| (0..length).map(|i| value(order, i)).collect::<Vec<f64>>();
        let mut space =
            Self { shape: (0..size).map(shape).collect(), momentum: vec![vec![0.0; length]; size] };
        space.find_momenta(body);
        space
    }

    fn find_momenta(&mut self, body: &Body) {
        for (shape, momentum) in self.shape.iter_mut().zip(&mut self.momentum) {
            clear(shape, &body.fixed);
            body.mass.multiply(shape, momentum);
            clear(momentum, &body.fixed);
        }
    }

    /// X <- K^-1 M X, rotated to the Ritz vectors; gives their values (2 pi f)^2, ascending.
    fn iterate(&mut self, body: &Body, factor: &mut Cholesky) -> Result<Vec<f64>, Trouble> {
        let size = self.shape.len();
        for (shape, momentum) in self.shape.iter_mut().zip(&self.momentum) {
            shape.copy_from_slice(momentum);
            factor.solve(shape);
        }
        // K X is the M X of the last pass.
        let stiffness = DMatrix::from_fn(size, size, |i, j| dot(&self.shape[i], &self.momentum[j]));
        self.find_momenta(body);
        let mass = DMatrix::from_fn(size, size, |i, j| dot(&self.shape[i], &self.momentum[j]));
        // With M = L L' the values of K x = lambda M x are those of L^-1 K L^-T.
        let root = mass.cholesky().ok_or(Trouble::NonFinite)?.l();
        let inverse = root.try_inverse().ok_or(Trouble::NonFinite)?;
        let reduced = &inverse * stiffness * inverse.transpose();
        let eigen = SymmetricEigen::new(0.5 * (&reduced + reduced.transpose()));
        let vectors = inverse.transpose() * &eigen.eigenvectors;
        let mut order: Vec<usize> = (0..size).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let turn = |columns: &[Vec<f64>]| -> Vec<Vec<f64>> {
            let sum =
                |to: usize, i: usize| (0..size).map(|from| vectors[(from, to)] * columns[from][i]).sum();
            order.iter().map(|&to| (0..columns[0].len()).map(|i| sum(to, i)).collect()).collect()
        };
        (self.shape, self.momentum) = (turn(&self.shape), turn(&self.momentum));
        Ok(order.iter().map(|&a| eigen.eigenvalues[a]).collect())
    }
}

fn clear(values: &mut [f64], fixed: &[bool]) {
    values.iter_mut().zip(fixed).filter(|(_, fixed)| **fixed).for_each(|(value, _)| *value = 0.0);
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
