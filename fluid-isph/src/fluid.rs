//! The water and everything around it; the phases `step.rs` lists.

use protocol::interface::{BodyMesh, Response};
use protocol::phases::{PhaseClock, PhaseTime};
use rayon::prelude::*;

use crate::assembly::{RobinTerms, Surroundings, WallMoments, assemble_pressure_matrix};
use crate::body::{Body, Motion};
use crate::body_layout::LayoutRules;
use crate::cells::Grid;
use crate::correction::{CorrectionTerm, Guard, correct_velocity};
use crate::error::{FluidError, SetupError, StepFault};
use crate::health::Health;
use crate::kernel::Kernel;
use crate::lattice::Lattice;
use crate::markers::{Markers, PressureField};
use crate::parallel::{CHUNK, LIGHT, chunk_count};
use crate::particles::Water;
use crate::pressure::conjugate_gradient::ConjugateGradient;
use crate::pressure::matrix::PressureMatrix;
use crate::pressure::multigrid::Multigrid;
use crate::scene::Scene;
use crate::source::{SURFACE_DENSITY, SourceTerm, assemble_source};
use crate::time_step::{LARGEST_MOVE, StepLimits, largest_speed};
use crate::turbulence::Smagorinsky;
use crate::vector::{Vector, add_scaled, dot, norm, sub};
use crate::viscosity::Viscosity;
use crate::wall_pressure::WallSearch;
use crate::walls::Walls;

/// Share of a closed tank's volume above which the water is taken to fill it: there is no free surface then.
const FULL_TANK: f64 = 0.98;

/// A step may be halved this often before it is given up.
const HALVINGS: i32 = 6;

/// The run stops when water is faster than this times the largest speed the scene can produce.
const RUNAWAY: f64 = 10.0;

/// A coupling step may exceed the admitted sub-step by this factor before it is split.
const STEP_TOLERANCE: f64 = 1.05;

/// The fluid of one scene.
#[derive(Debug)]
pub struct Fluid<const D: usize> {
    pub(crate) scene: Scene<D>,
    pub(crate) spacing: f64,
    pub(crate) kernel: Kernel<D>,
    pub(crate) grid: Grid<D>,
    pub(crate) water: Water<D>,
    pub(crate) walls: Walls<D>,
    pub(crate) body: Option<Body<D>>,
    pub(crate) markers: Option<Markers<D>>,
    pub(crate) viscosity: Option<Viscosity<D>>,
    pub(crate) turbulence: Option<Smagorinsky>,
    pub(crate) health: Health,
    matrix: PressureMatrix,
    moments: WallMoments<D>,
    source: Vec<f32>,
    multigrid: Multigrid<D>,
    solver: ConjugateGradient,
    wall_search: WallSearch,
    guard: Guard<D>,
    clock: PhaseClock,
    has_free_surface: bool,
    /// Velocity at the start of the sub-step, for a repeat with a shorter one.
    start_velocity: Vec<Vector<D>>,
    partial: Vec<[f64; 2]>,
    step_number: u64,
    pub(crate) time: f64,
    speed: f64,
    speed_limit: f64,
    energy: Energy,
    /// Height of the water's surface at the start above the lowest corner of the tank, along gravity, m.
    pub(crate) surface: f64,
    pub(crate) marker_pressure: Vec<f64>,
    pub(crate) pair_force: Vec<f64>,
    last_substeps: u32,
    iterations: u64,
    clamped: u64,
    solved: u64,
}

/// Energy account, J (2-D: per m depth).
#[derive(Debug, Default, Clone, Copy)]
pub(crate) struct Energy {
    pub(crate) kinetic: f64,
    pub(crate) potential: f64,
    /// Work done on the water since the start, less what left with particles.
    pub(crate) work: f64,
    start: f64,
    reference: f64,
}

impl<const D: usize> Fluid<D> {
    /// Makes the fluid of a scene; `mesh` is the dummy mesh of a structure, where there is one.
    ///
    /// # Errors
    /// [`SetupError`]: the lattice does not fit, the body is too thin, the water lies inside it.
    pub fn new(scene: Scene<D>, mesh: Option<&BodyMesh>) -> Result<Self, SetupError> {
        let lattice = Lattice::new(&scene)?;
        let spacing = lattice.spacing;
        let kernel = Kernel::new(spacing);
        let grid = grid_around(&scene, &kernel);
        let rules = LayoutRules {
            tank: &scene.tank,
            spacing,
            asked_spacing: scene.particle_spacing,
            wet: scene.body_wet,
            gravity: scene.gravity.vector,
        };
        let body = mesh.map(|mesh| Body::new(mesh, rules, scene.reference_density)).transpose()?;
        let mut walls = Walls::new(&grid, (&scene.tank, &lattice.wall), body.as_ref().map_or(0, Body::len));
        let (mut position, mut velocity) = (lattice.water, lattice.velocity);
        if let Some(body) = &body {
            let first = walls.body().start;
            walls.weight[first..].copy_from_slice(&body.weight);
            body.place(&mut walls);
            walls.sort_body(&grid, spacing);
            carve((&grid, &walls), spacing, &mut position, &mut velocity)?;
        }
        let tank_volume: f64 = (0..D).map(|k| scene.tank.max[k] - scene.tank.min[k]).product();
        let closed = scene.tank.open.iter().flatten().all(|&open| !open);
        let body_volume: f64 = body.iter().flat_map(|body| &body.weight).map(|&w| f64::from(w)).sum();
        let filled = (position.len() as f64 + body_volume) * kernel.volume;
        let mut fluid = Self {
            spacing,
            viscosity: (scene.kinematic_viscosity.is_some() || scene.smagorinsky.is_some()).then(|| {
                Viscosity {
                    kinematic_viscosity: scene.kinematic_viscosity.unwrap_or(0.0),
                    friction: scene.friction,
                    acceleration: Vec::new(),
                }
            }),
            turbulence: scene.smagorinsky.map(|constant| Smagorinsky {
                mixing_length_squared: (constant * spacing).powi(2),
                eddy_viscosity: Vec::new(),
            }),
            has_free_surface: !(closed && filled > FULL_TANK * tank_volume),
            marker_pressure: vec![0.0; mesh.map_or(0, |mesh| mesh.facets.markers().len())],
            pair_force: vec![0.0; mesh.map_or(0, |mesh| mesh.node_count() * D)],
            markers: mesh.map(|mesh| Markers::new(&mesh.facets)),
            water: Water::new(position, velocity),
            scene,
            kernel,
            grid,
            walls,
            body,
            health: Health::default(),
            matrix: PressureMatrix::default(),
            moments: WallMoments::default(),
            source: Vec::new(),
            multigrid: Multigrid::default(),
            solver: ConjugateGradient::default(),
            wall_search: WallSearch::default(),
            guard: Guard::default(),
            clock: PhaseClock::default(),
            start_velocity: Vec::new(),
            partial: Vec::new(),
            step_number: 0,
            time: 0.0,
            speed: 0.0,
            speed_limit: f64::INFINITY,
            energy: Energy::default(),
            surface: 0.0,
            last_substeps: 0,
            iterations: 0,
            clamped: 0,
            solved: 0,
        };
        fluid.start();
        Ok(fluid)
    }

    /// Speeds and energy of the start.
    fn start(&mut self) {
        self.water.sort(&self.grid);
        self.speed = largest_speed(&self.water.velocity).0;
        let g = self.largest_gravity();
        let fall = self.largest_fall();
        self.surface = fall + 0.5 * self.spacing;
        self.speed_limit = match (2.0 * g * fall).sqrt().max(self.speed) {
            largest if largest > 0.0 => RUNAWAY * largest,
            _ => f64::INFINITY,
        };
        self.partial.resize(chunk_count(self.water.len()), [0.0; 2]);
        (self.energy.kinetic, self.energy.potential) = self.measure_energy();
        self.energy.start = self.energy.kinetic + self.energy.potential;
        let mass = self.particle_mass() * self.water.len() as f64;
        self.energy.reference = self.energy.kinetic + mass * g * self.mean_height();
    }

    fn largest_gravity(&self) -> f64 {
        let factor = match &self.scene.gravity.factor {
            Some(table) => table.iter().map(|row| row.1.abs()).fold(0.0, f64::max),
            None => 1.0,
        };
        norm(&self.scene.gravity.vector) * factor
    }

    /// Coordinate along gravity of the tank's lowest corner, m.
    pub(crate) fn floor_along_gravity(&self) -> (Vector<D>, f64) {
        let down = crate::vector::normalised(&self.scene.gravity.vector);
        let tank = &self.scene.tank;
        (down, (0..D).map(|k| (down[k] * tank.min[k]).max(down[k] * tank.max[k])).sum())
    }

    fn largest_fall(&self) -> f64 {
        let (down, floor) = self.floor_along_gravity();
        self.water.position.iter().map(|x| floor - dot(x, &down)).fold(0.0, f64::max)
    }

    fn mean_height(&self) -> f64 {
        let (down, floor) = self.floor_along_gravity();
        let sum: f64 = self.water.position.iter().map(|x| floor - dot(x, &down)).sum();
        sum / self.water.len().max(1) as f64
    }

    /// Mass of one water particle, kg (2-D: kg per m depth).
    pub fn particle_mass(&self) -> f64 {
        self.scene.reference_density * self.kernel.volume
    }

    /// Longest sub-step allowed now, s; infinite if nothing limits it.
    pub fn admitted_time_step(&self) -> f64 {
        let eddy = self.turbulence.iter().flat_map(|model| &model.eddy_viscosity);
        let eddy = eddy.fold(0.0, |largest: f64, &nu| largest.max(nu));
        StepLimits {
            courant: self.scene.courant,
            spacing: self.spacing,
            speed: self.speed.max(self.body.as_ref().map_or(0.0, Body::largest_speed)),
            gravity: self.largest_gravity(),
            viscosity: self.viscosity.as_ref().map_or(0.0, |term| term.kinematic_viscosity + eddy),
        }
        .longest()
    }

    /// Advances one coupling step of `dt` s, in as many sub-steps as the water needs.
    ///
    /// # Errors
    /// [`FluidError`] with the step, the time and the cause.
    pub fn advance(&mut self, dt: f64, motion: Option<Motion<'_>>) -> Result<(), FluidError> {
        self.step_number += 1;
        // One entry into the thread pool for the whole step instead of one for each loop.
        let result = rayon::scope(|_| self.advance_in_pool(dt, motion));
        result.map_err(|fault| FluidError { step: self.step_number, time: self.time, fault })
    }

    fn advance_in_pool(&mut self, dt: f64, motion: Option<Motion<'_>>) -> Result<(), StepFault> {
        self.take_motion(motion)?;
        self.marker_pressure.fill(0.0);
        self.pair_force.fill(0.0);
        let (mut done, mut taken) = (0.0, 0);
        while dt - done > 1e-9 * dt {
            let rest = dt - done;
            let count = (rest / (STEP_TOLERANCE * self.admitted_time_step())).ceil().max(1.0);
            let needed = u64::from(taken) + count as u64;
            if needed > u64::from(self.scene.max_substeps) {
                return Err(StepFault::TooManySubsteps { needed, limit: self.scene.max_substeps });
            }
            let substep = self.step(rest / count)?;
            self.share_load(substep, dt);
            done += substep;
            taken += 1;
        }
        self.last_substeps = taken;
        if let Some(body) = self.body.as_mut().filter(|body| body.response == Response::Robin) {
            body.remember_pressure(&self.walls);
        }
        Ok(())
    }

    fn take_motion(&mut self, motion: Option<Motion<'_>>) -> Result<(), StepFault> {
        let (Some(body), Some(motion)) = (&mut self.body, motion) else { return Ok(()) };
        let expected = body.node_position.len() * D;
        for column in
            [Some(motion.position), Some(motion.velocity), motion.acceleration].into_iter().flatten()
        {
            if column.len() != expected {
                return Err(StepFault::MotionSize { expected, found: column.len() });
            }
            if column.iter().any(|value| !value.is_finite()) {
                return Err(StepFault::NonFinite { what: "motion of the body" });
            }
        }
        body.set_motion(motion);
        self.speed_limit = self.speed_limit.max(RUNAWAY * body.largest_speed());
        Ok(())
    }

    /// Adds a sub-step's share to the means over the coupling step, and moves the body's nodes on.
    fn share_load(&mut self, substep: f64, dt: f64) {
        let Some(body) = &mut self.body else { return };
        body.add_nodal_load(substep / dt, &mut self.pair_force);
        body.move_nodes(substep);
        let pressures = self.markers.iter().flat_map(|markers| &markers.pressure);
        for (mean, pressure) in self.marker_pressure.iter_mut().zip(pressures) {
            *mean += substep / dt * pressure;
        }
    }

    pub(crate) fn timed<T>(&mut self, name: &'static str, phase: impl FnOnce(&mut Self) -> T) -> T {
        let mut clock = std::mem::take(&mut self.clock);
        let result = clock.run(name, || phase(self));
        self.clock = clock;
        result
    }

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
        let robin = self.body.as_ref().filter(|body| body.response == Response::Robin);
        let around = Surroundings {
            grid: &self.grid,
            kernel: &self.kernel,
            walls: &self.walls,
            robin: robin.map(|body| RobinTerms {
                coefficient: &body.robin_coefficient,
                old_pressure: &body.old_pressure,
                weight_density: g.map(|component| rho * component),
            }),
        };
        assemble_pressure_matrix(around, &mut self.water, &mut self.matrix, &mut self.moments);
        self.measure_density();
    }

    fn measure_density(&mut self) {
        let n0 = self.kernel.lattice_density as f32;
        let (mut largest, mut volume, mut count) = (0.0f32, 0.0, 0u64);
        for &n in self.water.number_density.iter().filter(|&&n| n >= SURFACE_DENSITY * n0) {
            largest = largest.max((n / n0 - 1.0).abs());
            volume += f64::from(n0 / n);
            count += 1;
        }
        self.health.max_density_error = self.health.max_density_error.max(f64::from(largest));
        if count > 0 {
            self.health.volume_error = (volume - count as f64).abs() / self.water.len() as f64;
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
            self.multigrid.build(&self.grid, &self.water, &self.matrix);
        }
        self.start_velocity.clear();
        self.start_velocity.extend_from_slice(&self.water.velocity);
    }

    /// v* = v + dt (g + viscous acceleration): (3) of the paper.
    pub(crate) fn find_intermediate_velocity(&mut self, dt: f64) {
        let g = self.scene.gravity.at(self.time + dt);
        let viscous = self.viscosity.as_ref().map(|term| &term.acceleration);
        let columns = self.water.velocity.par_chunks_mut(CHUNK).zip(self.start_velocity.par_chunks(CHUNK));
        columns.enumerate().with_min_len(LIGHT).for_each(|(number, (velocity, start))| {
            for (k, (v, start)) in velocity.iter_mut().zip(start).enumerate() {
                *v = *start;
                add_scaled(v, dt, &g);
                if let Some(acceleration) = viscous {
                    add_scaled(v, dt, &acceleration[number * CHUNK + k]);
                }
            }
        });
    }

    pub(crate) fn assemble_source(&mut self, dt: f64) {
        let rho = self.scene.reference_density;
        let term = SourceTerm {
            divergence_factor: rho / dt,
            density_factor: self.scene.source.alpha(dt) * rho / (dt * dt),
            lattice_density: self.kernel.lattice_density,
        };
        assemble_source(term, &self.water, &self.matrix, &self.moments, &mut self.source);
        if !self.has_free_surface && !self.source.is_empty() {
            // A full tank has no level: the equation is solvable only for a source of mean zero.
            let mean = self.source.iter().map(|&b| f64::from(b)).sum::<f64>() / self.source.len() as f64;
            self.source.iter_mut().for_each(|b| *b -= mean as f32);
        }
    }

    /// Solves the pressure equation and sets negative pressures to zero (free surface: water bears no tension), or
    /// shifts the least pressure to zero (full tank).
    pub(crate) fn solve_pressure(&mut self) -> Result<(), StepFault> {
        let mut pressure = std::mem::take(&mut self.water.pressure);
        let system = (&self.water, &self.matrix, &mut self.multigrid);
        let solved = self.solver.solve(system, &self.source, &mut pressure, self.scene.pressure_tolerance);
        if self.has_free_surface {
            self.clamped += pressure.iter().filter(|&&p| p < 0.0).count() as u64;
            pressure.iter_mut().for_each(|p| *p = p.max(0.0));
        } else {
            let least = pressure.iter().copied().fold(f32::INFINITY, f32::min);
            pressure.iter_mut().for_each(|p| *p -= least);
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
        correct_velocity(term, &self.walls, &self.matrix, &mut self.water, &mut self.guard);
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
    pub(crate) fn find_load(&mut self, dt: f64) {
        let g = self.scene.gravity.at(self.time + dt);
        let field = PressureField {
            grid: &self.grid,
            kernel: &self.kernel,
            water: &self.water,
            reference_density: self.scene.reference_density,
        };
        let Some(body) = &mut self.body else { return };
        let walls = (&self.walls, self.scene.wall_pressure);
        self.wall_search.forces(field, walls, self.walls.body(), &g, &mut body.load);
        let mass = self.scene.reference_density * self.kernel.volume;
        let water = (&self.water, self.spacing);
        self.guard.add_to_load((&self.walls, &self.matrix.chunks), water, (mass, dt), &mut body.load);
        if let Some(markers) = &mut self.markers {
            markers.evaluate(field, (&body.node_position, &body.node_acceleration), &g);
        }
        body.give_way(&self.walls, dt, self.scene.reference_density);
        let velocity = &self.walls.velocity[self.walls.body()];
        let power: f64 = body.load.iter().zip(velocity).map(|(force, v)| dot(force, v)).sum();
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
        for hit in self.guard.hits() {
            add_scaled(&mut self.water.position[hit.particle as usize], 1.0, &hit.push);
            self.health.guard_hits += 1;
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
    pub(crate) fn check_particles(&mut self, _dt: f64) -> Result<(), StepFault> {
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
    fn measure_energy(&mut self) -> (f64, f64) {
        let g = self.scene.gravity.at(self.time);
        let mass = self.particle_mass();
        self.partial.resize(chunk_count(self.water.len()), [0.0; 2]);
        let columns = self.water.position.par_chunks(CHUNK).zip(self.water.velocity.par_chunks(CHUNK));
        columns.zip(&mut self.partial).with_min_len(LIGHT).for_each(|((position, velocity), partial)| {
            *partial = [0.0; 2];
            for (x, v) in position.iter().zip(velocity) {
                partial[0] += 0.5 * mass * dot(v, v);
                partial[1] -= mass * dot(&g, x);
            }
        });
        self.partial.iter().fold((0.0, 0.0), |sum, part| (sum.0 + part[0], sum.1 + part[1]))
    }

    fn retire_lost(&mut self) {
        let (tank, grid, margin) = (&self.scene.tank, &self.grid, 1.5 * self.spacing);
        let fate = |x: &Vector<D>, v: &Vector<D>| {
            if x.iter().chain(v).any(|value| !value.is_finite()) {
                return Fate::Broken;
            }
            let past = |k: usize, margin: f64| [tank.min[k] - x[k] > margin, x[k] - tank.max[k] > margin];
            let over_rim = (0..D).any(|k| (0..2).any(|side| tank.open[k][side] && past(k, 0.0)[side]));
            let through = (0..D).any(|k| (0..2).any(|side| !tank.open[k][side] && past(k, margin)[side]));
            match (over_rim, through || grid.inner_cell(x).is_none()) {
                (_, false) => Fate::Stays,
                (true, true) => Fate::Outflow,
                (false, true) => Fate::Escaped,
            }
        };
        let water = &self.water;
        if (0..water.len())
            .into_par_iter()
            .with_min_len(4096)
            .all(|i| matches!(fate(&water.position[i], &water.velocity[i]), Fate::Stays))
        {
            return;
        }
        let (g, mass) = (self.scene.gravity.at(self.time), self.scene.reference_density * self.kernel.volume);
        let (health, energy) = (&mut self.health, &mut self.energy);
        self.water.retire(|x, v| {
            match fate(x, v) {
                Fate::Stays => return false,
                Fate::Broken => health.broken_particles += 1,
                Fate::Outflow => health.outflow_particles += 1,
                Fate::Escaped => health.escaped_particles += 1,
            }
            let energy_taken = mass * (0.5 * dot(v, v) - dot(&g, x));
            if energy_taken.is_finite() {
                energy.work -= energy_taken;
            }
            true
        });
        self.water.sort(&self.grid);
    }

    /// Pressure at the markers, mean over the last coupling step, Pa, in the order of `Facets::markers()`.
    pub fn marker_pressure(&self) -> &[f64] {
        &self.marker_pressure
    }

    /// Force of the water on the interface nodes, mean over the last coupling step, `[n, D]` N (2-D: N per m depth).
    pub fn pair_force(&self) -> &[f64] {
        &self.pair_force
    }

    /// Numbers that say whether to trust the run.
    pub fn health(&self) -> &Health {
        &self.health
    }

    /// Wall time per phase.
    pub fn phases(&self) -> Vec<PhaseTime> {
        self.clock.table()
    }

    /// Simulated time, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// n0 = sum W on the full lattice, 1/m^D.
    pub fn lattice_density(&self) -> f64 {
        self.kernel.lattice_density
    }

    /// Spacing of the lattice, m.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Sub-steps of the last coupling step.
    pub fn last_substeps(&self) -> u32 {
        self.last_substeps
    }

    /// The water's columns.
    pub fn water(&self) -> &Water<D> {
        &self.water
    }

    /// The wall particles.
    pub fn walls(&self) -> &Walls<D> {
        &self.walls
    }

    /// The pressure matrix of the last sub-step.
    pub fn matrix(&self) -> &PressureMatrix {
        &self.matrix
    }

    /// The scene as resolved.
    pub fn scene(&self) -> &Scene<D> {
        &self.scene
    }

    /// Kinetic and potential energy and the work done on the water, J.
    pub fn energy(&self) -> (f64, f64, f64) {
        (self.energy.kinetic, self.energy.potential, self.energy.work)
    }
}

#[derive(Debug, Clone, Copy)]
enum Fate {
    Stays,
    Broken,
    Outflow,
    Escaped,
}

/// The grid covers the tank, its walls, and half the tank's size beyond open faces.
fn grid_around<const D: usize>(scene: &Scene<D>, kernel: &Kernel<D>) -> Grid<D> {
    let (tank, edge) = (&scene.tank, kernel.support_radius);
    let beyond = |k: usize, side: usize| {
        if tank.open[k][side] { 0.5 * (tank.max[k] - tank.min[k]) } else { 0.0 }
    };
    let lower = std::array::from_fn(|k| tank.min[k] - beyond(k, 0) - 2.0 * edge);
    let upper = std::array::from_fn(|k| tank.max[k] + beyond(k, 1) + 2.0 * edge);
    Grid::new(&lower, &upper, edge)
}

/// Removes the water the body stands in: closer than 0.7 spacings to one of its particles.
fn carve<const D: usize>(
    (grid, walls): (&Grid<D>, &Walls<D>),
    spacing: f64,
    position: &mut Vec<Vector<D>>,
    velocity: &mut Vec<Vector<D>>,
) -> Result<(), SetupError> {
    let mut near = crate::cells::Neighbours::default();
    let mut is_free = |x: &Vector<D>| {
        let Some(cell) = grid.inner_cell(x) else { return true };
        let Some(set) = walls.sets_near(grid, cell)[1] else { return true };
        near.find(grid, set.cells, (cell, x), ((0.7 * spacing).powi(2), 1.0));
        near.is_empty()
    };
    let free: Vec<bool> = position.iter().map(&mut is_free).collect();
    let count = position.len();
    let mut kept = free.iter();
    position.retain(|_| *kept.next().expect("one flag per particle"));
    let mut kept = free.iter();
    velocity.retain(|_| *kept.next().expect("one flag per particle"));
    if position.is_empty() && count > 0 { Err(SetupError::WaterInsideBody { count }) } else { Ok(()) }
}
