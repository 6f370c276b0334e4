//! One sub-step of the explicit scheme, in the order of symplectic Euler: velocity by the old density, density and place
//! by the new velocity. Equation numbers are the paper's.

use crate::error::StepFault;
use crate::fluid::Fluid;
use crate::obstacle::Obstacles;

impl<const D: usize> Fluid<D> {
    /// The flow over the next `dt` s, or over half, a quarter, ... of it if the water would move too far; returns the
    /// time it holds for.
    pub(crate) fn find_flow_explicitly(&mut self, mut dt: f64) -> Result<f64, StepFault> {
        self.timed("sort", Self::sort_particles);
        if self.periodic.is_some() {
            self.timed("images", Self::find_images);
        }
        if self.obstacles.as_ref().is_some_and(Obstacles::is_moving) {
            self.timed("place obstacles", |fluid| fluid.place_obstacles(dt));
        }
        self.timed("neighbours", Self::assemble_matrix); // pairs with V F, n_i by (7)
        if self.turbulence.is_some() {
            self.timed("eddy viscosity", Self::find_eddy_viscosity); // Smagorinsky
        }
        if self.viscosity.is_some() {
            self.timed("viscosity", Self::find_viscous_acceleration); // first term of (3)
        }
        self.keep_velocity();
        self.timed("state", Self::find_tait_pressure); // Tait's equation in place of (6), (8), (9)
        loop {
            self.timed("intermediate velocity", |fluid| fluid.find_intermediate_velocity(dt)); // (3)
            self.timed("artificial viscosity", |fluid| fluid.add_artificial_viscosity(dt));
            self.timed("wall pressure", |fluid| fluid.find_wall_pressure(dt));
            self.timed("correct", |fluid| fluid.correct_velocity(dt)); // (4)
            match self.timed("check", |fluid| fluid.shorter_step(dt))? {
                Some(shorter) => dt = shorter,
                None => break,
            }
        }
        Ok(dt)
    }

    /// Lets the water follow it.
    pub(crate) fn follow_flow_explicitly(&mut self, dt: f64) -> Result<(), StepFault> {
        self.timed("density", |fluid| fluid.advance_density(dt))?; // continuity
        if self.obstacles.as_ref().is_some_and(Obstacles::is_moving) {
            self.timed("obstacle load", |fluid| fluid.find_obstacle_load(dt));
        }
        self.timed("move", |fluid| fluid.move_particles(dt)); // x += dt v
        self.timed("check", Self::check_particles)
    }
}
