//! Viscous term of the intermediate velocity: nu 2 V sum F (v_j - v_i), with the eddy viscosity of the pair's mean.
//!
//! Morris, Fox & Zhu (1997), J. Comput. Phys. 136, 214, in the form the lattice makes exact for quadratic fields.

use rayon::prelude::*;

use crate::parallel::{CHUNK, MEDIUM};
use crate::particles::Water;
use crate::pressure::matrix::PressureMatrix;
use crate::scene::WallFriction;
use crate::vector::{Vector, add_scaled, sub};
use crate::walls::Walls;

/// The viscous term of a scene that has one.
#[derive(Debug)]
pub struct Viscosity<const D: usize> {
    /// nu, m2/s.
    pub kinematic_viscosity: f64,
    /// Whether walls take part.
    pub friction: WallFriction,
    /// Acceleration it gives, `[n, D]` m/s2.
    pub acceleration: Vec<Vector<D>>,
}

impl<const D: usize> Viscosity<D> {
    /// Computes `acceleration`; `eddy` is the eddy viscosity per particle, m2/s, empty without turbulence.
    ///
    /// Source: (3) of the paper.
    pub fn evaluate(&mut self, water: &Water<D>, walls: &Walls<D>, matrix: &PressureMatrix, eddy: &[f64]) {
        self.acceleration.resize(water.len(), [0.0; D]);
        let nu = self.kinematic_viscosity;
        let no_slip = self.friction == WallFriction::NoSlip;
        let chunks = self.acceleration.par_chunks_mut(CHUNK).zip(&matrix.chunks).enumerate();
        chunks.with_min_len(MEDIUM).for_each(|(number, (acceleration, rows))| {
            for (k, target) in acceleration.iter_mut().enumerate() {
                let i = number * CHUNK + k;
                let own_eddy = eddy.get(i).copied().unwrap_or(0.0);
                let v = &water.velocity[i];
                let (columns, values) = rows.row(k);
                let mut sum = [0.0; D];
                for (&j, &value) in columns.iter().zip(values) {
                    let j = j as usize;
                    let pair = nu + 0.5 * (own_eddy + eddy.get(j).copied().unwrap_or(0.0));
                    add_scaled(&mut sum, -f64::from(value) * pair, &sub(&water.velocity[j], v));
                }
                if no_slip {
                    let (columns, values) = rows.wall_row(k);
                    for (&wall, &value) in columns.iter().zip(values) {
                        let pair = nu + 0.5 * own_eddy;
                        add_scaled(
                            &mut sum,
                            f64::from(value) * pair,
                            &sub(&walls.velocity[wall as usize], v),
                        );
                    }
                }
                *target = sum;
            }
        });
    }
}
