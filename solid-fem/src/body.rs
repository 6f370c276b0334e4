//! The body in motion: matrices, state, and the phases of one step that [`crate::step`] puts in order.

mod evaluation;
pub(crate) mod restart;

use protocol::phases::PhaseClock;

use crate::assembly::{Assembly, At};
use crate::error::Trouble;
use crate::integrator::{Coefficients, Integrator};
use crate::linear::block_matrix::BlockMatrix;
use crate::linear::vector::Summation;
use crate::linear::{LinearMethod, LinearSolver};
use crate::load::Loads;
use crate::scene::Scene;
use crate::state::{Counts, Span, State};
use crate::support::Supports;

/// Newton iterations before an attempt is given up.
const MAX_ITERATIONS: u32 = 25;

/// A residual that falls by less than this asks for a new tangent.
const KEEP_TANGENT_BELOW: f64 = 0.2;

/// Relative tolerance of linear solves: the residual falls by about as much per iteration.
const LINEAR_TOLERANCE: f64 = 1e-2;

/// The body, its state and the work arrays of a step.
pub(crate) struct Body {
    pub(crate) assembly: Assembly,
    pub(crate) mass: BlockMatrix,
    pub(crate) loads: Loads,
    pub(crate) state: State,
    pub(crate) trial: State,
    pub(crate) counts: Counts,
    pub(crate) clock: PhaseClock,
    /// Which components do not move freely, `[n, D]`.
    pub(crate) fixed: Vec<bool>,
    /// The last step, under loads that did not change, led from the state to itself: the same one again would, too.
    pub(crate) is_resting: bool,
    pub(crate) supports: Supports,
    stiffness: BlockMatrix,
    /// Of the last tangent; zero before the first.
    stiffness_diagonal: Vec<f64>,
    system: BlockMatrix,
    linear: LinearSolver,
    pub(crate) coefficients: Coefficients,
    /// The internal force is that of the energy-momentum method.
    is_conserving: bool,
    /// The tangent is the same at every displacement: it is assembled once, and the internal force is K u.
    is_linear: bool,
    /// Mass-proportional part, 1/s.
    damping: f64,
    /// Stiffness-proportional part b K of the unloaded body, N s/m.
    stiffness_damping: Option<BlockMatrix>,
    /// Residual over the largest force at which a step is accepted.
    pub(crate) tolerance: f64,
    /// Residual over the largest force to aim for; between the two a residual is accepted once it falls no further.
    pub(crate) aim: f64,
    pub(crate) method: LinearMethod,
    tangent_serves: bool,
    /// Factors of mass, stiffness and stiffness-proportional damping the system was combined with.
    combined: Option<[f64; 3]>,
    residual: Vec<f64>,
    increment: Vec<f64>,
    work: Vec<f64>,
    summation: Summation,
    balance: Balance,
}

/// How far the forces are from balance.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Balance {
    norm: f64,
    previous: f64,
    limit: f64,
    aim: f64,
    iterations: u32,
}

impl Body {
    pub(crate) fn new(
        scene: &Scene,
        assembly: Assembly,
        mass: BlockMatrix,
        loads: Loads,
        supports: Supports,
    ) -> Result<Self, Trouble> {
        let fixed = supports.fixed.clone();
        let zeros = || vec![0.0; fixed.len()];
        let state = State {
            time: 0.0,
            displacement: zeros(),
            velocity: zeros(),
            acceleration: zeros(),
            internal_force: zeros(),
            external_force: zeros(),
            history: vec![0.0; assembly.history_len()],
        };
        let empty = BlockMatrix::zeros(&assembly.pattern);
        let mut body = Self {
            linear: LinearSolver::new(&assembly.pattern, &assembly.mesh.reference_position),
            trial: state.clone(),
            state,
            counts: Counts::default(),
            clock: PhaseClock::default(),
            stiffness: empty.clone(),
            stiffness_diagonal: zeros(),
            system: empty,
            coefficients: scene.integrator.coefficients(),
            is_conserving: scene.integrator == Integrator::EnergyMomentum,
            is_linear: scene.substance.is_linear(),
            damping: scene.damping,
            stiffness_damping: None,
            tolerance: scene.newton_tolerance,
            aim: scene.newton_tolerance,
            method: LinearMethod::Cholesky,
            tangent_serves: false,
            combined: None,
            residual: zeros(),
            increment: zeros(),
            work: zeros(),
            summation: Summation::new(fixed.len()),
            balance: Balance::default(),
            assembly,
            mass,
            loads,
            fixed,
            is_resting: false,
            supports,
        };
        if body.is_linear || scene.stiffness_damping > 0.0 {
            body.assembly.tangent(body.state.at(), &mut body.stiffness)?;
        }
        if scene.stiffness_damping > 0.0 {
            let mut matrix = body.stiffness.clone();
            matrix.values.iter_mut().for_each(|value| *value *= scene.stiffness_damping);
            body.stiffness_damping = Some(matrix);
        }
        if body.is_linear {
            body.stiffness.diagonal(&mut body.stiffness_diagonal);
            body.tangent_serves = true;
        }
        Ok(body)
    }

    /// The step of a body that rests under loads that do not change: only time goes on.
    pub(crate) fn sleep(&mut self, dt: f64) {
        self.state.time += dt;
        self.counts.substeps += 1;
        self.counts.skipped += 1;
        self.counts.slept += 1;
    }

    /// Runs one phase and books its time.
    pub(crate) fn timed<T>(&mut self, name: &'static str, phase: impl FnOnce(&mut Self) -> T) -> T {
        let mut clock = std::mem::take(&mut self.clock);
        let result = clock.run(name, || phase(self));
        self.clock = clock;
        result
    }

    /// u1 = u0 + dt v0 + dt2 a0 / 2, v1 = v0 + dt a0, a1 = a0.
    pub(crate) fn predict(&mut self, span: Span) {
        let (state, trial, dt) = (&self.state, &mut self.trial, span.dt);
        trial.acceleration.copy_from_slice(&state.acceleration);
        for i in 0..self.fixed.len() {
            trial.displacement[i] =
                state.displacement[i] + dt * state.velocity[i] + 0.5 * dt * dt * state.acceleration[i];
            trial.velocity[i] = state.velocity[i] + dt * state.acceleration[i];
        }
        trial.time = state.time + dt;
        self.supports.move_to(trial);
        self.balance = Balance::default();
    }

    /// The last displacement again, at rest: the prediction of a static step.
    pub(crate) fn predict_rest(&mut self, time: f64) {
        self.trial.displacement.copy_from_slice(&self.state.displacement);
        self.trial.velocity.fill(0.0);
        self.trial.acceleration.fill(0.0);
        self.trial.time = time;
        self.supports.move_to(&mut self.trial);
        self.balance = Balance::default();
    }

    /// Residual (1-af) (F1 - f1) + af (F0 - f0) - M [(1-am) a1 + am a0] - C [(1-af) v1 + af v0] at the trial state, and
    /// its limit; in the energy-momentum method its own force stands for (1-af) f1 + af f0.
    pub(crate) fn balance(&mut self, span: Span) -> Result<(), Trouble> {
        let is_static = span.dt.is_infinite();
        let alpha_f = self.effective(span.dt).alpha_f;
        let trial = &mut self.trial;
        self.loads.external_force(&trial.displacement, span.when, &mut trial.external_force);
        self.find_internal_force()?;
        if is_static {
            self.increment.fill(0.0);
        } else {
            self.find_inertia(span);
        }
        let (trial, state) = (&self.trial, &self.state);
        for i in 0..self.fixed.len() {
            let new = trial.external_force[i] - trial.internal_force[i];
            let old = if is_static { 0.0 } else { state.external_force[i] - state.internal_force[i] };
            self.residual[i] = (1.0 - alpha_f) * new + alpha_f * old - self.increment[i];
        }
        if self.is_conserving && !is_static {
            self.assembly.conserving_force(&state.displacement, &trial.displacement, &mut self.work)?;
            for i in 0..self.fixed.len() {
                let blended = (1.0 - alpha_f) * trial.internal_force[i] + alpha_f * state.internal_force[i];
                self.residual[i] += blended - self.work[i];
            }
        }
        for i in (0..self.fixed.len()).filter(|&i| self.fixed[i]) {
            (self.residual[i], self.increment[i]) = (0.0, 0.0);
        }
        self.measure()
    }

    fn find_internal_force(&mut self) -> Result<(), Trouble> {
        let State { displacement, history, internal_force, .. } = &mut self.trial;
        if self.is_linear {
            self.stiffness.multiply(displacement, internal_force);
            return Ok(());
        }
        // What the elements keep is that of the last accepted state until the trial becomes it.
        self.assembly.internal_force(
            At { displacement, history: &self.state.history },
            internal_force,
            history,
        )
    }

    /// Writes M [(1-am) a1 + am a0] + C [(1-af) v1 + af v0] into `increment`.
    fn find_inertia(&mut self, span: Span) {
        let Coefficients { alpha_m, alpha_f, .. } = self.effective(span.dt);
        let (trial, state) = (&self.trial, &self.state);
        let velocity = |i: usize| (1.0 - alpha_f) * trial.velocity[i] + alpha_f * state.velocity[i];
        for i in 0..self.fixed.len() {
            let (new, old) = (trial.acceleration[i], state.acceleration[i]);
            self.work[i] = (1.0 - alpha_m) * new + alpha_m * old;
            self.work[i] += self.damping * velocity(i);
        }
        self.mass.multiply(&self.work, &mut self.increment);
        if let Some(damping) = &self.stiffness_damping {
            // The residual is not yet made: it lends its room.
            (0..self.fixed.len()).for_each(|i| self.work[i] = velocity(i));
            damping.multiply(&self.work, &mut self.residual);
            for i in 0..self.fixed.len() {
                self.increment[i] += self.residual[i];
            }
        }
    }

    /// Norm of the residual and the limit it must fall below: the tolerance times the largest of the forces in balance,
    /// but never less than the round-off of the internal force, which in thin stiff bodies is a small difference of
    /// large terms K_ii u_i.
    fn measure(&mut self) -> Result<(), Trouble> {
        let inertia = self.summation.norm(&self.increment);
        let mut free_norm = |force: &[f64]| {
            for i in 0..force.len() {
                self.work[i] = if self.fixed[i] { 0.0 } else { force[i] };
            }
            self.summation.norm(&self.work)
        };
        let scale =
            free_norm(&self.trial.external_force).max(free_norm(&self.trial.internal_force)).max(inertia);
        for i in 0..self.fixed.len() {
            self.work[i] = self.stiffness_diagonal[i] * self.trial.displacement[i];
        }
        let round_off = f64::EPSILON * self.summation.norm(&self.work);
        self.balance.previous = self.balance.norm;
        self.balance.norm = self.summation.norm(&self.residual);
        self.balance.limit = (self.tolerance * scale).max(round_off);
        self.balance.aim = (self.aim * scale).max(round_off);
        let Balance { norm, previous, limit, iterations, .. } = self.balance;
        if !norm.is_finite() {
            return Err(Trouble::NonFinite);
        }
        if iterations > 0 && norm > KEEP_TANGENT_BELOW * previous && !self.is_linear {
            self.tangent_serves = false;
        }
        if norm > limit && iterations >= MAX_ITERATIONS {
            return Err(Trouble::Stalled { residual: norm, limit, iterations });
        }
        Ok(())
    }

    /// Whether the residual is as small as asked for, or below its limit and at the level of round-off.
    pub(crate) fn is_balanced(&self) -> bool {
        let Balance { norm, previous, limit, aim, iterations } = self.balance;
        norm <= aim || (norm <= limit && iterations > 1 && norm > 0.5 * previous)
    }

    /// The tangent and the system made of it and the mass, where the last ones no longer serve.
    pub(crate) fn assemble_tangent(&mut self, span: Span) -> Result<(), Trouble> {
        let Coefficients { alpha_m, alpha_f, gamma, beta } = self.effective(span.dt);
        let inertia = (1.0 - alpha_m) / (beta * span.dt * span.dt);
        let damping = (1.0 - alpha_f) * gamma / (beta * span.dt);
        let factors = [inertia + damping * self.damping, 1.0 - alpha_f, damping];
        if !self.tangent_serves {
            let displacement = &self.trial.displacement;
            self.assembly.tangent(At { displacement, history: &self.state.history }, &mut self.stiffness)?;
            self.stiffness.diagonal(&mut self.stiffness_diagonal);
            self.tangent_serves = true;
            self.combined = None;
            self.counts.tangents += 1;
        }
        if self.combined != Some(factors) {
            let terms = self.mass.values.iter().zip(&self.stiffness.values);
            for (value, (mass, stiffness)) in self.system.values.iter_mut().zip(terms) {
                *value = factors[0] * mass + factors[1] * stiffness;
            }
            if let Some(matrix) = &self.stiffness_damping {
                let terms = self.system.values.iter_mut().zip(&matrix.values);
                terms.for_each(|(value, damping)| *value += factors[2] * damping);
            }
            self.system.fix(&self.fixed);
            self.combined = Some(factors);
        }
        Ok(())
    }

    /// The increment of the displacement that would remove the residual.
    pub(crate) fn solve_linear(&mut self) -> Result<(), Trouble> {
        let (system, residual) = (&self.system, &self.residual);
        let result = self.linear.solve(self.method, system, residual, &mut self.increment, LINEAR_TOLERANCE);
        self.counts.factorizations = self.linear.factorizations;
        self.counts.linear_iterations = self.linear.iterations;
        if result.is_err() {
            self.tangent_serves = self.is_linear;
        }
        result
    }

    /// Adds the increment to displacement, velocity and acceleration.
    pub(crate) fn correct(&mut self, span: Span) {
        let Coefficients { gamma, beta, .. } = self.coefficients;
        let dt = span.dt;
        for i in 0..self.fixed.len() {
            let increment = self.increment[i];
            self.trial.displacement[i] += increment;
            if dt.is_finite() {
                self.trial.velocity[i] += gamma / (beta * dt) * increment;
                self.trial.acceleration[i] += increment / (beta * dt * dt);
            }
        }
        self.balance.iterations += 1;
        self.counts.newton_iterations += 1;
    }

    /// The trial state becomes the state.
    pub(crate) fn accept(&mut self) {
        self.counts.substeps += 1;
        self.counts.skipped += u64::from(self.balance.iterations == 0);
        std::mem::swap(&mut self.state, &mut self.trial);
    }

    /// A static step has neither mass nor memory.
    fn effective(&self, dt: f64) -> Coefficients {
        if dt.is_infinite() {
            Coefficients { alpha_m: 0.0, alpha_f: 0.0, ..self.coefficients }
        } else {
            self.coefficients
        }
    }

    /// After a change that makes kept tangents and factors useless.
    pub(crate) fn forget_tangent(&mut self) {
        self.tangent_serves = self.is_linear;
        self.combined = None;
        self.linear.forget();
    }
}
