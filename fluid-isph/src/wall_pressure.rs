//! Pressure at the wall particles, gathered from the wall's side, and the force of the water on them.
//!
//! Only wall particles with water in reach are visited; no rows are stored for this.

use rayon::prelude::*;

use crate::cells::Neighbours;
use crate::kernel::shape;
use crate::markers::PressureField;
use crate::parallel::{CHUNK, chunk_count};
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
        let reader = &*walls;
        let arch = pulp::Arch::new();
        let chunks = pressure.par_chunks_mut(CHUNK).zip(&mut self.near).enumerate();
        chunks.for_each(|(number, (target, near))| {
            let first = number * CHUNK;
            arch.dispatch(PressureTask { field, walls: reader, gravity, first, target, near });
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
        let arch = pulp::Arch::new();
        let chunks = force.par_chunks_mut(CHUNK).zip(&mut self.near).enumerate();
        chunks.for_each(|(number, (target, near))| {
            let first = columns.start + number * CHUNK;
            arch.dispatch(ForceTask { field, walls, model, gravity, first, target, near });
        });
    }
}

/// The pressures of one chunk, compiled for each vector width the processor may have.
struct PressureTask<'a, const D: usize> {
    field: PressureField<'a, D>,
    walls: &'a Walls<D>,
    gravity: &'a Vector<D>,
    first: usize,
    target: &'a mut [[f32; 2]],
    near: &'a mut Neighbours,
}

impl<const D: usize> pulp::NullaryFnOnce for PressureTask<'_, D> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let mut reach = Reach::default();
        for (wall, target) in (self.first..).zip(self.target) {
            *target = [0.0; 2];
            if self.walls.weight[wall] > 0.0 && reach.is_wet(self.field, self.walls, wall, self.near) {
                *target = side_means(self.field, self.walls, wall, self.gravity, self.near);
            }
        }
    }
}

/// The forces of one chunk, compiled likewise.
struct ForceTask<'a, const D: usize> {
    field: PressureField<'a, D>,
    walls: &'a Walls<D>,
    model: WallPressure,
    gravity: &'a Vector<D>,
    first: usize,
    target: &'a mut [Vector<D>],
    near: &'a mut Neighbours,
}

impl<const D: usize> pulp::NullaryFnOnce for ForceTask<'_, D> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let mut reach = Reach::default();
        for (wall, target) in (self.first..).zip(self.target) {
            *target = [0.0; D];
            if self.walls.weight[wall] > 0.0 && reach.is_wet(self.field, self.walls, wall, self.near) {
                *target = reaction(self.field, (self.walls, self.model), wall, self.gravity, self.near);
            }
        }
    }
}

/// Whether water is near the last cell asked for: the tank's particles come cell by cell.
#[derive(Debug, Default)]
struct Reach {
    last: Option<(usize, bool)>,
}

impl Reach {
    /// Finds the water around a wall particle; false if there is none.
    #[inline(always)]
    fn is_wet<const D: usize>(
        &mut self,
        field: PressureField<'_, D>,
        walls: &Walls<D>,
        wall: usize,
        near: &mut Neighbours,
    ) -> bool {
        let x = &walls.position[wall];
        let Some(cell) = field.grid.inner_cell(x) else { return false };
        let reached = match self.last {
            Some((last, reached)) if last == cell => reached,
            _ => field.water.cells.is_near(field.grid, cell),
        };
        self.last = Some((cell, reached));
        if reached {
            let support2 = field.kernel.support_radius * field.kernel.support_radius;
            near.find(field.grid, &field.water.cells, (cell, x), (support2, field.kernel.inverse_square()));
        }
        reached && !near.is_empty()
    }
}

#[inline(always)]
fn side_means<const D: usize>(
    field: PressureField<'_, D>,
    walls: &Walls<D>,
    wall: usize,
    gravity: &Vector<D>,
    near: &Neighbours,
) -> [f32; 2] {
    let body_force = sub(gravity, &walls.acceleration[wall]);
    let (mut sum, mut weights) = ([0.0; 2], [0.0; 2]);
    for k in 0..near.len() {
        let j = near.index[k] as usize;
        let d = sub(&field.water.cells.point(j), &walls.position[wall]);
        let w = f64::from(shape(near.q2[k].sqrt()).0);
        let side = walls.side(wall, &d);
        weights[side] += w;
        sum[side] +=
            w * (f64::from(field.water.pressure[j]) - field.reference_density * dot(&body_force, &d));
    }
    std::array::from_fn(
        |side| if weights[side] > 0.0 { (sum[side] / weights[side]).max(0.0) as f32 } else { 0.0 },
    )
}

#[inline(always)]
fn reaction<const D: usize>(
    field: PressureField<'_, D>,
    (walls, model): (&Walls<D>, WallPressure),
    wall: usize,
    gravity: &Vector<D>,
    near: &Neighbours,
) -> Vector<D> {
    let mut force = [0.0; D];
    let factor = field.kernel.coupling_factor() * walls.weight[wall];
    for k in 0..near.len() {
        let i = near.index[k] as usize;
        let d = sub(&field.water.cells.point(i), &walls.position[wall]);
        let coupling = f64::from(factor * shape(near.q2[k].sqrt()).1);
        let own = f64::from(field.water.pressure[i]);
        let at_wall = pressure_seen(walls, model, (wall, &d), own, (field.reference_density, gravity));
        add_scaled(&mut force, -0.5 * field.kernel.volume * coupling * (own + at_wall), &d);
    }
    force
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
