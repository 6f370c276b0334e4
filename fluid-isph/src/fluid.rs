//! The water and everything around it: what a run calls, and the state `phases.rs` works on.

use protocol::interface::Response;
use protocol::phases::{PhaseClock, PhaseTime};
use serde::{Deserialize, Serialize};

use crate::assembly::WallMoments;
use crate::body::Body;
use crate::cells::Grid;
use crate::correction::Guard;
use crate::error::{FluidError, StepFault};
use crate::health::Health;
use crate::kernel::Kernel;
use crate::markers::Markers;
use crate::nodes::Motion;
use crate::obstacle::Obstacles;
use crate::particles::Water;
use crate::periodic::Periodic;
use crate::pressure::conjugate_gradient::ConjugateGradient;
use crate::pressure::matrix::PressureMatrix;
use crate::pressure::preconditioner::Preconditioner;
use crate::scene::Scene;
use crate::shifting::Shifting;
use crate::time_step::StepLimits;
use crate::turbulence::Smagorinsky;
use crate::vector::{Vector, norm};
use crate::viscosity::Viscosity;
use crate::wall_pressure::WallSearch;
use crate::walls::Walls;
use crate::weakly_compressible::WeaklyCompressible;

/// The run stops when water is faster than this times the largest speed the scene can produce.
pub(crate) const RUNAWAY: f64 = 10.0;

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
    pub(crate) obstacles: Option<Obstacles<D>>,
    pub(crate) periodic: Option<Periodic<D>>,
    pub(crate) body: Option<Body<D>>,
    pub(crate) markers: Option<Markers<D>>,
    pub(crate) viscosity: Option<Viscosity<D>>,
    pub(crate) turbulence: Option<Smagorinsky>,
    pub(crate) shifting: Option<Shifting<D>>,
    pub(crate) health: Health,
    pub(crate) matrix: PressureMatrix,
    pub(crate) moments: WallMoments<D>,
    pub(crate) source: Vec<f32>,
    pub(crate) preconditioner: Preconditioner<D>,
    pub(crate) explicit: Option<WeaklyCompressible>,
    pub(crate) solver: ConjugateGradient,
    pub(crate) wall_search: WallSearch,
    pub(crate) guard: Guard<D>,
    pub(crate) clock: PhaseClock,
    pub(crate) pressure_level: PressureLevel,
    /// Velocity at the start of the sub-step, for a repeat with a shorter one.
    pub(crate) start_velocity: Vec<Vector<D>>,
    pub(crate) partial: Vec<[f64; 3]>,
    /// Whether the coupler passes over the present coupling step more than once.
    pub(crate) has_passes: bool,
    pub(crate) step_number: u64,
    pub(crate) time: f64,
    /// Length of the sub-step solved last, s.
    pub(crate) last_substep: f64,
    pub(crate) speed: f64,
    pub(crate) speed_limit: f64,
    pub(crate) energy: Energy,
    /// Height of the water's surface at the start above the lowest corner of the tank, along gravity, m.
    pub(crate) surface: f64,
    pub(crate) marker_pressure: Vec<f64>,
    pub(crate) pair_force: Vec<f64>,
    pub(crate) last_substeps: u32,
    pub(crate) iterations: u64,
    pub(crate) clamped: u64,
    pub(crate) solved: u64,
}

/// A part of a coupling step whose flow is known.
#[derive(Debug, Clone, Copy)]
pub struct SubStep {
    /// Its length, s.
    dt: f64,
    /// Its share in the coupling step.
    share: f64,
}

/// What the level of the pressure and its negative values mean in a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PressureLevel {
    /// The free surface has P = 0 and water bears no tension: negative pressures are set to zero and counted.
    Clamped,
    /// The free surface has P = 0; negative pressures stand.
    Free,
    /// Full tank: no level, the mean of the source is removed and the least pressure shifted above zero.
    Shifted,
}

/// Energy account, J (2-D: per m depth).
#[derive(Debug, Default, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Energy {
    pub(crate) kinetic: f64,
    pub(crate) potential: f64,
    /// Work done on the water since the start, less what left with particles.
    pub(crate) work: f64,
    pub(crate) start: f64,
    pub(crate) reference: f64,
}

impl<const D: usize> Fluid<D> {
    pub(crate) fn largest_gravity(&self) -> f64 {
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

    /// Mass of one water particle, kg (2-D: kg per m depth).
    pub fn particle_mass(&self) -> f64 {
        self.scene.reference_density * self.kernel.volume
    }

    /// Longest sub-step allowed now, s; infinite if nothing limits it.
    pub fn admitted_time_step(&self) -> f64 {
        self.step_limits().longest()
    }

    fn step_limits(&self) -> StepLimits {
        let eddy = self.turbulence.iter().flat_map(|model| &model.eddy_viscosity);
        let eddy = eddy.fold(0.0, |largest: f64, &nu| largest.max(nu));
        let body = self.body.as_ref().map_or(0.0, Body::largest_speed);
        let obstacles = self.obstacles.as_ref();
        let (speed, acceleration) =
            obstacles.map_or((0.0, 0.0), |obstacles| obstacles.speed_and_acceleration(self.time));
        StepLimits {
            courant: self.scene.courant,
            spacing: self.spacing,
            speed: self.speed.max(body).max(speed) + self.scene.explicit.map_or(0.0, |one| one.sound_speed),
            acceleration: self
                .largest_gravity()
                .max(norm(&self.scene.gravity.at(self.time)))
                .max(acceleration),
            viscosity: self.viscosity.as_ref().map_or(0.0, |term| term.kinematic_viscosity + eddy),
        }
    }

    /// Advances one coupling step of `dt` s, in as many sub-steps as the water needs.
    ///
    /// # Errors
    /// [`FluidError`] with the step, the time and the cause.
    pub fn advance(&mut self, dt: f64, motion: Option<Motion<'_>>) -> Result<(), FluidError> {
        let last = self.respond(dt, motion)?;
        self.load(last);
        self.follow(last)
    }

    /// A coupling step of `dt` s up to the flow over its last sub-step; its [load](Self::load) is next, and that the water
    /// [follows](Self::follow).
    ///
    /// # Errors
    /// [`FluidError`] with the step, the time and the cause.
    pub fn respond(&mut self, dt: f64, motion: Option<Motion<'_>>) -> Result<SubStep, FluidError> {
        self.step_number += 1;
        // One entry into the thread pool for all of it instead of one for each loop.
        let result = rayon::scope(|_| self.respond_in_pool(dt, motion));
        result.map_err(|fault| self.fault(fault))
    }

    /// The load on the body over a sub-step whose flow is known. After the last one of a coupling step the means over it
    /// stand, [`Self::marker_pressure`] and [`Self::pair_force`], which is all a structure waits for.
    pub fn load(&mut self, substep: SubStep) {
        rayon::scope(|_| self.find_load(substep.dt));
        let Some(body) = &mut self.body else { return };
        body.add_nodal_load(substep.share, &mut self.pair_force);
        body.nodes.move_on(substep.dt);
        let pressures = self.markers.iter().flat_map(|markers| &markers.pressure);
        for (mean, pressure) in self.marker_pressure.iter_mut().zip(pressures) {
            *mean += substep.share * pressure;
        }
    }

    /// Lets the water follow the flow over the last sub-step, which ends the coupling step.
    ///
    /// # Errors
    /// [`FluidError`] with the step, the time and the cause.
    pub fn follow(&mut self, last: SubStep) -> Result<(), FluidError> {
        let result = rayon::scope(|_| self.follow_in_pool(last.dt));
        result.map_err(|fault| self.fault(fault))?;
        if let Some(body) = self.body.as_mut().filter(|body| body.response == Response::Robin) {
            body.remember_pressure(&self.walls);
        }
        Ok(())
    }

    fn fault(&self, fault: StepFault) -> FluidError {
        FluidError { step: self.step_number, time: self.time, fault }
    }

    fn respond_in_pool(&mut self, dt: f64, motion: Option<Motion<'_>>) -> Result<SubStep, StepFault> {
        self.take_motion(motion)?;
        self.marker_pressure.fill(0.0);
        self.pair_force.fill(0.0);
        let (mut done, mut taken) = (0.0, 0);
        loop {
            let rest = dt - done;
            let count = (rest / (STEP_TOLERANCE * self.admitted_time_step())).ceil().max(1.0);
            let needed = u64::from(taken) + count as u64;
            if needed > u64::from(self.scene.max_substeps) {
                return Err(StepFault::TooManySubsteps { needed, limit: self.scene.max_substeps });
            }
            let wanted = rest / count;
            if let Some(cause) = self.step_limits().binding(wanted) {
                self.health.limited_steps[cause] += 1;
            }
            let taken_dt = match self.explicit {
                Some(_) => self.find_flow_explicitly(wanted)?,
                None => self.find_flow(wanted)?,
            };
            let substep = SubStep { dt: taken_dt, share: taken_dt / dt };
            done += substep.dt;
            taken += 1;
            if dt - done <= 1e-9 * dt {
                self.last_substeps = taken;
                return Ok(substep);
            }
            self.load(substep);
            self.follow_in_pool(substep.dt)?;
        }
    }

    fn follow_in_pool(&mut self, dt: f64) -> Result<(), StepFault> {
        match self.explicit {
            Some(_) => self.follow_flow_explicitly(dt),
            None => self.follow_flow(dt),
        }
    }

    /// Whether the coupling steps to come may be passed over again, so that their answers are compared.
    pub fn expect_passes(&mut self, has_passes: bool) {
        self.has_passes = has_passes;
    }

    /// Whether a Robin wall gives way in the coupling steps to come, or moves as given, as any other wall does.
    pub fn let_wall_give_way(&mut self, gives_way: bool) {
        if let Some(body) = &mut self.body {
            body.gives_way = gives_way && body.response == Response::Robin;
        }
    }

    fn take_motion(&mut self, motion: Option<Motion<'_>>) -> Result<(), StepFault> {
        let (Some(body), Some(motion)) = (&mut self.body, motion) else { return Ok(()) };
        let expected = body.nodes.len() * D;
        let given = [Some(motion.position), Some(motion.velocity), motion.acceleration, motion.normal];
        for column in given.into_iter().flatten() {
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

    pub(crate) fn timed<T>(&mut self, name: &'static str, phase: impl FnOnce(&mut Self) -> T) -> T {
        let mut clock = std::mem::take(&mut self.clock);
        let result = clock.run(name, || phase(self));
        self.clock = clock;
        result
    }

    /// Pressure at the markers, mean over the last coupling step, Pa, in the order of `Facets::markers()` or `Points::markers()`.
    pub fn marker_pressure(&self) -> &[f64] {
        &self.marker_pressure
    }

    /// Force of the water on the interface nodes, or points, mean over the last coupling step, `[n, D]` N (2-D: N per m depth).
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

    /// Kinetic and potential energy at the start, J.
    pub fn start_energy(&self) -> f64 {
        self.energy.start
    }

    /// Kinetic and potential energy and the work done on the water, J.
    pub fn energy(&self) -> (f64, f64, f64) {
        (self.energy.kinetic, self.energy.potential, self.energy.work)
    }
}
