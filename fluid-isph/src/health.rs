//! Health of a run: the numbers that say whether to trust it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Running extremes and counts; formulas beside the fields.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Health {
    /// max |v| over particles and time, m/s.
    pub max_speed: f64,
    /// max |n_i/n0 - 1| over particles with n_i >= 0.95 n0 and over time.
    pub max_density_error: f64,
    /// |sum V n0/n_i / (N V) - 1| over the particles with n_i >= 0.95 n0 (mean compression of the interior), at the
    /// last step.
    pub volume_error: f64,
    /// Largest (E - E0 - W)/E_ref over time: E = kinetic + potential energy, W the work of moving walls and of the
    /// change of gravity, less the energy that left with particles; E_ref the energy at the start above the lowest
    /// corner of the tank, or the largest kinetic energy if that is larger.
    pub energy_error: f64,
    /// Particles that went through a closed wall.
    pub escaped_particles: u64,
    /// Particles that left through an open face.
    pub outflow_particles: u64,
    /// Particles that became not finite.
    pub broken_particles: u64,
    /// Negative pressures set to zero, over all pressures solved for.
    pub clamped_share: f64,
    /// Particles stopped by the wall guard, in all steps.
    pub guard_hits: u64,
    /// Most particles at once that stood inside a wall, of tank, obstacles or body, more than a quarter of a spacing deep.
    pub most_inside_walls: u64,
    /// Iterations of the pressure solve, mean over the sub-steps.
    pub mean_pressure_iterations: f64,
    /// Sub-steps taken.
    pub substeps: u64,
    /// Sub-steps repeated with half the length because water moved too far.
    pub shortened_steps: u64,
    /// Sub-steps held down by speed, by acceleration (gravity, moving walls) and by viscosity; the others were as long
    /// as the case allows.
    pub limited_steps: [u64; 3],
}

impl Health {
    /// The table for `run.json`.
    pub fn table(&self) -> BTreeMap<String, f64> {
        [
            ("max_speed_m_s", self.max_speed),
            ("max_density_error", self.max_density_error),
            ("volume_error", self.volume_error),
            ("energy_error", self.energy_error),
            ("escaped_particles", self.escaped_particles as f64),
            (
                "lost_particles",
                (self.escaped_particles + self.outflow_particles + self.broken_particles) as f64,
            ),
            ("outflow_particles", self.outflow_particles as f64),
            ("clamped_pressure_share", self.clamped_share),
            ("guard_hits", self.guard_hits as f64),
            ("most_particles_inside_walls", self.most_inside_walls as f64),
            ("mean_pressure_iterations", self.mean_pressure_iterations),
            ("fluid_substeps", self.substeps as f64),
            ("shortened_steps", self.shortened_steps as f64),
            ("steps_limited_by_speed", self.limited_steps[0] as f64),
            ("steps_limited_by_acceleration", self.limited_steps[1] as f64),
            ("steps_limited_by_viscosity", self.limited_steps[2] as f64),
        ]
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect()
    }
}
