//! One sub-step of the fluid: the table of contents of the method. One line is one phase is one timing column.
//! Equation numbers are the paper's.

use crate::error::StepFault;
use crate::fluid::Fluid;
use crate::obstacle::Obstacles;

impl<const D: usize> Fluid<D> {
    /// The flow over the next `dt` s, or over half, a quarter, ... of it if the water would move too far; returns the time
    /// it holds for.
    pub(crate) fn find_flow(&mut self, mut dt: f64) -> Result<f64, StepFault> {
        self.timed("sort", Self::sort_particles);
        if self.periodic.is_some() {
            self.timed("images", Self::find_images);
        }
        if self.obstacles.as_ref().is_some_and(Obstacles::is_moving) {
            self.timed("place obstacles", |fluid| fluid.place_obstacles(dt));
        }
        if self.body.is_some() {
            self.timed("place body", Self::place_body);
        }
        self.timed("assemble matrix", Self::assemble_matrix); // left side of (6), (8), (9); n_i by (7)
        if self.turbulence.is_some() {
            self.timed("eddy viscosity", Self::find_eddy_viscosity); // Smagorinsky
        }
        if self.viscosity.is_some() {
            self.timed("viscosity", Self::find_viscous_acceleration); // first term of (3)
        }
        self.timed("precondition", Self::build_preconditioner);
        loop {
            self.timed("intermediate velocity", |fluid| fluid.find_intermediate_velocity(dt)); // (3)
            self.timed("source", |fluid| fluid.assemble_source(dt)); // right side of (9)
            self.timed("solve", |fluid| fluid.solve_pressure(dt))?; // (9)
            self.timed("wall pressure", |fluid| fluid.find_wall_pressure(dt));
            self.timed("correct", |fluid| fluid.correct_velocity(dt)); // (4)
            match self.timed("check", |fluid| fluid.shorter_step(dt))? {
                Some(shorter) => dt = shorter,
                None => break,
            }
        }
        Ok(dt)
    }

    /// Its load on the body.
    pub(crate) fn find_load(&mut self, dt: f64) {
        if self.body.is_some() {
            self.timed("load", |fluid| fluid.find_body_load(dt)); // reaction to (4), markers by (7)
        }
    }

    /// Lets the water follow it. Nobody waits for this: a structure has its load and moves meanwhile.
    pub(crate) fn follow_flow(&mut self, dt: f64) -> Result<(), StepFault> {
        if self.obstacles.as_ref().is_some_and(Obstacles::is_moving) {
            self.timed("obstacle load", |fluid| fluid.find_obstacle_load(dt));
        }
        if self.shifting.is_some() {
            self.timed("shift", Self::find_shift);
        }
        self.timed("move", |fluid| fluid.move_particles(dt)); // x += dt v, after every neighbour has read x
        if self.shifting.is_some() {
            self.timed("shift", |fluid| fluid.shift_particles(dt));
        }
        self.timed("check", Self::check_particles)
    }
}
