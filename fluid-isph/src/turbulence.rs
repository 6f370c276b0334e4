//! Smagorinsky's eddy viscosity (1963), with the spacing as filter width.

use rayon::prelude::*;

use crate::parallel::{CHUNK, MEDIUM};
use crate::particles::Water;
use crate::pressure::matrix::PressureMatrix;
use crate::vector::sub;

/// The turbulence model of a scene that has one.
#[derive(Debug)]
pub struct Smagorinsky {
    /// (C_s spacing)^2, m2.
    pub mixing_length_squared: f64,
    /// nu_t per water particle, `[n]` m2/s.
    pub eddy_viscosity: Vec<f64>,
}

impl Smagorinsky {
    /// nu_t = (C_s spacing)^2 |S| with |S| = sqrt(2 S:S) and grad v = V sum F (v_j - v_i) (x_j - x_i) over water.
    pub fn evaluate<const D: usize>(&mut self, water: &Water<D>, matrix: &PressureMatrix) {
        self.eddy_viscosity.resize(water.len(), 0.0);
        let factor = self.mixing_length_squared;
        let chunks = self.eddy_viscosity.par_chunks_mut(CHUNK).zip(&matrix.chunks).enumerate();
        chunks.with_min_len(MEDIUM).for_each(|(number, (eddy, rows))| {
            for (k, target) in eddy.iter_mut().enumerate() {
                let i = number * CHUNK + k;
                let mut gradient = [[0.0; D]; D];
                let (columns, values) = rows.row(k);
                for (&j, &value) in columns.iter().zip(values) {
                    let r = sub(&water.position[i], &water.position[j as usize]);
                    let dv = sub(&water.velocity[i], &water.velocity[j as usize]);
                    for a in 0..D {
                        for b in 0..D {
                            gradient[a][b] -= 0.5 * f64::from(value) * dv[a] * r[b];
                        }
                    }
                }
                let mut squared = 0.0;
                for a in 0..D {
                    for b in 0..D {
                        let rate = 0.5 * (gradient[a][b] + gradient[b][a]);
                        squared += 2.0 * rate * rate;
                    }
                }
                *target = factor * squared.sqrt();
            }
        });
    }
}
