//! The phases of what only some scenes have: images, moving obstacles, particle shifting.

use crate::fluid::Fluid;
use crate::markers::PressureField;
use crate::vector::dot;

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
        let g = self.scene.gravity.at(self.time + dt);
        let field = PressureField {
            grid: &self.grid,
            kernel: &self.kernel,
            water: &self.water,
            reference_density: self.scene.reference_density,
        };
        let Some(obstacles) = &mut self.obstacles else { return };
        let walls = (&self.walls, self.scene.wall_pressure);
        self.wall_search.forces(field, walls, self.walls.obstacles(), &g, &mut obstacles.load);
        let mass = self.scene.reference_density * self.kernel.volume;
        let (first, water) = (self.walls.obstacles(), (&self.water, self.spacing));
        self.guard.add_to_load(
            (&self.walls, &self.matrix.chunks),
            first,
            water,
            (mass, dt),
            &mut obstacles.load,
        );
        let velocity = &self.walls.velocity[self.walls.obstacles()];
        let power: f64 = obstacles.load.iter().zip(velocity).map(|(force, v)| dot(force, v)).sum();
        self.energy.work -= power * dt;
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
