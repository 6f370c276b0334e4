//! J2 plasticity with isotropic hardening at finite strain: F = Fe Fp, Hencky's elastic law in the logarithmic strains
//! of Fe, associated flow by the exponential map. The return map in principal strains is then that of small strain.
//!
//! Source: J. C. Simo, Comput. Methods Appl. Mech. Eng. 99 (1992) 61; moduli after Bonet and Wood, Nonlinear Continuum
//! Mechanics for Finite Element Analysis (2008), 7.6. As the law is isotropic, the right stretch U = sqrt(I + 2E) stands
//! for F, so that stress and moduli are functions of E: be = U Cp^-1 U, S = U^-1 tau U^-1.
//!
//! History per point: the six components of Cp^-1 - I, and the equivalent plastic strain.

use super::tensor::{PAIRS, Tensor, compose, of_strain, of_stress, principal, product, voigt};
use super::{History, Law, Response, StVenantKirchhoff, Unsolvable};

/// Newton iterations of the return map; it converges in as many as the hardening has pieces.
const ITERATIONS: usize = 50;

/// Distance of squared stretches, relative, below which they count as equal.
const EQUAL: f64 = 1e-8;

/// The law.
#[derive(Debug, Clone, PartialEq)]
pub struct Plasticity {
    elastic: StVenantKirchhoff,
    /// Equivalent plastic strain and yield stress, Pa; linear between, constant after the last row.
    hardening: Vec<(f64, f64)>,
}

/// Trial state and what the return map made of it.
struct Returned {
    /// U^-1.
    back: Tensor,
    /// Axes and squared elastic stretches, less 1, of the trial state.
    axes: [[f64; 3]; 3],
    trial: [f64; 3],
    /// Elastic logarithmic strains after the return.
    strain: [f64; 3],
    /// Principal Kirchhoff stresses, Pa.
    stress: [f64; 3],
    /// d stress_a / d trial strain_b, Pa.
    moduli: Tensor,
    plastic_strain: f64,
}

impl Plasticity {
    /// With the elastic constants of small strain; rows of increasing plastic strain, the first at 0.
    pub fn new(elastic: StVenantKirchhoff, hardening: Vec<(f64, f64)>) -> Self {
        Self { elastic, hardening }
    }

    /// Yield stress, Pa, and its slope at an equivalent plastic strain.
    fn yield_stress(&self, plastic_strain: f64) -> (f64, f64) {
        let rows = &self.hardening;
        let after = rows.partition_point(|row| row.0 <= plastic_strain);
        match (after.checked_sub(1).map(|before| rows[before]), rows.get(after)) {
            (Some(low), Some(high)) => {
                let slope = (high.1 - low.1) / (high.0 - low.0);
                (low.1 + slope * (plastic_strain - low.0), slope)
            }
            (Some(last), None) => (last.1, 0.0),
            (None, first) => (first.map_or(f64::INFINITY, |row| row.1), 0.0),
        }
    }

    /// Increment of the equivalent plastic strain that brings the equivalent stress `trial`, Pa, back to yield.
    fn increment(&self, trial: f64, old: f64) -> Result<(f64, f64), Unsolvable> {
        let mut increment = 0.0;
        for _ in 0..ITERATIONS {
            let (limit, slope) = self.yield_stress(old + increment);
            let excess = trial - 3.0 * self.elastic.mu * increment - limit;
            if excess.abs() <= 1e-13 * trial {
                return Ok((increment, slope));
            }
            increment = (increment + excess / (3.0 * self.elastic.mu + slope)).max(0.0);
        }
        Err(Unsolvable)
    }

    fn return_map(&self, strain: &[f64; 6], old: &[f64]) -> Result<Returned, Unsolvable> {
        let e = of_strain(strain);
        let (values, axes) = principal(&e);
        if values.iter().any(|&value| value <= -0.5 || value.is_nan()) {
            return Err(Unsolvable);
        }
        let root = values.map(|value| (1.0 + 2.0 * value).sqrt());
        let (stretch, back) = (compose(&root, &axes), compose(&root.map(f64::recip), &axes));
        // be - I = 2E + U (Cp^-1 - I) U keeps the digits of small strains.
        let kept = of_stress(&std::array::from_fn(|s| old[s]));
        let turned = product(&product(&stretch, &kept), &stretch);
        let trial: Tensor = std::array::from_fn(|i| std::array::from_fn(|j| 2.0 * e[i][j] + turned[i][j]));
        let (trial, axes) = principal(&trial);
        if trial.iter().any(|&value| value <= -1.0 || value.is_nan()) {
            return Err(Unsolvable);
        }
        let logarithm = trial.map(|value| 0.5 * value.ln_1p());
        let mean = logarithm.iter().sum::<f64>() / 3.0;
        let (mu, bulk) = (self.elastic.mu, self.elastic.lambda + 2.0 / 3.0 * self.elastic.mu);
        let deviator = logarithm.map(|value| 2.0 * mu * (value - mean));
        let equivalent = (1.5 * deviator.iter().map(|s| s * s).sum::<f64>()).sqrt();
        let old_strain = old[6];
        let (increment, slope) = if equivalent > self.yield_stress(old_strain).0 {
            self.increment(equivalent, old_strain)?
        } else {
            (0.0, f64::INFINITY)
        };
        let kept = if increment > 0.0 { 1.0 - 3.0 * mu * increment / equivalent } else { 1.0 };
        let stress = deviator.map(|s| kept * s + 3.0 * bulk * mean);
        let strain = std::array::from_fn(|a| mean + kept * (logarithm[a] - mean));
        // Of the direction n = deviator / |deviator| and the radius: 2 mu (kept - d radius / d trial) n n.
        let square: f64 = deviator.iter().map(|s| s * s).sum();
        let along =
            if increment > 0.0 { 2.0 * mu * (kept - slope / (3.0 * mu + slope)) / square } else { 0.0 };
        let moduli = std::array::from_fn(|a| {
            std::array::from_fn(|b| {
                let unit = if a == b { 2.0 / 3.0 } else { -1.0 / 3.0 };
                bulk + 2.0 * mu * kept * unit - along * deviator[a] * deviator[b]
            })
        });
        let plastic_strain = old_strain + increment;
        Ok(Returned { back, axes, trial, strain, stress, moduli, plastic_strain })
    }
}

impl Returned {
    /// Cp^-1 - I = U^-1 (be - I) U^-1 + C^-1 - I with C^-1 - I = -2 C^-1 E.
    fn keep(&self, strain: &[f64; 6], new: &mut [f64]) {
        let elastic = compose(&self.strain.map(|value| (2.0 * value).exp_m1()), &self.axes);
        let turned = product(&product(&self.back, &elastic), &self.back);
        let inverse = product(&self.back, &self.back);
        let shift = product(&inverse, &of_strain(strain));
        let kept = std::array::from_fn(|i| std::array::from_fn(|j| turned[i][j] - 2.0 * shift[i][j]));
        new[..6].copy_from_slice(&voigt(&kept));
        new[6] = self.plastic_strain;
    }

    /// Components of S and dS/dE: those of tau and of its spatial moduli in the trial axes, pulled back by U^-1.
    fn pull_back(&self) -> Response {
        // m_a = U^-1 n_a.
        let pulled: [[f64; 3]; 3] = std::array::from_fn(|a| {
            std::array::from_fn(|i| (0..3).map(|k| self.back[i][k] * self.axes[a][k]).sum())
        });
        let stress = voigt(&compose(&self.stress, &pulled));
        let dyad = |a: usize, b: usize| {
            PAIRS.map(|(i, j)| 0.5 * (pulled[a][i] * pulled[b][j] + pulled[a][j] * pulled[b][i]))
        };
        let mut moduli = [[0.0; 6]; 6];
        let mut add = |factor: f64, left: &[f64; 6], right: &[f64; 6]| {
            for s in 0..6 {
                for t in 0..6 {
                    moduli[s][t] += factor * left[s] * right[t];
                }
            }
        };
        for a in 0..3 {
            for b in 0..3 {
                let own = self.moduli[a][b] - if a == b { 2.0 * self.stress[a] } else { 0.0 };
                add(own, &dyad(a, a), &dyad(b, b));
                if a != b {
                    // Twice the symmetric dyad on both sides, halved as (a, b) and (b, a) are visited.
                    add(2.0 * self.shear(a, b), &dyad(a, b), &dyad(a, b));
                }
            }
        }
        (stress, moduli)
    }

    /// (tau_a lb2 - tau_b la2) / (la2 - lb2), and its limit for equal stretches.
    fn shear(&self, a: usize, b: usize) -> f64 {
        let (square_a, square_b) = (1.0 + self.trial[a], 1.0 + self.trial[b]);
        let distance = self.trial[a] - self.trial[b];
        if distance.abs() <= EQUAL * square_a {
            return 0.5 * (self.moduli[a][a] - self.moduli[a][b]) - self.stress[a];
        }
        (self.stress[a] * square_b - self.stress[b] * square_a) / distance
    }
}

impl Law for Plasticity {
    fn history_len(&self) -> usize {
        7
    }

    fn response(&self, strain: &[f64; 6], history: History<'_>) -> Result<Response, Unsolvable> {
        let returned = self.return_map(strain, history.old)?;
        returned.keep(strain, history.new);
        Ok(returned.pull_back())
    }

    fn energy_density(&self, strain: &[f64; 6], old: &[f64]) -> f64 {
        let Ok(returned) = self.return_map(strain, old) else { return f64::NAN };
        let trace: f64 = returned.strain.iter().sum();
        let square: f64 = returned.strain.iter().map(|value| value * value).sum();
        0.5 * self.elastic.lambda * trace * trace + self.elastic.mu * square
    }
}
