//! Pressure at the wall particles, gathered from the wall's side, and the force of the water on them.
//!
//! Only wall particles with water in reach are visited; no rows are stored for this.

use rayon::prelude::*;

use crate::kernel_shape::{Shape, with_shape};
use crate::lanes::{Lanes, Task, dispatch};
use crate::markers::PressureField;
use crate::neighbours::Neighbours;
use crate::parallel::{CHUNK, chunk_count};
use crate::rows::sum_row;
use crate::scene::WallPressure;
use crate::vector::{Vector, add_scaled, dot, sub};
use crate::walls::Walls;

/// Search buffers, one per chunk of wall particles.
#[derive(Debug, Default)]
pub struct WallSearch {
    near: Vec<Neighbours>,
}

impl WallSearch {
    fn resize(&mut self, count: usize) {
        self.near.resize_with(chunk_count(count).max(self.near.len()), Neighbours::default);
    }

    /// p_w = max(0, sum W (p_j + rho0 (g - a).(x_w - x_j)) / sum W) over the water on each side, Pa; a is the wall's
    /// acceleration of prescribed motion only: that of an elastic wall would act as an explicit added mass.
    pub fn evaluate<const D: usize>(
        &mut self,
        field: PressureField<'_, D>,
        walls: &mut Walls<D>,
        gravity: &Vector<D>,
    ) {
        self.resize(walls.len());
        let mut pressure = std::mem::take(&mut walls.pressure);
        let around = WallSums { field, walls, gravity };
        let chunks = pressure.par_chunks_mut(CHUNK).zip(&mut self.near).enumerate();
        chunks.for_each(|(number, (target, near))| {
            dispatch(PressureTask { around, first: number * CHUNK, target, near });
        });
        walls.pressure = pressure;
    }

    /// Force of the water on the wall particles `columns`, `[len, D]` N (2-D: N per m depth):
    /// f_w = -V sum_i V F_iw (V_w/V) (p_i + p_w) (x_i - x_w), the reaction to the correction.
    pub fn forces<const D: usize>(
        &mut self,
        field: PressureField<'_, D>,
        (walls, model): (&Walls<D>, WallPressure),
        columns: std::ops::Range<usize>,
        gravity: &Vector<D>,
        force: &mut [Vector<D>],
    ) {
        self.resize(force.len());
        let around = WallSums { field, walls, gravity };
        let chunks = force.par_chunks_mut(CHUNK).zip(&mut self.near).enumerate();
        chunks.for_each(|(number, (target, near))| {
            let first = columns.start + number * CHUNK;
            dispatch(ForceTask { around, model, first, target, near });
        });
    }
}

/// The pressures of one chunk, compiled for each vector width the processor may have.
struct PressureTask<'a, const D: usize> {
    around: WallSums<'a, D>,
    first: usize,
    target: &'a mut [[f32; 2]],
    near: &'a mut Neighbours,
}

impl<const D: usize> Task for PressureTask<'_, D> {
    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Self { around, first, target, near } = self;
        with_shape!(around.field.kernel.shape, shape => {
            around.for_each_wet(lanes, (first, target), near, #[inline(always)] |wall, near| {
                around.side_means(shape, wall, near)
            });
        });
    }
}

/// The forces of one chunk, compiled likewise.
struct ForceTask<'a, const D: usize> {
    around: WallSums<'a, D>,
    model: WallPressure,
    first: usize,
    target: &'a mut [Vector<D>],
    near: &'a mut Neighbours,
}

impl<const D: usize> Task for ForceTask<'_, D> {
    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Self { around, model, first, target, near } = self;
        with_shape!(around.field.kernel.shape, shape => {
            around.for_each_wet(lanes, (first, target), near, #[inline(always)] |wall, near| {
                around.reaction(shape, (wall, model), near)
            });
        });
    }
}

/// What the sums over the water around a wall particle read.
#[derive(Debug, Clone, Copy)]
struct WallSums<'a, const D: usize> {
    field: PressureField<'a, D>,
    walls: &'a Walls<D>,
    /// g, m/s2.
    gravity: &'a Vector<D>,
}

impl<const D: usize> WallSums<'_, D> {
    /// Evaluates `value` for each wall particle from `first` on that has water in reach; 0 for the others.
    #[inline(always)]
    fn for_each_wet<L: Lanes, const N: usize, T: Copy + Default>(
        self,
        lanes: L,
        (first, targets): (usize, &mut [[T; N]]),
        near: &mut Neighbours,
        mut value: impl FnMut(usize, &mut Neighbours) -> [T; N],
    ) {
        // The tank's particles come cell by cell.
        let mut gathered = None;
        for (wall, target) in (first..).zip(targets) {
            *target = [T::default(); N];
            if self.walls.weight[wall] > 0.0 && self.is_wet(lanes, wall, &mut gathered, near) {
                *target = value(wall, near);
            }
        }
    }

    /// Finds the water around a wall particle; false if there is none. `gathered` is the cell gathered last.
    #[inline(always)]
    fn is_wet<L: Lanes>(
        self,
        lanes: L,
        wall: usize,
        gathered: &mut Option<usize>,
        near: &mut Neighbours,
    ) -> bool {
        let (field, x) = (self.field, &self.walls.position[wall]);
        let Some(cell) = field.grid.inner_cell(x) else { return false };
        if *gathered != Some(cell) {
            *gathered = Some(cell);
            let support2 = field.kernel.support_radius * field.kernel.support_radius;
            let reach = (support2, field.kernel.inverse_square());
            near.gather((field.grid, &field.water.cells), cell, reach);
        }
        if near.nothing_near() {
            return false;
        }
        near.find(lanes, &field.grid.place(x));
        !near.is_empty()
    }

    /// Means over the water on either side of a particle of the body; over all of it for any other.
    #[inline(always)]
    fn side_means(self, shape: impl Shape, wall: usize, near: &mut Neighbours) -> [f32; 2] {
        let (field, walls) = (self.field, self.walls);
        if wall < walls.body().start {
            return [self.mean(shape, wall, near), 0.0];
        }
        near.weigh(shape, 1.0);
        let body_force = sub(self.gravity, &walls.acceleration[wall]);
        let (mut sum, mut weights) = ([0.0; 2], [0.0; 2]);
        for k in 0..near.len() {
            let j = near.index[k] as usize;
            let d = sub(&field.water.cells.point(field.grid, j), &walls.position[wall]);
            let w = f64::from(near.q2[k]);
            let side = walls.side(wall, &d);
            weights[side] += w;
            sum[side] +=
                w * (f64::from(field.water.pressure[j]) - field.reference_density * dot(&body_force, &d));
        }
        std::array::from_fn(|side| {
            if weights[side] > 0.0 { (sum[side] / weights[side]).max(0.0) as f32 } else { 0.0 }
        })
    }

    #[inline(always)]
    fn mean(self, shape: impl Shape, wall: usize, near: &mut Neighbours) -> f32 {
        let (field, walls) = (self.field, self.walls);
        let weights = near.weigh(shape, 1.0);
        let (x, water) = (field.grid.place(&walls.position[wall]), field.water);
        let row = (&near.index[..near.len()], &near.q2[..near.len()]);
        // The last lane sums the pressure, the others the offsets.
        let sum: [f32; 4] = sum_row(row, |j, w| {
            let (place, pressure) = (water.place[j], water.pressure[j]);
            let offset = |k: usize| if k < D { place[k].wrapping_sub(x[k]) as f32 } else { 0.0 };
            std::array::from_fn(|k| w * if k < 3 { offset(k) } else { pressure })
        });
        let mut total = f64::from(sum[3]);
        for k in 0..D {
            let slope = field.reference_density * (self.gravity[k] - walls.acceleration[wall][k]);
            total -= slope * field.grid.part() * f64::from(sum[k]);
        }
        (total / f64::from(weights)).max(0.0) as f32
    }

    #[inline(always)]
    fn reaction(
        self,
        shape: impl Shape,
        (wall, model): (usize, WallPressure),
        near: &mut Neighbours,
    ) -> Vector<D> {
        let (field, walls) = (self.field, self.walls);
        let mut force = [0.0; D];
        near.weigh(shape, field.kernel.coupling_factor());
        let factor = -0.5 * field.kernel.volume * f64::from(walls.weight[wall]);
        for k in 0..near.len() {
            let i = near.index[k] as usize;
            let d = sub(&field.water.cells.point(field.grid, i), &walls.position[wall]);
            let coupling = f64::from(near.slope[k]);
            let own = f64::from(field.water.pressure[i]);
            let known = (field.reference_density, self.gravity);
            let at_wall = pressure_seen(walls, model, (wall, &d), own, known);
            add_scaled(&mut force, factor * coupling * (own + at_wall), &d);
        }
        force
    }
}

/// Pressure a water particle at `d` = x_i - x_w with pressure `own` sees at a wall particle, Pa.
#[inline(always)]
pub fn pressure_seen<const D: usize>(
    walls: &Walls<D>,
    model: WallPressure,
    (wall, d): (usize, &Vector<D>),
    own: f64,
    (reference_density, gravity): (f64, &Vector<D>),
) -> f64 {
    match model {
        WallPressure::Shepard => f64::from(walls.pressure[wall][walls.side(wall, d)]),
        WallPressure::PerPair => {
            let body_force = sub(gravity, &walls.acceleration[wall]);
            (own - reference_density * dot(&body_force, d)).max(0.0)
        }
    }
}
