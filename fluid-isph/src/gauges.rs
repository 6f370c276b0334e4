//! What is measured: functions of the fluid, evaluated only when a gauge of the scene asks for them.
//!
//! Between two steps the particles have moved on, while pressures, neighbours and wall forces belong to the positions
//! at the start of the last sub-step; pressures and forces are taken there.

use std::ops::Range;

use crate::fluid::Fluid;
use crate::neighbours::Neighbours;
use crate::scene::Face;
use crate::vector::{Vector, sub};
use crate::wall_pressure::WallSearch;

/// Water with less than this part of n0 around it is spray and no front.
const CONNECTED: f64 = 0.4;

/// Force and moment about a point; in 2-D per m depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceAndMoment<const D: usize> {
    /// N.
    pub force: Vector<D>,
    /// N m about the x, y and z axis; in 2-D only the last is used.
    pub moment: [f64; 3],
}

impl<const D: usize> Fluid<D> {
    /// Pressure at a point inside the water or on a wall, Pa: the hydrostatically shifted kernel mean over the water
    /// around, fading to 0 where there is little.
    pub fn pressure_at(&self, x: &Vector<D>) -> f64 {
        let gravity = self.scene.gravity.at(self.time);
        self.field().at((x, &[0.0; D]), 0.0, &gravity, &mut Neighbours::default())
    }

    /// Foremost water along an axis, m: the outermost particle with at least 0.4 n0 around it, plus half a spacing.
    /// NaN without water.
    pub fn front(&self, axis: usize, upper: bool) -> f64 {
        let sign = if upper { 1.0 } else { -1.0 };
        let connected = CONNECTED * self.kernel.lattice_density;
        let particles = self.water.position.iter().zip(&self.water.number_density);
        particles
            .filter(|(_, n)| f64::from(**n) >= connected)
            .map(|(x, _)| sign * x[axis])
            .reduce(f64::max)
            .map_or(f64::NAN, |front| sign * (front + 0.5 * self.spacing))
    }

    /// Water level above a point, m: the highest place on the vertical (y) where V sum W = 1/2, which at a flat surface
    /// is the surface itself. The vertical is moved inside to a support's distance from closed walls. NaN if it is dry.
    pub fn level(&self, at: &Vector<D>) -> f64 {
        let tank = &self.scene.tank;
        let support = self.kernel.support_radius;
        let mut x = *at;
        for k in (0..D).filter(|&k| k != 1) {
            let middle = 0.5 * (tank.min[k] + tank.max[k]);
            let low = if tank.open[k][0] { tank.min[k] } else { (tank.min[k] + support).min(middle) };
            let high = if tank.open[k][1] { tank.max[k] } else { (tank.max[k] - support).max(middle) };
            x[k] = x[k].clamp(low, high);
        }
        let mut near = Neighbours::default();
        let mut share = |y: f64| {
            x[1] = y;
            self.water_share(&x, &mut near)
        };
        let top = self.water.position.iter().map(|x| x[1]).fold(f64::NEG_INFINITY, f64::max) + self.spacing;
        let step = 0.25 * self.spacing;
        let mut above = top;
        while above - step > tank.min[1] && share(above - step) < 0.5 {
            above -= step;
        }
        let mut below = above - step;
        if !above.is_finite() || below <= tank.min[1] {
            return f64::NAN;
        }
        for _ in 0..30 {
            let middle = 0.5 * (above + below);
            *(if share(middle) < 0.5 { &mut above } else { &mut below }) = middle;
        }
        0.5 * (above + below)
    }

    /// V sum W over the water around a point, -.
    fn water_share(&self, x: &Vector<D>, near: &mut Neighbours) -> f64 {
        let Some(cell) = self.grid.inner_cell(x) else { return 0.0 };
        let support2 = self.kernel.support_radius * self.kernel.support_radius;
        let reach = (support2, self.kernel.inverse_square());
        near.find_around((&self.grid, &self.water.cells), (cell, x), reach);
        let weight = |q2: &f32| f64::from(self.kernel.shape.evaluate(q2.sqrt()).0);
        let sum: f64 = near.q2[..near.len()].iter().map(weight).sum();
        sum * self.kernel.value_factor() / self.kernel.lattice_density
    }

    /// Force of the water on a face of the tank in the last sub-step, and its moment about `about`.
    ///
    /// Particles behind two faces (edges, corners) count with their normal component only.
    pub fn force_on_face(&self, face: Face, about: &Vector<D>) -> ForceAndMoment<D> {
        let (tank, walls) = (&self.scene.tank, &self.walls);
        let behind = |x: &Vector<D>, axis: usize, upper: bool| {
            if upper { x[axis] > tank.max[axis] } else { x[axis] < tank.min[axis] }
        };
        let columns = walls.tank();
        let mut forces = self.wall_forces(columns.clone());
        for (force, x) in forces.iter_mut().zip(&walls.position[columns]) {
            let shared = (0..D).any(|k| k != face.axis && (behind(x, k, false) || behind(x, k, true)));
            if !behind(x, face.axis, face.upper) {
                *force = [0.0; D];
            } else if shared {
                (0..D).filter(|&k| k != face.axis).for_each(|k| force[k] = 0.0);
            }
        }
        add_up(forces.iter().zip(&self.walls.position[self.walls.tank()]), about)
    }

    /// Force of the water on the body in the last sub-step, and its moment about `about`; zero without a body.
    pub fn force_on_body(&self, about: &Vector<D>) -> ForceAndMoment<D> {
        let loads = self.body.as_ref().map_or(&[][..], |body| &body.load);
        add_up(loads.iter().zip(&self.walls.position[self.walls.body()]), about)
    }

    /// Force of the water on all obstacles in the last sub-step, and its moment about `about`; zero without one.
    pub fn force_on_obstacles(&self, about: &Vector<D>) -> ForceAndMoment<D> {
        let columns = self.walls.obstacles();
        let forces = self.wall_forces(columns.clone());
        add_up(forces.iter().zip(&self.walls.position[columns]), about)
    }

    fn wall_forces(&self, columns: Range<usize>) -> Vec<Vector<D>> {
        let mut forces = vec![[0.0; D]; columns.len()];
        let gravity = self.scene.gravity.at(self.time);
        let walls = (&self.walls, self.scene.wall_pressure);
        WallSearch::default().forces(self.field(), walls, columns, &gravity, &mut forces);
        forces
    }

    /// Volume of the water, m^D: sum V n0/n_i over the particles with n_i >= 0.95 n0, V for the others.
    pub fn volume(&self) -> f64 {
        let n0 = self.kernel.lattice_density;
        let share = |&n: &f32| {
            if f64::from(n) >= f64::from(crate::source::SURFACE_DENSITY) * n0 {
                n0 / f64::from(n)
            } else {
                1.0
            }
        };
        self.kernel.volume * self.water.number_density.iter().map(share).sum::<f64>()
    }

    /// Departure from the pressure of still water: rms over the particles of p - rho0 g (H - z), over rho0 g H, with H the
    /// height of the surface at the start and z the height above the lowest corner of the tank, along gravity.
    pub fn hydrostatic_error(&self) -> f64 {
        let (down, floor) = self.floor_along_gravity();
        let unit = self.scene.reference_density * crate::vector::norm(&self.scene.gravity.at(self.time));
        let square = |i: usize| {
            let height = floor - crate::vector::dot(&self.water.cells.point(&self.grid, i), &down);
            (f64::from(self.water.pressure[i]) - unit * (self.surface - height)).powi(2)
        };
        let count = self.water.len();
        let rms = ((0..count).map(square).sum::<f64>() / count.max(1) as f64).sqrt();
        if unit * self.surface > 0.0 { rms / (unit * self.surface) } else { 0.0 }
    }

    /// Momentum of the water, kg m/s (2-D: per m depth).
    pub fn momentum(&self) -> Vector<D> {
        let mass = self.particle_mass();
        let mut sum = [0.0; D];
        for v in &self.water.velocity {
            crate::vector::add_scaled(&mut sum, mass, v);
        }
        sum
    }

    /// Moment of momentum of the water about a point, kg m2/s (2-D: per m depth, the last component only).
    pub fn angular_momentum(&self, about: &Vector<D>) -> [f64; 3] {
        let mass = self.particle_mass();
        let columns = self.water.velocity.iter().zip(&self.water.position);
        add_up(columns, about).moment.map(|moment| mass * moment)
    }

    /// Centre of mass of the water, m. NaN without water.
    pub fn centre(&self) -> Vector<D> {
        let mut sum = [0.0; D];
        for x in &self.water.position {
            crate::vector::add_scaled(&mut sum, 1.0, x);
        }
        sum.map(|component| component / self.water.len() as f64)
    }
}

fn add_up<'a, const D: usize>(
    forces: impl Iterator<Item = (&'a Vector<D>, &'a Vector<D>)>,
    about: &Vector<D>,
) -> ForceAndMoment<D> {
    let mut total = ForceAndMoment { force: [0.0; D], moment: [0.0; 3] };
    for (force, x) in forces {
        crate::vector::add_scaled(&mut total.force, 1.0, force);
        let arm = sub(x, about);
        total.moment[2] += arm[0] * force[1] - arm[1] * force[0];
        if D == 3 {
            total.moment[0] += arm[1] * force[D - 1] - arm[D - 1] * force[1];
            total.moment[1] += arm[D - 1] * force[0] - arm[0] * force[D - 1];
        }
    }
    total
}
