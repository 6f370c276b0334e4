//! The explicit way: weakly compressible SPH (Monaghan 1994, J. Comput. Phys. 110, 399), for comparison of error against
//! run time with the projection. Same operators, same walls, same particles; no system to solve.
//!
//! Pressure by Tait's equation, density by continuity with the diffusion of Molteni & Colagrossi (2009, Comput. Phys.
//! Commun. 180, 861) on what departs from still water (Fourtakas et al. 2019), artificial viscosity of Monaghan (1992).

use rayon::prelude::*;

use crate::parallel::{CHUNK, LIGHT, MEDIUM};
use crate::particles::Water;
use crate::pressure::matrix::PressureMatrix;
use crate::vector::{Vector, add_scaled, dot, sub};

/// Exponent of Tait's equation for water.
const EXPONENT: f64 = 7.0;

/// Factor of the density diffusion delta h c lap rho.
const DIFFUSION: f64 = 0.1;

/// Numbers of the explicit scheme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Explicit {
    /// c, m/s; ten times the largest speed keeps the density within 1 %.
    pub sound_speed: f64,
    /// alpha of the artificial viscosity, -; 0 leaves it out.
    pub artificial_viscosity: f64,
}

/// The density of a scene computed explicitly.
#[derive(Debug)]
pub struct WeaklyCompressible {
    /// What was asked for.
    pub numbers: Explicit,
    /// rho by particle number, kg/m3.
    pub(crate) density: Vec<f64>,
    /// Its change, by place, kg/(m3 s).
    rate: Vec<f64>,
}

/// What the equations need to know of the scene.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<const D: usize> {
    /// rho0, kg/m3.
    pub reference_density: f64,
    /// g, m/s2.
    pub gravity: Vector<D>,
    /// h, m.
    pub smoothing_length: f64,
}

impl WeaklyCompressible {
    /// Starts from the pressures p of still water, `[n]` Pa by particle number: rho = rho0 (1 + 7 p/(rho0 c2))^(1/7).
    pub fn new(numbers: Explicit, reference_density: f64, pressures: impl Iterator<Item = f64>) -> Self {
        let stiffness = reference_density * numbers.sound_speed.powi(2) / EXPONENT;
        let density = pressures.map(|p| reference_density * (1.0 + p / stiffness).powf(1.0 / EXPONENT));
        Self { numbers, density: density.collect(), rate: Vec::new() }
    }

    /// p = (rho0 c2/7) ((rho/rho0)^7 - 1), never below zero at a free surface: Tait's equation.
    pub fn find_pressure<const D: usize>(&self, reference_density: f64, clamped: bool, water: &mut Water<D>) {
        let stiffness = reference_density * self.numbers.sound_speed.powi(2) / EXPONENT;
        let least = if clamped { 0.0 } else { f64::NEG_INFINITY };
        for (p, &id) in water.pressure.iter_mut().zip(&water.id) {
            let ratio = self.density[id as usize] / reference_density;
            *p = (stiffness * (ratio.powf(EXPONENT) - 1.0)).max(least) as f32;
        }
    }

    /// Adds dt times the artificial viscosity, -sum m Pi grad W with Pi = -alpha c h (v.r)/(r2 + 0.01 h2)/rho0 where
    /// neighbours approach.
    pub fn add_artificial_viscosity<const D: usize>(
        &self,
        around: Surroundings<D>,
        dt: f64,
        start: &[Vector<D>],
        (water, matrix): (&mut Water<D>, &PressureMatrix),
    ) {
        let h = around.smoothing_length;
        let factor = self.numbers.artificial_viscosity * self.numbers.sound_speed * h * dt;
        let position = &water.position;
        let chunks = water.velocity.par_chunks_mut(CHUNK).zip(&matrix.chunks).enumerate();
        chunks.with_min_len(MEDIUM).for_each(|(number, (velocity, rows))| {
            for (k, v) in velocity.iter_mut().enumerate() {
                let i = number * CHUNK + k;
                let (columns, values) = rows.row(k);
                for (&j, &value) in columns.iter().zip(values).filter(|&(&j, _)| j as usize != i) {
                    let r = sub(&position[i], &position[j as usize]);
                    let approach = dot(&sub(&start[i], &start[j as usize]), &r).min(0.0);
                    let size = 0.5 * f64::from(value) * factor * approach / (dot(&r, &r) + 0.01 * h * h);
                    add_scaled(v, size, &r);
                }
            }
        });
    }

    /// rho += dt (-rho div v + delta h c lap (rho - rho of still water)); `divergence` holds -div v, 1/s.
    pub fn advance_density<const D: usize>(
        &mut self,
        around: Surroundings<D>,
        dt: f64,
        divergence: &[f32],
        (water, matrix): (&Water<D>, &PressureMatrix),
    ) {
        let spread = DIFFUSION * around.smoothing_length * self.numbers.sound_speed;
        let slope = around.reference_density / self.numbers.sound_speed.powi(2);
        self.rate.resize(water.len(), 0.0);
        let (density, id) = (&self.density, &water.id);
        let chunks = self.rate.par_chunks_mut(CHUNK).zip(&matrix.chunks).enumerate();
        chunks.with_min_len(MEDIUM).for_each(|(number, (rate, rows))| {
            for (k, target) in rate.iter_mut().enumerate() {
                let i = number * CHUNK + k;
                let own = density[id[i] as usize];
                let mut laplacian = 0.0;
                let (columns, values) = rows.row(k);
                for (&j, &value) in columns.iter().zip(values).filter(|&(&j, _)| j as usize != i) {
                    let r = sub(&water.position[j as usize], &water.position[i]);
                    let still = slope * dot(&around.gravity, &r);
                    laplacian -= f64::from(value) * (density[id[j as usize] as usize] - own - still);
                }
                *target = own * f64::from(divergence[i]) + spread * laplacian;
            }
        });
        for (rate, &id) in self.rate.iter().zip(&water.id) {
            self.density[id as usize] += dt * rate;
        }
    }

    /// Whether all densities are finite.
    pub fn is_finite(&self) -> bool {
        self.density.par_chunks(CHUNK).with_min_len(LIGHT).all(|part| part.iter().all(|rho| rho.is_finite()))
    }
}
