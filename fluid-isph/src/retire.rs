//! Particles that leave: over the rim, through a hole, or, which no run should have, through a wall.

use rayon::prelude::*;

use crate::fluid::Fluid;
use crate::vector::{Vector, dot};

/// What becomes of a particle.
#[derive(Debug, Clone, Copy)]
enum Fate {
    Stays,
    Broken,
    Outflow,
    Escaped,
}

impl<const D: usize> Fluid<D> {
    /// Takes particles out that left through an open face, went through a wall or are not finite, and counts each kind.
    pub(crate) fn retire_lost(&mut self) {
        let (scene, grid, margin) = (&self.scene, &self.grid, 1.5 * self.spacing);
        let (tank, wall) = (&scene.tank, scene.kernel.wall_layers() as f64 * self.spacing);
        let fate = |x: &Vector<D>, v: &Vector<D>| {
            if x.iter().chain(v).any(|value| !value.is_finite()) {
                return Fate::Broken;
            }
            let past = |k: usize, margin: f64| [tank.min[k] - x[k] > margin, x[k] - tank.max[k] > margin];
            let beyond_wall =
                |margin: f64| (0..D).any(|k| (0..2).any(|side| !tank.open[k][side] && past(k, margin)[side]));
            let over_rim = (0..D).any(|k| (0..2).any(|side| tank.open[k][side] && past(k, 0.0)[side]));
            let through = beyond_wall(margin);
            // Through a hole the water must pass the whole wall before it is gone. Above the rim there is no wall to be pressed into:
            // whoever is past its plane there comes down outside.
            let in_hole = through && scene.openings.iter().any(|opening| opening.holds(x, tank));
            let gone = match (in_hole, over_rim) {
                (true, _) => beyond_wall(wall),
                (false, true) => beyond_wall(0.0),
                (false, false) => through,
            };
            match (over_rim || in_hole, gone || grid.inner_cell(x).is_none()) {
                (_, false) => Fate::Stays,
                (true, true) => Fate::Outflow,
                (false, true) => Fate::Escaped,
            }
        };
        let water = &self.water;
        if (0..water.len())
            .into_par_iter()
            .with_min_len(4096)
            .all(|i| matches!(fate(&water.position[i], &water.velocity[i]), Fate::Stays))
        {
            return;
        }
        let (g, mass) = (self.scene.gravity.at(self.time), self.scene.reference_density * self.kernel.volume);
        let (health, energy) = (&mut self.health, &mut self.energy);
        self.water.retire(|x, v| {
            match fate(x, v) {
                Fate::Stays => return false,
                Fate::Broken => health.broken_particles += 1,
                Fate::Outflow => health.outflow_particles += 1,
                Fate::Escaped => health.escaped_particles += 1,
            }
            let energy_taken = mass * (0.5 * dot(v, v) - dot(&g, x));
            if energy_taken.is_finite() {
                energy.work -= energy_taken;
            }
            true
        });
        self.water.sort(&self.grid);
    }
}
