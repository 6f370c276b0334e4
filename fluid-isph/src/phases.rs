//! The phases `step.rs` lists, each on the state of [`Fluid`].

use std::ops::Range;

use rayon::prelude::*;

use crate::assembly::{RobinTerms, Surroundings, assemble_pressure_matrix};
use crate::correction::{CorrectionTerm, correct_velocity};
use crate::error::StepFault;
use crate::fluid::{Fluid, PressureLevel};
use crate::markers::PressureField;
use crate::parallel::{CHUNK, LIGHT, chunk_count};
use crate::particles::four_lanes;
use crate::pressure::conjugate_gradient::Accuracy;
use crate::source::{SURFACE_DENSITY, SourceTerm, assemble_source, surface_density};
use crate::time_step::{LARGEST_MOVE, largest_speed};
use crate::vector::{Vector, add_scaled, dot, sub};

/// A step may be halved this often before it is given up.
const HALVINGS: i32 = 6;

impl<const D: usize> Fluid<D> {
    pub(crate) fn sort_particles(&mut self) {
        self.water.sort(&self.grid);
    }

    pub(crate) fn place_body(&mut self) {
        if let Some(body) = &self.body {
            body.place(&mut self.walls);
            self.walls.sort_body(&self.grid, self.spacing);
        }
    }

    pub(crate) fn assemble_matrix(&mut self) {
        let g = self.scene.gravity.at(self.time);
        let rho = self.scene.reference_density;
        let robin = self.body.as_ref().filter(|body| body.gives_way);
        let around = Surroundings {
            grid: &self.grid,
            kernel: &self.kernel,
            walls: &self.walls,
            air: 1.0 / self.scene.air_distance,
            robin: robin.map(|body| RobinTerms {
                coefficient: &body.robin_coefficient,
                old_pressure: &body.old_pressure,
                weight_density: g.map(|component| rho * component),
            }),
        };
        assemble_pressure_matrix(around, &mut self.water, &mut self.matrix, &mut self.moments);
        if let Some(periodic) = &mut self.periodic {
            periodic.extend_rows(
                (&self.kernel, 1.0 / self.scene.air_distance),
                &mut self.water,
                &mut self.matrix,
            );
        }
        self.measure_density();
    }

    fn measure_density(&mut self) {
        let n0 = self.kernel.lattice_density as f32;
        self.partial.resize(chunk_count(self.water.len()), [0.0; 3]);
        let chunks = self.water.number_density.par_chunks(CHUNK).zip(&mut self.partial);
        chunks.with_min_len(LIGHT).for_each(|(density, [largest, volume, count])| {
            [*largest, *volume, *count] = [0.0; 3];
            for &n in density.iter().filter(|&&n| n >= SURFACE_DENSITY * n0) {
                *largest = largest.max(f64::from((n / n0 - 1.0).abs()));
                *volume += f64::from(n0 / n);
                *count += 1.0;
            }
        });
        let add = |sum: [f64; 3], part: &[f64; 3]| [sum[0].max(part[0]), sum[1] + part[1], sum[2] + part[2]];
        let [largest, volume, count] = self.partial.iter().fold([0.0; 3], add);
        self.health.max_density_error = self.health.max_density_error.max(largest);
        if count > 0.0 {
            self.health.volume_error = (volume - count).abs() / self.water.len() as f64;
        }
    }

    pub(crate) fn find_eddy_viscosity(&mut self) {
        if let Some(model) = &mut self.turbulence {
            model.evaluate(&self.water, &self.matrix);
        }
    }

    pub(crate) fn find_viscous_acceleration(&mut self) {
        let eddy = self.turbulence.as_ref().map_or(&[][..], |model| &model.eddy_viscosity);
        if let Some(term) = &mut self.viscosity {
            term.evaluate(&self.water, &self.walls, &self.matrix, eddy);
        }
    }

    pub(crate) fn build_preconditioner(&mut self) {
        if !self.water.is_empty() {
            self.preconditioner.build(&self.grid, &self.water, &self.matrix);
        }
        self.keep_velocity();
    }

    /// Keeps the velocity of the start, for a repeat with a shorter step.
    pub(crate) fn keep_velocity(&mut self) {
        // The velocity is written anew from its start.
        std::mem::swap(&mut self.start_velocity, &mut self.water.velocity);
        self.water.velocity.resize(self.start_velocity.len(), [0.0; D]);
    }

    /// v* = v + dt (g + viscous acceleration): (3) of the paper.
    pub(crate) fn find_intermediate_velocity(&mut self, dt: f64) {
        let g = self.scene.gravity.at(self.time + dt);
        let viscous = self.viscosity.as_ref().map(|term| &term.acceleration);
        let (density, surface) = (&self.water.number_density, surface_density(self.kernel.lattice_density));
        let columns = self.water.velocity.par_chunks_mut(CHUNK).zip(self.water.flow.par_chunks_mut(CHUNK));
        let columns = columns.zip(self.start_velocity.par_chunks(CHUNK));
        columns.enumerate().with_min_len(LIGHT).for_each(|(number, ((velocity, flow), start))| {
            for (k, v) in velocity.iter_mut().enumerate() {
                *v = start[k];
                add_scaled(v, dt, &g);
                if let Some(acceleration) = viscous {
                    add_scaled(v, dt, &acceleration[number * CHUNK + k]);
                }
                flow[k] = four_lanes(v);
                flow[k][3] = if density[number * CHUNK + k] < surface { 1.0 } else { 0.0 };
            }
        });
    }

    /// alpha rho0 / dt^2 of (9), kg/(m3 s2).
    fn density_factor(&self, dt: f64) -> f64 {
        self.scene.source.alpha(dt) * self.scene.reference_density / (dt * dt)
    }

    pub(crate) fn assemble_source(&mut self, dt: f64) {
        let rho = self.scene.reference_density;
        let term = SourceTerm {
            divergence_factor: rho / dt,
            density_factor: self.density_factor(dt),
            lattice_density: self.kernel.lattice_density,
        };
        let water = (&self.water, self.grid.part());
        assemble_source(term, water, &self.matrix, &self.moments, &mut self.source);
        if let Some(periodic) = &self.periodic {
            periodic.correct_source(term.divergence_factor, &self.water, &mut self.source);
        }
        if self.pressure_level == PressureLevel::Shifted && !self.source.is_empty() {
            // A full tank has no level: the equation is solvable only for a source of mean zero.
            let mean = self.source.iter().map(|&b| f64::from(b)).sum::<f64>() / self.source.len() as f64;
            self.source.iter_mut().for_each(|b| *b -= mean as f32);
        }
    }

    /// First guess for the solve: the pressures of the last two sub-steps, continued to this one.
    fn guess_pressure(&mut self, dt: f64) {
        // After a much shorter sub-step the change says little about this one.
        let ratio = if self.last_substep > 0.0 { (dt / self.last_substep).min(2.0) as f32 } else { 0.0 };
        self.last_substep = dt;
        let clamped = self.pressure_level == PressureLevel::Clamped;
        let lowest = if clamped { 0.0 } else { f32::NEG_INFINITY };
        let columns =
            self.water.pressure.par_chunks_mut(CHUNK).zip(self.water.last_pressure.par_chunks_mut(CHUNK));
        columns.with_min_len(LIGHT).for_each(|(pressure, last)| {
            for (p, last) in pressure.iter_mut().zip(last) {
                let change = *p - *last;
                *last = *p;
                *p = (*p + ratio * change).max(lowest);
            }
        });
    }

    fn accuracy(&self, dt: f64) -> Accuracy {
        let scene = &self.scene;
        // Places are whole parts, so n_i/n0 of a perfect lattice departs from 1 by about a part over a spacing. Water that
        // nothing drives has no other source, and would have it solved for anew in every step.
        let parts = self.grid.part() / self.spacing;
        // Of driven water a small right side means something too: passes over a light wall compare its answers.
        let is_moved = self.body.as_ref().is_some_and(|body| body.largest_speed() > 0.0);
        let is_driven = is_moved || self.largest_gravity() > 0.0;
        let rounding = if is_driven { 0.0 } else { parts * (self.water.len() as f64).sqrt() };
        Accuracy {
            tolerance: if self.has_passes { scene.pass_tolerance } else { scene.pressure_tolerance },
            rounding: self.density_factor(dt) * rounding,
        }
    }

    /// Solves the pressure equation and settles what its level and negative values mean.
    pub(crate) fn solve_pressure(&mut self, dt: f64) -> Result<(), StepFault> {
        self.guess_pressure(dt);
        let accuracy = self.accuracy(dt);
        let mut pressure = std::mem::take(&mut self.water.pressure);
        let system = (&self.water, &self.matrix, &mut self.preconditioner);
        let solved = self.solver.solve(system, &self.source, &mut pressure, accuracy);
        match self.pressure_level {
            PressureLevel::Clamped => {
                let clamp = |pressure: &mut [f32]| {
                    let negative = pressure.iter().filter(|&&p| p < 0.0).count() as u64;
                    pressure.iter_mut().for_each(|p| *p = p.max(0.0));
                    negative
                };
                self.clamped += pressure.par_chunks_mut(CHUNK).with_min_len(LIGHT).map(clamp).sum::<u64>();
            }
            PressureLevel::Shifted => {
                // High enough that the pressure at walls above, hydrostatically lower, is not limited at zero.
                let wall = self.scene.reference_density * self.largest_gravity() * self.kernel.support_radius;
                let shift = wall as f32 - pressure.iter().copied().fold(f32::INFINITY, f32::min);
                pressure.iter_mut().for_each(|p| *p += shift);
            }
            PressureLevel::Free => {}
        }
        self.solved += pressure.len() as u64;
        self.water.pressure = pressure;
        self.iterations += u64::from(solved?.iterations);
        Ok(())
    }

    pub(crate) fn field(&self) -> PressureField<'_, D> {
        PressureField {
            grid: &self.grid,
            kernel: &self.kernel,
            water: &self.water,
            reference_density: self.scene.reference_density,
        }
    }

    pub(crate) fn find_wall_pressure(&mut self, dt: f64) {
        let g = self.scene.gravity.at(self.time + dt);
        let field = PressureField {
            grid: &self.grid,
            kernel: &self.kernel,
            water: &self.water,
            reference_density: self.scene.reference_density,
        };
        self.wall_search.evaluate(field, &mut self.walls, &g);
        if let Some(periodic) = &mut self.periodic {
            periodic.find_wall_pressure(field, &mut self.walls, &g);
        }
    }

    fn correction_term(&self, dt: f64) -> CorrectionTerm<D> {
        CorrectionTerm {
            dt,
            reference_density: self.scene.reference_density,
            gravity: self.scene.gravity.at(self.time + dt),
            wall_pressure: self.scene.wall_pressure,
            spacing: self.spacing,
        }
    }

    pub(crate) fn correct_velocity(&mut self, dt: f64) {
        let term = self.correction_term(dt);
        let matrix = (&self.matrix, self.grid.part());
        correct_velocity(term, &self.walls, matrix, &mut self.water, &mut self.guard);
        if let Some(periodic) = &self.periodic {
            periodic.correct_velocity(0.5 * dt / self.scene.reference_density, &mut self.water);
        }
    }

    /// The half of `dt` if water would move further than half a spacing, `None` if the step stands.
    pub(crate) fn shorter_step(&mut self, dt: f64) -> Result<Option<f64>, StepFault> {
        let (speed, item) = largest_speed(&self.water.velocity);
        self.speed = speed;
        let moved = speed * dt / self.spacing;
        if moved <= LARGEST_MOVE {
            return Ok(None);
        }
        if speed > self.speed_limit {
            return Err(StepFault::Runaway { item, speed, limit: self.speed_limit });
        }
        if dt < self.admitted_time_step() * 0.5f64.powi(HALVINGS) {
            return Err(StepFault::StepTooLarge { item, moved, dt });
        }
        self.health.shortened_steps += 1;
        Ok(Some(0.5 * dt))
    }

    /// Load of this sub-step on the body's particles and markers, the Robin wall's give-way, the work done.
    pub(crate) fn find_body_load(&mut self, dt: f64) {
        let Some(body) = &mut self.body else { return };
        let mut load = std::mem::take(&mut body.load);
        self.find_reaction(self.walls.body(), dt, &mut load);
        let g = self.scene.gravity.at(self.time + dt);
        let field = PressureField {
            grid: &self.grid,
            kernel: &self.kernel,
            water: &self.water,
            reference_density: self.scene.reference_density,
        };
        let Some(body) = &mut self.body else { return };
        body.load = load;
        if let Some(markers) = &mut self.markers {
            markers.evaluate(field, &body.nodes, &g);
        }
        body.give_way(&self.walls, dt, self.scene.reference_density);
    }

    /// Force of the water on the wall particles `columns`, `[len, D]` N, the guard's impulses included; books the work it
    /// does on the water.
    pub(crate) fn find_reaction(&mut self, columns: Range<usize>, dt: f64, load: &mut [Vector<D>]) {
        let g = self.scene.gravity.at(self.time + dt);
        let field = PressureField {
            grid: &self.grid,
            kernel: &self.kernel,
            water: &self.water,
            reference_density: self.scene.reference_density,
        };
        let walls = (&self.walls, self.scene.wall_pressure);
        self.wall_search.forces(field, walls, columns.clone(), &g, load);
        let mass = self.scene.reference_density * self.kernel.volume;
        let (rows, water) = ((&self.walls, &self.matrix.chunks[..]), (&self.water, self.spacing));
        self.guard.add_to_load(rows, columns.clone(), water, (mass, dt), load);
        let power: f64 = load.iter().zip(&self.walls.velocity[columns]).map(|(force, v)| dot(force, v)).sum();
        self.energy.work -= power * dt;
    }

    /// x += dt v, and the guard's pushes.
    pub(crate) fn move_particles(&mut self, dt: f64) {
        let columns = self.water.position.par_chunks_mut(CHUNK).zip(self.water.velocity.par_chunks(CHUNK));
        columns.with_min_len(LIGHT).for_each(|(position, velocity)| {
            for (x, v) in position.iter_mut().zip(velocity) {
                add_scaled(x, dt, v);
            }
        });
        let mut inside = 0;
        for hit in self.guard.hits() {
            add_scaled(&mut self.water.position[hit.particle as usize], 1.0, &hit.push);
            self.health.guard_hits += 1;
            inside += u64::from(hit.is_inside());
        }
        self.health.most_inside_walls = self.health.most_inside_walls.max(inside);
        if let Some(periodic) = &self.periodic {
            // In at the other end is up against gravity: work of nobody in the scene.
            let way = periodic.wrap(&mut self.water.position);
            self.energy.work -= self.particle_mass() * dot(&way, &self.scene.gravity.at(self.time));
        }
        // A change of gravity changes the potential energy of all water: work of whoever changes it.
        let change = sub(&self.scene.gravity.at(self.time + dt), &self.scene.gravity.at(self.time));
        if change != [0.0; D] {
            let mass = self.particle_mass();
            let work: f64 = self.water.position.iter().map(|x| -mass * dot(x, &change)).sum();
            self.energy.work += work;
        }
        self.time += dt;
    }

    /// Books speeds and energy, retires particles that left.
    pub(crate) fn check_particles(&mut self) -> Result<(), StepFault> {
        self.health.substeps += 1;
        self.health.max_speed = self.health.max_speed.max(self.speed);
        self.health.mean_pressure_iterations = self.iterations as f64 / self.health.substeps as f64;
        self.health.clamped_share = self.clamped as f64 / self.solved.max(1) as f64;
        if self.speed > self.speed_limit {
            let (speed, item) = largest_speed(&self.water.velocity);
            return Err(StepFault::Runaway { item, speed, limit: self.speed_limit });
        }
        self.retire_lost();
        (self.energy.kinetic, self.energy.potential) = self.measure_energy();
        let gain = self.energy.kinetic + self.energy.potential - self.energy.start - self.energy.work;
        let reference = self.energy.reference.max(self.energy.kinetic);
        if reference > 0.0 {
            self.health.energy_error = self.health.energy_error.max(gain / reference);
        }
        Ok(())
    }

    /// Kinetic energy sum m v^2/2 and potential energy -sum m g.x, J, over fixed chunks.
    pub(crate) fn measure_energy(&mut self) -> (f64, f64) {
        let g = self.scene.gravity.at(self.time);
        let mass = self.particle_mass();
        self.partial.resize(chunk_count(self.water.len()), [0.0; 3]);
        let columns = self.water.position.par_chunks(CHUNK).zip(self.water.velocity.par_chunks(CHUNK));
        columns.zip(&mut self.partial).with_min_len(LIGHT).for_each(|((position, velocity), partial)| {
            *partial = [0.0; 3];
            for (x, v) in position.iter().zip(velocity) {
                partial[0] += 0.5 * mass * dot(v, v);
                partial[1] -= mass * dot(&g, x);
            }
        });
        self.partial.iter().fold((0.0, 0.0), |sum, part| (sum.0 + part[0], sum.1 + part[1]))
    }
}
