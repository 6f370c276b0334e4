//! The solid as its users see it: made from a scene, loaded, advanced, read.

use protocol::interface::Surface;
use protocol::phases::PhaseTime;

use crate::assembly::Assembly;
use crate::body::Body;
use crate::body::restart::Whole;
use crate::error::{SolidError, Trouble};
use crate::halving;
use crate::linear::LinearMethod;
use crate::load::{Load, Loads, When};
use crate::mesh::Mesh;
use crate::modes::{self, Mode};
use crate::scene::Scene;
use crate::state::{Counts, Span, State};
use crate::step;
use crate::support::Supports;
use crate::surface;

/// A body under way.
pub struct Solid {
    scene: Scene,
    surface: Surface,
    /// Mesh node of each interface node.
    interface_node: Vec<usize>,
    pub(crate) body: Body,
    /// m.
    smallest_cell: f64,
    saved: Saved,
    retry: Saved,
}

/// Everything a step can be repeated from.
#[derive(Debug, Clone, Default)]
struct Saved {
    state: State,
    load: (Vec<f64>, Vec<f64>),
}

/// What a step took.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Advance {
    /// Sub-steps, 1 if nothing went wrong.
    pub substeps: u32,
    /// Newton iterations in all of them; 0 if the predictions stood.
    pub newton_iterations: u64,
}

impl Solid {
    /// Makes the body and finds its static equilibrium under its weight; at rest there, except that own loads that act
    /// from the start accelerate it.
    ///
    /// # Errors
    /// [`SolidError::Scene`] for a scene that is refused; run errors if the weight cannot be carried.
    pub fn new(scene: Scene) -> Result<Self, SolidError> {
        let mut solid = Self::new_at_weight(scene)?;
        solid.body.balance_acceleration().map_err(|trouble| trouble.at(0, 0.0))?;
        Ok(solid)
    }

    /// The body as drawn, at rest; weight and own loads accelerate it from the start.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn new_unloaded(scene: Scene) -> Result<Self, SolidError> {
        let mut solid = Self::in_reference(scene)?;
        solid.body.balance_acceleration().map_err(|trouble| trouble.at(0, 0.0))?;
        Ok(solid)
    }

    /// The same without the acceleration: the start of static steps.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn new_at_weight(scene: Scene) -> Result<Self, SolidError> {
        let mut solid = Self::in_reference(scene)?;
        solid.settle(0.0, 1)?;
        Ok(solid)
    }

    /// The static equilibrium under weight and own loads of time 0, reached in equal load steps (halved where needed).
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn new_static(scene: Scene, load_steps: u32) -> Result<Self, SolidError> {
        let mut solid = Self::in_reference(scene)?;
        solid.settle(1.0, load_steps)?;
        Ok(solid)
    }

    /// The body without any load, at rest in its reference configuration; loads act from the first step on.
    ///
    /// # Errors
    /// [`SolidError::Scene`] for a scene that is refused.
    pub fn in_reference(scene: Scene) -> Result<Self, SolidError> {
        scene.check()?;
        let mesh = scene.mesh();
        let element = scene.element.build(&mesh, &scene.substance);
        let supports = Supports::new(&scene, &mesh)?;
        let (surface, interface_node) = surface::interface(&mesh, &scene.interface, scene.areal_mass());
        let assembly = Assembly::new(mesh, element);
        let mass = assembly.mass(scene.density);
        let interface = (surface.facets.clone(), interface_node.clone());
        let loads = Loads::new(&scene, &assembly.mesh, &mass, interface)?;
        let body =
            Body::new(&scene, assembly, mass, loads, supports).map_err(|trouble| trouble.at(0, 0.0))?;
        let smallest_cell = scene.smallest_cell();
        let (saved, retry) = (Saved::default(), Saved::default());
        Ok(Self { scene, surface, interface_node, body, smallest_cell, saved, retry })
    }

    /// Gives the body a motion, `[n, D]` of the mesh in m and m/s, with the acceleration that balances the forces.
    ///
    /// # Errors
    /// An inverted element.
    pub fn set_motion(&mut self, displacement: &[f64], velocity: &[f64]) -> Result<(), SolidError> {
        self.body.state.displacement.copy_from_slice(displacement);
        let time = self.body.state.time;
        self.body.balance_acceleration().map_err(|trouble| trouble.at(self.body.counts.steps, time))?;
        self.body.state.velocity.copy_from_slice(velocity);
        self.body.is_resting = false;
        Ok(())
    }

    fn settle(&mut self, own: f64, load_steps: u32) -> Result<(), SolidError> {
        let body = &mut self.body;
        if !body.fixed.contains(&true) {
            return Ok(());
        }
        let tolerance = body.tolerance;
        // Rest must be accepted unchanged by every later step: aim far below the tolerance.
        (body.tolerance, body.aim) = (0.1 * tolerance, (1e-5 * tolerance).max(1e-12));
        body.method = LinearMethod::Cholesky;
        let mut at = |factor: f64| {
            let when = When { time: 0.0, fraction: 1.0, weight: factor, own: own * factor };
            body.forget_tangent();
            step::static_step(body, Span { dt: f64::INFINITY, when })
        };
        let mut result = Ok(());
        for load_step in 0..load_steps {
            let factor = |fraction: f64| (f64::from(load_step) + fraction) / f64::from(load_steps);
            result = result.and_then(|()| halving::cross(|_, to| at(factor(to))).map(|_| ()));
        }
        (body.tolerance, body.aim) = (tolerance, tolerance);
        body.counts = Counts::default();
        result.map_err(|trouble: Trouble| trouble.at(0, 0.0))
    }

    /// Advances by `dt` s under a load given at the end of the step (between its last value and this one it is linear).
    /// A body that the last step left as it was sleeps until a load changes: its steps take no work, and the result has the
    /// same bits as if they had. A step that fails is repeated in halves; if it fails altogether the state stays as it was.
    ///
    /// # Errors
    /// The run errors of [`SolidError`].
    pub fn advance(&mut self, dt: f64, load: Load<'_>) -> Result<Advance, SolidError> {
        self.receive(dt, load)?;
        let start = self.body.state.time;
        let is_calm = !self.body.supports.are_moving() && self.body.loads.are_constant(start, start + dt);
        if is_calm && self.body.is_resting {
            self.body.sleep(dt);
            return Ok(Advance { substeps: 1, newton_iterations: 0 });
        }
        let courant = self.courant(1.0);
        let parts = self.scene.max_dt.map_or(1.0, |max_dt| (dt / max_dt * (1.0 - 1e-9)).ceil().max(1.0));
        let done = self.cross((dt, parts as u32), |body, from, to| {
            let part = dt * (to - from);
            body.method = LinearMethod::for_courant(courant * part);
            let when = When { time: start + dt * to, fraction: to, weight: 1.0, own: 1.0 };
            step::step(body, Span { dt: part, when })
        })?;
        let body = &mut self.body;
        let stood = done.substeps == 1 && done.newton_iterations == 0;
        body.is_resting = is_calm && stood && body.state.is_same(&body.trial);
        Ok(done)
    }

    /// Takes the load of a step and keeps the last one for a failed step to go back to.
    fn receive(&mut self, dt: f64, load: Load<'_>) -> Result<(), SolidError> {
        let body = &mut self.body;
        body.counts.steps += 1;
        let lengths = body.loads.lengths();
        let (values, wanted) = match load {
            Load::None => (&[][..], 0),
            Load::NodalForce(force) => (force, lengths.0),
            Load::Traction(traction) => (traction, lengths.1),
        };
        if values.len() != wanted || values.iter().any(|value| !value.is_finite()) || dt <= 0.0 || dt.is_nan()
        {
            return Err(SolidError::NonFinite { step: body.counts.steps, time_s: body.state.time });
        }
        body.loads.save(&mut self.retry.load);
        body.loads.receive(load);
        Ok(())
    }

    fn cross(
        &mut self,
        (dt, parts): (f64, u32),
        mut part: impl FnMut(&mut Body, f64, f64) -> Result<(), Trouble>,
    ) -> Result<Advance, SolidError> {
        let body = &mut self.body;
        self.retry.state.clone_from(&body.state);
        body.is_resting = false;
        let (step, end) = (body.counts.steps, body.state.time + dt);
        let iterations = body.counts.newton_iterations;
        match halving::cross_in(parts, |from, to| part(body, from, to)) {
            Ok((substeps, failed)) => {
                body.counts.halvings += failed;
                Ok(Advance { substeps, newton_iterations: body.counts.newton_iterations - iterations })
            }
            Err(trouble) => {
                body.state.clone_from(&self.retry.state);
                body.loads.restore(&self.retry.load);
                Err(trouble.at(step, end))
            }
        }
    }

    /// Advances by `dt` s without inertia: the static equilibrium under the loads at the end of the step. In the first
    /// step own loads grow from nothing when halves are needed.
    ///
    /// # Errors
    /// The run errors of [`SolidError`].
    pub fn advance_static(&mut self, dt: f64, load: Load<'_>) -> Result<Advance, SolidError> {
        self.receive(dt, load)?;
        let body = &mut self.body;
        let (start, first) = (body.state.time, body.counts.steps == 1);
        body.method = LinearMethod::Cholesky;
        self.cross((dt, 1), |body, _, to| {
            let own = if first { to } else { 1.0 };
            let when = When { time: start + dt * to, fraction: to, weight: 1.0, own };
            step::static_step(body, Span { dt: f64::INFINITY, when })
        })
    }

    /// Largest time step the solid admits, s: any.
    pub fn admitted_dt(&self) -> f64 {
        f64::INFINITY
    }

    /// Keeps the state and load for [`Self::restore`], with what the elements keep. The enhanced strain parameters of
    /// linear laws are functions of the displacement, so they come back with it.
    pub fn save(&mut self) {
        self.saved.state.clone_from(&self.body.state);
        self.body.loads.save(&mut self.saved.load);
    }

    /// Back to the state last saved; without one nothing happens.
    pub fn restore(&mut self) {
        if !self.saved.state.displacement.is_empty() {
            self.body.state.clone_from(&self.saved.state);
            self.body.loads.restore(&self.saved.load);
            self.body.is_resting = false;
        }
    }

    /// The whole state, for a run that goes on from it.
    pub(crate) fn keep(&self) -> Whole {
        self.body.keep()
    }

    /// Goes on from the state of a solid of the same mesh and elements.
    pub(crate) fn take_up(&mut self, whole: Whole) {
        self.body.take_up(whole);
    }

    /// Lengths a state taken up must have.
    pub(crate) fn sizes(&self) -> [(&'static str, usize); 7] {
        let mesh = self.mesh();
        [
            ("dimension", mesh.dimension),
            ("solid_nodes", mesh.node_count()),
            ("solid_elements", mesh.element_count()),
            ("nodes_per_element", mesh.nodes_per_element()),
            ("element_history", self.body.assembly.history_len()),
            ("interface_nodes", self.surface.node_count()),
            ("interface_markers", self.surface.facets.markers().len()),
        ]
    }

    /// The scene it was made from.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The mesh.
    pub fn mesh(&self) -> &Mesh {
        &self.body.assembly.mesh
    }

    /// The wet faces: nodes, facets, areal mass.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// Mesh node of each interface node, `[interface nodes]`.
    pub fn interface_nodes(&self) -> &[usize] {
        &self.interface_node
    }

    /// Time, s.
    pub fn time(&self) -> f64 {
        self.body.state.time
    }

    /// Displacement of the mesh nodes, `[n, D]` m.
    pub fn displacement(&self) -> &[f64] {
        &self.body.state.displacement
    }

    /// Velocity of the mesh nodes, `[n, D]` m/s.
    pub fn velocity(&self) -> &[f64] {
        &self.body.state.velocity
    }

    /// Acceleration of the mesh nodes, `[n, D]` m/s2.
    pub fn acceleration(&self) -> &[f64] {
        &self.body.state.acceleration
    }

    /// Writes displacement m, velocity m/s and acceleration m/s2 of the interface nodes, one block `[n, D]` after the
    /// other: the motion message.
    pub fn write_interface_motion(&self, motion: &mut [f64]) {
        let d = self.scene.dimension();
        let block = self.interface_node.len() * d;
        let columns = [self.displacement(), self.velocity(), self.acceleration()];
        for (target, column) in motion.chunks_exact_mut(block).zip(columns) {
            for (target, &node) in target.chunks_exact_mut(d).zip(&self.interface_node) {
                target.copy_from_slice(&column[node * d..node * d + d]);
            }
        }
    }

    /// Which components of the mesh nodes are held, `[n, D]`.
    pub fn fixed(&self) -> &[bool] {
        &self.body.fixed
    }

    /// External force on the unloaded body at a time, `[n, D]` N.
    pub fn external_force_at(&self, time: f64) -> Vec<f64> {
        let mut force = vec![0.0; self.body.fixed.len()];
        let when = When { time, fraction: 1.0, weight: 1.0, own: 1.0 };
        self.body.loads.external_force(&vec![0.0; force.len()], when, &mut force);
        force
    }

    /// Cauchy stress at the mesh nodes, `[n]` xx yy zz xy yz zx Pa, the mean over the elements around.
    pub fn nodal_stress(&self) -> Vec<[f64; 6]> {
        self.body.assembly.nodal_stress(self.body.state.at())
    }

    /// The lowest natural vibrations about the present state, by the tangent stiffness.
    ///
    /// # Errors
    /// [`SolidError::NotPositiveDefinite`] for a body that buckles or is not supported.
    pub fn modes(&mut self, count: usize) -> Result<Vec<Mode>, SolidError> {
        let time = self.time();
        modes::lowest(&mut self.body, count).map_err(|trouble| trouble.at(self.body.counts.steps, time))
    }

    /// Courant number c dt / h of the longitudinal wave in the smallest cell.
    pub fn courant(&self, dt: f64) -> f64 {
        self.scene.wave_speed() * dt / self.smallest_cell
    }

    /// Which linear solver a time step leads to.
    pub fn linear_method(&self, dt: f64) -> LinearMethod {
        LinearMethod::for_courant(self.courant(dt))
    }

    /// What the steps took so far.
    pub fn counts(&self) -> Counts {
        self.body.counts
    }

    /// Time per phase so far.
    pub fn phases(&self) -> Vec<PhaseTime> {
        self.body.clock.table()
    }
}
