//! Viscous term of the intermediate velocity: nu 2 V sum F (v_j - v_i), with the eddy viscosity of the pair's mean.
//!
//! Morris, Fox & Zhu (1997), J. Comput. Phys. 136, 214, in the form the lattice makes exact for quadratic fields.

use rayon::prelude::*;

use crate::parallel::{CHUNK, MEDIUM};
use crate::particles::Water;
use crate::pressure::matrix::PressureMatrix;
use crate::rows::{for_each_row, sum_row};
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
            for_each_row(
                acceleration,
                #[inline(always)]
                |k, target| {
                    let i = number * CHUNK + k;
                    *target = if eddy.is_empty() {
                        pair_sum(water, i, rows.row(k), |_| 1.0).map(|component| nu * component)
                    } else {
                        pair_sum(water, i, rows.row(k), |j| nu + 0.5 * (eddy[i] + eddy[j]))
                    };
                    if no_slip {
                        let own = nu + 0.5 * eddy.get(i).copied().unwrap_or(0.0);
                        let (columns, values) = rows.wall_row(k);
                        for (&wall, &value) in columns.iter().zip(values) {
                            let relative = sub(&walls.velocity[wall as usize], &water.velocity[i]);
                            let friction = f64::from(value * walls.friction[wall as usize]);
                            add_scaled(target, friction * own, &relative);
                        }
                    }
                },
            );
        });
    }
}

/// sum_j a_ij nu_ij (v_j - v_i) over the water.
#[inline(always)]
fn pair_sum<const D: usize>(
    water: &Water<D>,
    i: usize,
    row: (&[u32], &[f32]),
    viscosity: impl Fn(usize) -> f64,
) -> Vector<D> {
    let own = water.flow[i];
    let sum: [f64; 4] = sum_row(row, |j, value| {
        let (other, factor) = (water.flow[j], f64::from(value) * viscosity(j));
        std::array::from_fn(|k| factor * f64::from(own[k] - other[k]))
    });
    std::array::from_fn(|k| sum[k])
}
