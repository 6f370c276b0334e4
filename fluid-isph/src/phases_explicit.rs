//! The phases of the explicit scheme that the projection does not have.

use crate::error::StepFault;
use crate::fluid::{Fluid, PressureLevel};
use crate::particles::four_lanes;
use crate::pressure::conjugate_gradient::Accuracy;
use crate::source::{SourceTerm, assemble_source};
use crate::weakly_compressible::{Explicit, Surroundings, WeaklyCompressible};

/// Relative residual of the solve for the pressure of the start.
const START_TOLERANCE: f64 = 1e-4;

impl<const D: usize> Fluid<D> {
    /// The scheme at the start, under the pressure the projection finds: that of still water would send a sound wave
    /// through a column whose sides stand free, and let it set out too fast.
    ///
    /// # Errors
    /// The solve has stalled.
    pub(crate) fn start_explicitly(&mut self, numbers: Explicit) -> Result<WeaklyCompressible, StepFault> {
        let dt = self.admitted_time_step();
        self.find_images();
        self.assemble_matrix();
        self.find_eddy_viscosity();
        self.find_viscous_acceleration();
        self.build_preconditioner();
        self.find_intermediate_velocity(dt);
        self.assemble_source(dt);
        std::mem::swap(&mut self.start_velocity, &mut self.water.velocity);
        let mut pressure = vec![0.0; self.water.len()];
        let system = (&self.water, &self.matrix, &mut self.preconditioner);
        let accuracy = Accuracy { tolerance: START_TOLERANCE, rounding: 0.0 };
        self.solver.solve(system, &self.source, &mut pressure, accuracy)?;
        let least = match self.pressure_level {
            PressureLevel::Shifted => pressure.iter().copied().fold(f32::INFINITY, f32::min),
            PressureLevel::Clamped | PressureLevel::Free => 0.0,
        };
        let clamped = self.pressure_level == PressureLevel::Clamped;
        let mut by_number = vec![0.0; self.water.len()];
        for (p, &id) in pressure.iter().zip(&self.water.id) {
            let p = f64::from(p - least);
            by_number[id as usize] = if clamped { p.max(0.0) } else { p };
        }
        Ok(WeaklyCompressible::new(numbers, self.scene.reference_density, by_number.into_iter()))
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
