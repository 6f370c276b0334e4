//! The lowest natural frequency by inverse iteration.

use crate::body::Body;
use crate::error::Trouble;
use crate::linear::cholesky::Cholesky;

/// Iterations; each reduces the error by the square of the ratio of the two lowest frequencies.
const ITERATIONS: usize = 60;

/// f of K x = (2 pi f)^2 M x with the tangent K at the body's state, Hz.
pub(crate) fn first(body: &mut Body) -> Result<f64, Trouble> {
    let stiffness = body.stiffness_at_state()?;
    let mut factor = Cholesky::new(&stiffness.pattern);
    factor.factorize(stiffness).map_err(|_| Trouble::Indefinite)?;
    let size = body.fixed.len();
    // No symmetry that an eigenvector could be orthogonal to.
    let mut shape: Vec<f64> = (0..size).map(|i| 1.0 + (i as f64 * 0.7).sin()).collect();
    let mut momentum = vec![0.0; size];
    let mut eigenvalue = 0.0;
    for _ in 0..ITERATIONS {
        clear(&mut shape, &body.fixed);
        body.mass.multiply(&shape, &mut momentum);
        clear(&mut momentum, &body.fixed);
        let size = dot(&shape, &momentum).sqrt();
        momentum.iter_mut().for_each(|value| *value /= size);
        shape.copy_from_slice(&momentum);
        factor.solve(&mut shape);
        // Rayleigh's quotient of the new shape x; K x is known from the solve.
        let energy = dot(&shape, &momentum);
        body.mass.multiply(&shape, &mut momentum);
        let rayleigh = energy / dot(&shape, &momentum);
        let is_settled = (rayleigh - eigenvalue).abs() <= 1e-10 * rayleigh;
        eigenvalue = rayleigh;
        if is_settled {
            break;
        }
    }
    Ok(eigenvalue.sqrt() / std::f64::consts::TAU)
}

fn clear(values: &mut [f64], fixed: &[bool]) {
    values.iter_mut().zip(fixed).filter(|(_, fixed)| **fixed).for_each(|(value, _)| *value = 0.0);
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
