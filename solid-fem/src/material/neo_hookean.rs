//! Compressible neo-Hookean elasticity: W = mu (tr C - 3 - 2 ln J)/2 + lambda (ln J)^2 / 2,
//! S = mu (I - C^-1) + lambda ln J C^-1.
//!
//! Resists crushing without bound, where St.Venant-Kirchhoff softens; the same two constants at small strain. Source:
//! J. Bonet and R. D. Wood, Nonlinear Continuum Mechanics for Finite Element Analysis (2008), 6.4.3.

use super::tensor::{PAIRS, UNIT, of_strain, product, voigt};
use super::{History, Law, Response, StVenantKirchhoff, Unsolvable};
use crate::element::matrix::{determinant, inverse};

/// The law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeoHookean {
    elastic: StVenantKirchhoff,
}

impl NeoHookean {
    /// With the constants of small strain.
    pub fn new(elastic: StVenantKirchhoff) -> Self {
        Self { elastic }
    }
}

/// det(I + 2E) - 1 without losing the digits of a small E.
fn dilation(strain: &[[f64; 3]; 3]) -> f64 {
    let e = strain;
    let trace = e[0][0] + e[1][1] + e[2][2];
    let minor = |i: usize, j: usize| e[i][i] * e[j][j] - e[i][j] * e[i][j];
    2.0 * trace + 4.0 * (minor(0, 1) + minor(1, 2) + minor(2, 0)) + 8.0 * determinant(e)
}

impl Law for NeoHookean {
    fn response(&self, strain: &[f64; 6], _: History<'_>) -> Result<Response, Unsolvable> {
        let (lambda, mu) = (self.elastic.lambda, self.elastic.mu);
        let e = of_strain(strain);
        let dilation = dilation(&e);
        if dilation <= -1.0 || dilation.is_nan() {
            return Err(Unsolvable);
        }
        let log = 0.5 * dilation.ln_1p();
        let c: [[f64; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| UNIT[i][j] + 2.0 * e[i][j]));
        let inverse = inverse(&c);
        // I - C^-1 = 2 C^-1 E keeps the digits of small strains.
        let deviation = voigt(&product(&inverse, &e));
        let flat = voigt(&inverse);
        let stress = std::array::from_fn(|s| 2.0 * mu * deviation[s] + lambda * log * flat[s]);
        let shear = mu - lambda * log;
        let moduli = std::array::from_fn(|s| {
            std::array::from_fn(|t| {
                let ((i, j), (k, l)) = (PAIRS[s], PAIRS[t]);
                let crossed = inverse[i][k] * inverse[j][l] + inverse[i][l] * inverse[j][k];
                lambda * flat[s] * flat[t] + shear * crossed
            })
        });
        Ok((stress, moduli))
    }

    fn energy_density(&self, strain: &[f64; 6], _: &[f64]) -> f64 {
        let e = of_strain(strain);
        let log = 0.5 * dilation(&e).ln_1p();
        let trace = e[0][0] + e[1][1] + e[2][2];
        self.elastic.mu * (trace - log) + 0.5 * self.elastic.lambda * log * log
    }
}
