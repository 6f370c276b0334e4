//! Right side of the pressure equation: divergence of v* and the relaxed density term.

use rayon::prelude::*;

use crate::assembly::WallMoments;
use crate::parallel::{CHUNK, MEDIUM};
use crate::particles::Water;
use crate::pressure::matrix::PressureMatrix;
use crate::vector::{dot, sub};

/// A particle with less than this part of the lattice's n0 is at the free surface.
pub const SURFACE_DENSITY: f32 = 0.95;

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
/// At the surface, or beside a surface particle, only compression (n_i > n0) counts. Pa/m2.
/// Source: (9) of the paper, written for the positive matrix -lap.
pub fn assemble_source<const D: usize>(
    term: SourceTerm,
    water: &Water<D>,
    matrix: &PressureMatrix,
    moments: &WallMoments<D>,
    source: &mut Vec<f32>,
) {
    source.resize(water.len(), 0.0);
    let surface = SURFACE_DENSITY * term.lattice_density as f32;
    let chunks = source.par_chunks_mut(CHUNK).zip(&matrix.chunks).enumerate();
    chunks.with_min_len(MEDIUM).for_each(|(number, (source, rows))| {
        for (k, target) in source.iter_mut().enumerate() {
            let i = number * CHUNK + k;
            let (x, v) = (&water.position[i], &water.velocity[i]);
            let mut divergence = 2.0 * (dot(v, &moments.first[i]) - moments.flux[i]);
            let mut near_surface = water.number_density[i] < surface;
            let (columns, values) = rows.row(k);
            for (&j, &value) in columns.iter().zip(values) {
                let j = j as usize;
                let half = -0.5 * f64::from(value);
                divergence += half * dot(&sub(v, &water.velocity[j]), &sub(x, &water.position[j]));
                near_surface |= water.number_density[j] < surface;
            }
            let mut compression = f64::from(water.number_density[i]) / term.lattice_density - 1.0;
            if near_surface {
                compression = compression.max(0.0);
            }
            *target = (term.density_factor * compression - term.divergence_factor * divergence) as f32;
        }
    });
    for (source, robin) in source.iter_mut().zip(&moments.robin) {
        *source += robin;
    }
}
