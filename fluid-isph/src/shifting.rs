//! Particle shifting: evens the arrangement out where the flow stretches it, away from the free surface.
//!
//! Xu, Stansby & Laurence (2009), J. Comput. Phys. 228, 6703, with the length of Skillen, Lind, Stansby & Rogers (2013),
//! Comput. Methods Appl. Mech. Eng. 265, 163. Without it vortices tear lines of particles apart.

use rayon::prelude::*;

use crate::parallel::{CHUNK, MEDIUM};
use crate::particles::Water;
use crate::pressure::matrix::PressureMatrix;
use crate::source::SURFACE_DENSITY;
use crate::vector::{Vector, add_scaled, norm, sub};
use crate::walls::Walls;

/// Longest shift of a step, in spacings.
const LONGEST: f64 = 0.1;

/// Sums over the neighbours of one particle.
#[derive(Debug, Clone, Copy)]
pub struct ShiftSums<const D: usize> {
    /// V sum F r = minus the gradient of the concentration, over water and walls, 1/m.
    pub away: Vector<D>,
    /// grad v = V sum F (v_i - v_j) r, over water, 1/s.
    pub gradient: [Vector<D>; D],
}

/// The shifting of a scene that has it.
#[derive(Debug)]
pub struct Shifting<const D: usize> {
    /// A of the shift A h |v| dt V sum F r, -.
    pub factor: f64,
    /// `[n]`.
    pub sums: Vec<ShiftSums<D>>,
}

impl<const D: usize> Shifting<D> {
    /// Computes `sums` at the places the rows belong to.
    pub fn evaluate(&mut self, water: &Water<D>, walls: &Walls<D>, matrix: &PressureMatrix) {
        let nothing = ShiftSums { away: [0.0; D], gradient: [[0.0; D]; D] };
        self.sums.resize(water.len(), nothing);
        let chunks = self.sums.par_chunks_mut(CHUNK).zip(&matrix.chunks).enumerate();
        chunks.with_min_len(MEDIUM).for_each(|(number, (sums, rows))| {
            for (k, target) in sums.iter_mut().enumerate() {
                let i = number * CHUNK + k;
                let (x, v) = (&water.position[i], &water.velocity[i]);
                *target = nothing;
                let (columns, values) = rows.row(k);
                for (&j, &value) in columns.iter().zip(values) {
                    let half = -0.5 * f64::from(value);
                    let r = sub(x, &water.position[j as usize]);
                    let change = sub(v, &water.velocity[j as usize]);
                    add_scaled(&mut target.away, half, &r);
                    for a in 0..D {
                        add_scaled(&mut target.gradient[a], half * change[a], &r);
                    }
                }
                let (columns, values) = rows.wall_row(k);
                for (&wall, &value) in columns.iter().zip(values) {
                    let r = sub(x, &walls.position[wall as usize]);
                    add_scaled(&mut target.away, 0.5 * f64::from(value), &r);
                }
            }
        });
    }

    /// Moves every particle without a surface particle in reach by its shift, and takes the velocity along.
    pub fn apply(
        &self,
        (dt, spacing, smoothing_length): (f64, f64, f64),
        lattice_density: f64,
        water: &mut Water<D>,
        matrix: &PressureMatrix,
    ) {
        let surface = SURFACE_DENSITY * lattice_density as f32;
        let density = &water.number_density;
        let columns = water.position.par_chunks_mut(CHUNK).zip(water.velocity.par_chunks_mut(CHUNK));
        let given = self.sums.par_chunks(CHUNK).zip(&matrix.chunks);
        columns.zip(given).with_min_len(MEDIUM).for_each(|((position, velocity), (sums, rows))| {
            for (k, (x, v)) in position.iter_mut().zip(velocity).enumerate() {
                if rows.row(k).0.iter().any(|&j| density[j as usize] < surface) {
                    continue;
                }
                let mut shift = sums[k].away;
                let length = self.factor * smoothing_length * norm(v) * dt;
                let limit = LONGEST * spacing / (length * norm(&shift)).max(f64::MIN_POSITIVE);
                shift.iter_mut().for_each(|component| *component *= length * limit.min(1.0));
                for a in 0..D {
                    v[a] += crate::vector::dot(&sums[k].gradient[a], &shift);
                }
                add_scaled(x, 1.0, &shift);
            }
        });
    }
}
