//! The state at the start of a coupling step, for a coupler that passes over the step again, and the state at its end,
//! for a run that goes on from it.
//!
//! What follows from it at the start of a sub-step (cells, matrix, wall pressure, place of the body) is not kept.

use serde::{Deserialize, Serialize};

use crate::fluid::{Energy, Fluid};
use crate::health::Health;
use crate::vector::Vector;

/// State kept; the room is reused from step to step.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Snapshot {
    /// `[n, D]`
    position: Vec<f64>,
    /// `[n, D]`
    velocity: Vec<f64>,
    pressure: Vec<f32>,
    last_pressure: Vec<f32>,
    number_density: Vec<f32>,
    id: Vec<u32>,
    old_pressure: Vec<[f32; 2]>,
    /// Limits the next sub-step.
    eddy_viscosity: Vec<f64>,
    health: Health,
    energy: Energy,
    step_number: u64,
    time: f64,
    last_substep: f64,
    speed: f64,
    speed_limit: f64,
}

/// What a run goes on from: a snapshot and what is counted over the whole run.
#[derive(Debug, Serialize, Deserialize)]
pub struct Whole {
    snapshot: Snapshot,
    iterations: u64,
    clamped: u64,
    solved: u64,
    /// Of the explicit scheme, by particle number, kg/m3.
    density: Option<Vec<f64>>,
}

impl<const D: usize> Fluid<D> {
    /// Keeps the state.
    pub fn save(&self, snapshot: &mut Snapshot) {
        flatten(&self.water.position, &mut snapshot.position);
        flatten(&self.water.velocity, &mut snapshot.velocity);
        snapshot.pressure.clone_from(&self.water.pressure);
        snapshot.last_pressure.clone_from(&self.water.last_pressure);
        snapshot.number_density.clone_from(&self.water.number_density);
        snapshot.id.clone_from(&self.water.id);
        if let Some(body) = &self.body {
            snapshot.old_pressure.clone_from(&body.old_pressure);
        }
        if let Some(model) = &self.turbulence {
            snapshot.eddy_viscosity.clone_from(&model.eddy_viscosity);
        }
        snapshot.health.clone_from(&self.health);
        (snapshot.energy, snapshot.step_number, snapshot.time) = (self.energy, self.step_number, self.time);
        (snapshot.speed, snapshot.speed_limit) = (self.speed, self.speed_limit);
        snapshot.last_substep = self.last_substep;
    }

    /// Goes back to the state kept. Times and iterations of the passes that are given up stay counted.
    pub fn restore(&mut self, snapshot: &Snapshot) {
        unflatten(&snapshot.position, &mut self.water.position);
        unflatten(&snapshot.velocity, &mut self.water.velocity);
        self.water.pressure.clone_from(&snapshot.pressure);
        self.water.last_pressure.clone_from(&snapshot.last_pressure);
        self.water.number_density.clone_from(&snapshot.number_density);
        self.water.id.clone_from(&snapshot.id);
        if let Some(body) = &mut self.body {
            body.old_pressure.clone_from(&snapshot.old_pressure);
        }
        if let Some(model) = &mut self.turbulence {
            model.eddy_viscosity.clone_from(&snapshot.eddy_viscosity);
        }
        self.health.clone_from(&snapshot.health);
        (self.energy, self.step_number, self.time) = (snapshot.energy, snapshot.step_number, snapshot.time);
        (self.speed, self.speed_limit) = (snapshot.speed, snapshot.speed_limit);
        self.last_substep = snapshot.last_substep;
    }

    /// The state at the end of a coupling step.
    pub fn keep(&self) -> Whole {
        let mut snapshot = Snapshot::default();
        self.save(&mut snapshot);
        if self.body.is_some() {
            // Also of a wall that does not give way: the run that goes on may let it.
            snapshot.old_pressure = self.walls.pressure[self.walls.body()].to_vec();
        }
        Whole {
            snapshot,
            iterations: self.iterations,
            clamped: self.clamped,
            solved: self.solved,
            density: self.explicit.as_ref().map(|scheme| scheme.density.clone()),
        }
    }

    /// Goes on from a state kept in the same scene.
    pub fn take_up(&mut self, whole: Whole) {
        self.restore(&whole.snapshot);
        (self.iterations, self.clamped, self.solved) = (whole.iterations, whole.clamped, whole.solved);
        if let (Some(scheme), Some(density)) = (&mut self.explicit, whole.density) {
            scheme.density = density;
        }
    }
}

fn flatten<const D: usize>(column: &[Vector<D>], flat: &mut Vec<f64>) {
    flat.clear();
    flat.extend_from_slice(column.as_flattened());
}

fn unflatten<const D: usize>(flat: &[f64], column: &mut Vec<Vector<D>>) {
    column.resize(flat.len() / D, [0.0; D]);
    column.as_flattened_mut().copy_from_slice(flat);
}
