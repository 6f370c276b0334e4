//! The phases of what only some scenes have: images, moving obstacles, particle shifting.

use crate::fluid::Fluid;

impl<const D: usize> Fluid<D> {
    pub(crate) fn find_images(&mut self) {
        if let Some(periodic) = &mut self.periodic {
            periodic.find_pairs(&self.grid, &self.kernel, &self.water);
        }
    }

    /// Moves the obstacles to the start of a sub-step of `dt` s.
    pub(crate) fn place_obstacles(&mut self, dt: f64) {
        if let Some(obstacles) = &self.obstacles {
            obstacles.place(&mut self.walls, self.time, dt);
            self.walls.sort_obstacles(&self.grid, self.spacing);
        }
    }

    /// Force of the water on moving obstacles and the work they do on it.
    pub(crate) fn find_obstacle_load(&mut self, dt: f64) {
        let Some(obstacles) = &mut self.obstacles else { return };
        let mut load = std::mem::take(&mut obstacles.load);
        self.find_reaction(self.walls.obstacles(), dt, &mut load);
        if let Some(obstacles) = &mut self.obstacles {
            obstacles.load = load;
        }
    }

    /// Finds what the particle shifting needs at the places the rows belong to.
    pub(crate) fn find_shift(&mut self) {
        let Some(shifting) = &mut self.shifting else { return };
        shifting.evaluate(&self.water, &self.walls, &self.matrix);
        if let Some(periodic) = &self.periodic {
            periodic.correct_shifting(&self.water, &mut shifting.sums);
        }
    }

    pub(crate) fn shift_particles(&mut self, dt: f64) {
        let Some(shifting) = &self.shifting else { return };
        let numbers = (dt, self.spacing, self.kernel.smoothing_length);
        shifting.apply(numbers, self.kernel.lattice_density, &mut self.water, &self.matrix);
        if let Some(periodic) = &self.periodic {
            periodic.wrap(&mut self.water.position);
        }
    }
}
