//! The state at the start of a coupling step, for a coupler that passes over the step again.
//!
//! What follows from it at the start of a sub-step (cells, matrix, wall pressure, place of the body) is not kept.

use crate::fluid::{Energy, Fluid};
use crate::health::Health;
use crate::vector::Vector;

/// State kept; the room is reused from step to step.
#[derive(Debug, Default)]
pub struct Snapshot<const D: usize> {
    position: Vec<Vector<D>>,
    velocity: Vec<Vector<D>>,
    pressure: Vec<f32>,
    last_pressure: Vec<f32>,
    number_density: Vec<f32>,
    id: Vec<u32>,
    old_pressure: Vec<[f32; 2]>,
    health: Health,
    energy: Energy,
    step_number: u64,
    time: f64,
    last_substep: f64,
    speed: f64,
    speed_limit: f64,
}

impl<const D: usize> Fluid<D> {
    /// Keeps the state.
    pub fn save(&self, snapshot: &mut Snapshot<D>) {
        snapshot.position.clone_from(&self.water.position);
        snapshot.velocity.clone_from(&self.water.velocity);
        snapshot.pressure.clone_from(&self.water.pressure);
        snapshot.last_pressure.clone_from(&self.water.last_pressure);
        snapshot.number_density.clone_from(&self.water.number_density);
        snapshot.id.clone_from(&self.water.id);
        if let Some(body) = &self.body {
            snapshot.old_pressure.clone_from(&body.old_pressure);
        }
        snapshot.health.clone_from(&self.health);
        (snapshot.energy, snapshot.step_number, snapshot.time) = (self.energy, self.step_number, self.time);
        (snapshot.speed, snapshot.speed_limit) = (self.speed, self.speed_limit);
        snapshot.last_substep = self.last_substep;
    }

    /// Goes back to the state kept. Times and iterations of the passes that are given up stay counted.
    pub fn restore(&mut self, snapshot: &Snapshot<D>) {
        self.water.position.clone_from(&snapshot.position);
        self.water.velocity.clone_from(&snapshot.velocity);
        self.water.pressure.clone_from(&snapshot.pressure);
        self.water.last_pressure.clone_from(&snapshot.last_pressure);
        self.water.number_density.clone_from(&snapshot.number_density);
        self.water.id.clone_from(&snapshot.id);
        if let Some(body) = &mut self.body {
            body.old_pressure.clone_from(&snapshot.old_pressure);
        }
        self.health.clone_from(&snapshot.health);
        (self.energy, self.step_number, self.time) = (snapshot.energy, snapshot.step_number, snapshot.time);
        (self.speed, self.speed_limit) = (snapshot.speed, snapshot.speed_limit);
        self.last_substep = snapshot.last_substep;
    }
}
