//! Velocity correction by the pressure gradient, and the wall guard.

use std::ops::Range;

use rayon::prelude::*;

use crate::kernel_shape::{CubicSpline, Shape};
use crate::parallel::{CHUNK, MEDIUM};
use crate::particles::Water;
use crate::pressure::matrix::{PressureMatrix, RowChunk};
use crate::rows::{for_each_row, sum_row};
use crate::scene::WallPressure;
use crate::vector::{Vector, add_scaled, dot, norm, normalised, sub};
use crate::wall_pressure::pressure_seen;
use crate::walls::Walls;

/// Smoothing length of the guard's kernel, in spacings (support twice that).
const GUARD_LENGTH: f64 = 0.6;

/// Guard sum above which inward motion is removed; the resting lattice has at most 0.02.
const GUARD_STOP: f64 = 0.11;

/// Guard sum above which the position is pushed out.
const GUARD_PUSH: f64 = 0.17;

/// Guard sum above which a particle is inside the wall: a quarter of a spacing behind its plane. Full lattices have 0.7.
const GUARD_INSIDE: f64 = 0.6;

/// How far it is pushed, in spacings.
const PUSH: f64 = 0.1;

/// Numbers of the correction.
#[derive(Debug, Clone, Copy)]
pub struct CorrectionTerm<const D: usize> {
    /// Sub-step, s.
    pub dt: f64,
    /// rho0, kg/m3.
    pub reference_density: f64,
    /// g, m/s2.
    pub gravity: Vector<D>,
    /// Pressure at wall particles.
    pub wall_pressure: WallPressure,
    /// Spacing, m.
    pub spacing: f64,
}

/// A particle the guard has stopped.
#[derive(Debug, Clone, Copy)]
pub struct GuardHit<const D: usize> {
    /// Water particle.
    pub particle: u32,
    /// Velocity it was given, m/s.
    pub velocity_change: Vector<D>,
    /// Displacement it is given when it moves, m.
    pub push: Vector<D>,
    /// Sum of the guard's weights around it.
    weights: f64,
}

impl<const D: usize> GuardHit<D> {
    /// Whether the particle stands inside the wall.
    pub fn is_inside(&self) -> bool {
        self.weights > GUARD_INSIDE
    }
}

/// Hits of each chunk; memory is kept.
#[derive(Debug, Default)]
pub struct Guard<const D: usize> {
    hits: Vec<Vec<GuardHit<D>>>,
}

/// v = v* + (dt/rho0) V [sum_water F (p_i + p_j) r + sum_wall F (p_i + p_w) r], then the guard.
///
/// `part` is the unit of the water's places, m. Source: (4) of the paper, with a gradient that is antisymmetric in each
/// pair: momentum is conserved to round-off.
pub fn correct_velocity<const D: usize>(
    term: CorrectionTerm<D>,
    walls: &Walls<D>,
    (matrix, part): (&PressureMatrix, f64),
    water: &mut Water<D>,
    guard: &mut Guard<D>,
) {
    guard.hits.resize_with(matrix.chunks.len(), Vec::new);
    let mut velocity = std::mem::take(&mut water.velocity);
    let reader = &*water;
    let factor = 0.5 * term.dt / term.reference_density;
    let chunks = velocity.par_chunks_mut(CHUNK).zip(&matrix.chunks).zip(&mut guard.hits).enumerate();
    chunks.with_min_len(MEDIUM).for_each(|(number, ((velocity, rows), hits))| {
        hits.clear();
        for_each_row(
            velocity,
            #[inline(always)]
            |k, v| {
                let i = number * CHUNK + k;
                add_scaled(v, factor * part, &pair_force(reader, i, rows.row(k)));
                let (columns, values) = rows.wall_row(k);
                if !columns.is_empty() {
                    let x = &reader.position[i];
                    let force = wall_force(term, walls, (x, reader.pressure[i]), (columns, values));
                    add_scaled(v, factor, &force);
                    let hit = stop_at_wall(term.spacing, (walls, columns), x, v);
                    hits.extend(hit.map(|hit| GuardHit { particle: i as u32, ..hit }));
                }
            },
        );
    });
    water.velocity = velocity;
}

/// sum_j a_ij (p_i + p_j) r over the water, r in parts of an edge.
#[inline(always)]
fn pair_force<const D: usize>(water: &Water<D>, i: usize, row: (&[u32], &[f32])) -> Vector<D> {
    let (own, p) = (water.place[i], water.pressure[i]);
    let sum: [f64; 4] = sum_row(row, |j, value| {
        let (place, pair) = (water.place[j], -f64::from(value) * f64::from(p + water.pressure[j]));
        std::array::from_fn(|k| pair * f64::from(own[k].wrapping_sub(place[k])))
    });
    std::array::from_fn(|k| sum[k])
}

/// sum_w a_iw (p_i + p_w) (x - x_w) over the walls.
#[inline(always)]
fn wall_force<const D: usize>(
    term: CorrectionTerm<D>,
    walls: &Walls<D>,
    (x, p): (&Vector<D>, f32),
    (columns, values): (&[u32], &[f32]),
) -> Vector<D> {
    let mut sum = [0.0; D];
    for (&wall, &value) in columns.iter().zip(values) {
        let d = sub(x, &walls.position[wall as usize]);
        let known = (term.reference_density, &term.gravity);
        let at_wall = pressure_seen(walls, term.wall_pressure, (wall as usize, &d), f64::from(p), known);
        add_scaled(&mut sum, f64::from(value) * (f64::from(p) + at_wall), &d);
    }
    sum
}

/// s = sum over wall particles of W(r; 0.6 spacings)/W(0), normal from the same sum. Above 0.11 the part of the
/// velocity into the wall, relative to it, is removed; above 0.17 the position is to be pushed out by 0.1 spacings
/// (never the velocity: that drives resting corner particles).
fn stop_at_wall<const D: usize>(
    spacing: f64,
    (walls, columns): (&Walls<D>, &[u32]),
    x: &Vector<D>,
    v: &mut Vector<D>,
) -> Option<GuardHit<D>> {
    let (mut weights, mut outward, mut wall_velocity) = (0.0, [0.0; D], [0.0; D]);
    let reach = 2.0 * GUARD_LENGTH * spacing;
    for &wall in columns {
        let wall = wall as usize;
        let d = sub(x, &walls.position[wall]);
        // Most particles of the row are out of the guard's reach.
        if dot(&d, &d) < reach * reach {
            let w = guard_weight(norm(&d) / spacing) * f64::from(walls.weight[wall]);
            weights += w;
            add_scaled(&mut outward, w, &d);
            add_scaled(&mut wall_velocity, w, &walls.velocity[wall]);
        }
    }
    if weights <= GUARD_STOP {
        return None;
    }
    let normal = normalised(&outward);
    let approach = dot(v, &normal) - dot(&wall_velocity, &normal) / weights;
    let mut hit = GuardHit { particle: 0, velocity_change: [0.0; D], push: [0.0; D], weights };
    if approach < 0.0 {
        add_scaled(&mut hit.velocity_change, -approach, &normal);
        add_scaled(v, -approach, &normal);
    }
    if weights > GUARD_PUSH {
        add_scaled(&mut hit.push, PUSH * spacing, &normal);
    }
    (approach < 0.0 || weights > GUARD_PUSH).then_some(hit)
}

/// W(r; 0.6 spacings)/W(0) at r in spacings.
fn guard_weight(r: f64) -> f64 {
    f64::from(CubicSpline.evaluate((r / GUARD_LENGTH) as f32).0)
}

impl<const D: usize> Guard<D> {
    /// All hits of the last correction, in the order of the particles.
    pub fn hits(&self) -> impl Iterator<Item = &GuardHit<D>> {
        self.hits.iter().flatten()
    }

    /// Adds the guard's impulses over `dt` to the forces on the wall particles `columns`, shared by the guard's weights;
    /// `mass` is that of a water particle, kg.
    pub fn add_to_load(
        &self,
        (walls, chunks): (&Walls<D>, &[RowChunk]),
        body: Range<usize>,
        (water, spacing): (&Water<D>, f64),
        (mass, dt): (f64, f64),
        load: &mut [Vector<D>],
    ) {
        for hit in self.hits() {
            let particle = hit.particle as usize;
            let (columns, _) = chunks[particle / CHUNK].wall_row(particle % CHUNK);
            for &wall in columns.iter().filter(|&&wall| body.contains(&(wall as usize))) {
                let wall = wall as usize;
                let r = norm(&sub(&water.position[particle], &walls.position[wall])) / spacing;
                let share = guard_weight(r) * f64::from(walls.weight[wall]) / hit.weights;
                add_scaled(&mut load[wall - body.start], -mass * share / dt, &hit.velocity_change);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_resting_lattice_is_far_from_the_guard() {
        // Particle in a corner, half a spacing from three planes.
        let mut sum = 0.0;
        for number in 0..27usize {
            let at = [number % 3, number / 3 % 3, number / 9];
            if at.contains(&0) {
                let r2: f64 = at.iter().map(|&k| (k as f64 - 1.0).powi(2)).sum();
                sum += guard_weight(r2.sqrt());
            }
        }
        assert!(sum < 0.5 * GUARD_STOP, "{sum}");
    }
}
