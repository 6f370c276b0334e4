//! The phases of the explicit scheme that the projection does not have.

use crate::error::StepFault;
use crate::fluid::{Fluid, PressureLevel};
use crate::particles::four_lanes;
use crate::source::{SourceTerm, assemble_source};
use crate::vector::{dot, norm};
use crate::weakly_compressible::{Explicit, Surroundings, WeaklyCompressible};

impl<const D: usize> Fluid<D> {
    /// The scheme at the start: still water under the highest surface.
    pub(crate) fn start_explicitly(&self, numbers: Explicit) -> WeaklyCompressible {
        let (down, floor) = self.floor_along_gravity();
        let unit = self.scene.reference_density * norm(&self.scene.gravity.at(0.0));
        let mut pressures = vec![0.0; self.water.len()];
        for (x, &id) in self.water.position.iter().zip(&self.water.id) {
            pressures[id as usize] = unit * (self.surface - floor + dot(x, &down)).max(0.0);
        }
        WeaklyCompressible::new(numbers, self.scene.reference_density, pressures.into_iter())
    }

    fn explicit_surroundings(&self) -> Surroundings<D> {
        Surroundings {
            reference_density: self.scene.reference_density,
            gravity: self.scene.gravity.at(self.time),
            smoothing_length: self.kernel.smoothing_length,
        }
    }

    pub(crate) fn find_tait_pressure(&mut self) {
        let Some(scheme) = &self.explicit else { return };
        let clamped = self.pressure_level == PressureLevel::Clamped;
        scheme.find_pressure(self.scene.reference_density, clamped, &mut self.water);
    }

    pub(crate) fn add_artificial_viscosity(&mut self, dt: f64) {
        let around = self.explicit_surroundings();
        let Some(scheme) = &self.explicit else { return };
        scheme.add_artificial_viscosity(around, dt, &self.start_velocity, (&mut self.water, &self.matrix));
    }

    pub(crate) fn advance_density(&mut self, dt: f64) -> Result<(), StepFault> {
        let around = self.explicit_surroundings();
        // The loops over pairs read the velocity from its lanes, which still hold the intermediate one.
        for (flow, v) in self.water.flow.iter_mut().zip(&self.water.velocity) {
            *flow = four_lanes(v);
        }
        let term = SourceTerm {
            divergence_factor: 1.0,
            density_factor: 0.0,
            lattice_density: self.kernel.lattice_density,
        };
        let water = (&self.water, self.grid.part());
        assemble_source(term, water, &self.matrix, &self.moments, &mut self.source);
        if let Some(periodic) = &self.periodic {
            periodic.correct_source(1.0, &self.water, &mut self.source);
        }
        let Some(scheme) = &mut self.explicit else { return Ok(()) };
        scheme.advance_density(around, dt, &self.source, (&self.water, &self.matrix));
        if scheme.is_finite() { Ok(()) } else { Err(StepFault::NonFinite { what: "density" }) }
    }
}
