//! Energies, angular momentum and reactions of a body.

use crate::facet::cross;
use crate::solid::Solid;

/// Energies, J (J/m in 2-D).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energies {
    /// v.Mv / 2.
    pub kinetic: f64,
    /// Of the weight: minus integral of rho g.x, zero at the origin.
    pub potential: f64,
    /// Integral of S:E / 2.
    pub strain: f64,
}

impl Energies {
    /// All together.
    pub fn total(&self) -> f64 {
        self.kinetic + self.potential + self.strain
    }
}

/// What the supports do to the body.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Reaction {
    /// N (N/m in 2-D).
    pub force: [f64; 3],
    /// About the origin, N m.
    pub moment: [f64; 3],
}

impl Solid {
    /// Energies at the present state.
    pub fn energies(&mut self) -> Energies {
        self.body.times_mass(|state| &state.velocity);
        let body = &self.body;
        let kinetic = 0.5 * dot(&body.state.velocity, body.product());
        let height: f64 = body.loads.weight_potential(&body.state.displacement, body.state.time);
        Energies { kinetic, potential: height, strain: body.assembly.strain_energy(body.state.at()) }
    }

    /// Angular momentum about the origin, kg m2/s (kg m/s in 2-D).
    pub fn angular_momentum(&mut self) -> [f64; 3] {
        self.body.times_mass(|state| &state.velocity);
        let (d, position) = (self.scene().dimension(), &self.body.assembly.mesh.reference_position);
        let mut total = [0.0; 3];
        for node in 0..position.len() / d {
            let (mut arm, mut momentum) = ([0.0; 3], [0.0; 3]);
            for axis in 0..d {
                arm[axis] = position[node * d + axis] + self.body.state.displacement[node * d + axis];
                momentum[axis] = self.body.product()[node * d + axis];
            }
            let own = cross(arm, momentum);
            (0..3).for_each(|i| total[i] += own[i]);
        }
        total
    }

    /// Force and moment of the supports on the body: M a + C v + f - F at the components held.
    pub fn reaction(&mut self) -> Reaction {
        self.body.find_inertia_of_state();
        let (d, state, fixed) = (self.scene().dimension(), &self.body.state, &self.body.fixed);
        let position = &self.body.assembly.mesh.reference_position;
        let mut reaction = Reaction::default();
        for node in (0..fixed.len() / d).filter(|node| fixed[node * d..node * d + d].contains(&true)) {
            let (mut force, mut arm) = ([0.0; 3], [0.0; 3]);
            for axis in 0..d {
                let i = node * d + axis;
                arm[axis] = position[i] + state.displacement[i];
                if fixed[i] {
                    force[axis] = self.body.product()[i] + state.internal_force[i] - state.external_force[i];
                }
            }
            let moment = cross(arm, force);
            (0..3).for_each(|i| {
                reaction.force[i] += force[i];
                reaction.moment[i] += moment[i];
            });
        }
        reaction
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
