//! Right side of the pressure equation: divergence of v* and the relaxed density term.

use rayon::prelude::*;

use crate::assembly::WallMoments;
use crate::parallel::{CHUNK, MEDIUM};
use crate::particles::Water;
use crate::pressure::matrix::PressureMatrix;
use crate::rows::{for_each_row, sum_row};
use crate::vector::dot;

/// A particle with less than this part of the lattice's n0 is at the free surface.
pub const SURFACE_DENSITY: f32 = 0.95;

/// n of a particle at the surface is below this, 1/m^D.
pub fn surface_density(lattice_density: f64) -> f32 {
    SURFACE_DENSITY * lattice_density as f32
}

/// Numbers of the source term.
#[derive(Debug, Clone, Copy)]
pub struct SourceTerm {
    /// rho0 / dt, kg/(m3 s).
    pub divergence_factor: f64,
    /// alpha rho0 / dt^2, kg/(m3 s2).
    pub density_factor: f64,
    /// n0, 1/m^D.
    pub lattice_density: f64,
}

/// b_i = -(rho0/dt) div v*_i + alpha (rho0/dt^2) (n_i/n0 - 1), with
/// div v*_i = V sum_water F (v*_i - v*_j).r + 2 V sum_wall F (v*_i - v_w).r (the wall's velocity is mirrored; of
/// slip walls only the normal components count).
///
/// At the surface, or beside a surface particle, only compression (n_i > n0) counts. Pa/m2. `part` is the unit of the
/// water's places, m.
/// Source: (9) of the paper, written for the positive matrix -lap.
pub fn assemble_source<const D: usize>(
    term: SourceTerm,
    (water, part): (&Water<D>, f64),
    matrix: &PressureMatrix,
    moments: &WallMoments<D>,
    source: &mut Vec<f32>,
) {
    source.resize(water.len(), 0.0);
    let surface = surface_density(term.lattice_density);
    let chunks = source.par_chunks_mut(CHUNK).zip(&matrix.chunks).enumerate();
    chunks.with_min_len(MEDIUM).for_each(|(number, (source, rows))| {
        for_each_row(
            source,
            #[inline(always)]
            |k, target| {
                let i = number * CHUNK + k;
                let sum = pair_sums(water, i, rows.row(k));
                let walls = 2.0 * (dot(&water.velocity[i], &moments.first[i]) - moments.flux[i]);
                let divergence = part * f64::from(sum[0] + sum[1] + sum[2]) + walls;
                let mut compression = f64::from(water.number_density[i]) / term.lattice_density - 1.0;
                if water.number_density[i] < surface || sum[3] != 0.0 {
                    compression = compression.max(0.0);
                }
                *target = (term.density_factor * compression - term.divergence_factor * divergence) as f32;
            },
        );
    });
    for (source, robin) in source.iter_mut().zip(&moments.robin) {
        *source += robin;
    }
}

/// sum_j -a_ij/2 (v*_i - v*_j) r over the water, axis by axis, r in parts of an edge; the last is the same sum over the
/// neighbours at the surface with 1 instead of the product: not zero if there is one.
#[inline(always)]
fn pair_sums<const D: usize>(water: &Water<D>, i: usize, row: (&[u32], &[f32])) -> [f32; 4] {
    let (mut own_place, mut own_flow) = (water.place[i], water.flow[i]);
    (own_place[3], own_flow[3]) = (1, 0.0);
    sum_row(row, |j, value| {
        let (place, flow) = (water.place[j], water.flow[j]);
        let half = -0.5 * value;
        std::array::from_fn(|k| half * (own_flow[k] - flow[k]) * own_place[k].wrapping_sub(place[k]) as f32)
    })
}
