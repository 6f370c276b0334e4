//! One pass per water particle: neighbours, n_i, matrix row, wall row, wall moments, Robin terms.
//!
//! Diagonal: sum a_ij over water + c max(0, A_full - sum a_ij over water and wall) + 1e-6 A_full. The middle term stands
//! for the missing neighbours, which are air at P = 0: no free-surface flag, no Dirichlet set; c = 1 but for films
//! (`air.rs`). Walls are not in the matrix (Neumann by omission). Strictly dominant, so symmetric positive definite always.

use std::ops::Range;

use rayon::prelude::*;

use crate::cells::{Grid, Place};
use crate::kernel::Kernel;
use crate::kernel_shape::{Shape, with_shape};
use crate::lanes::{LANES, Lanes, Task, dispatch};
use crate::parallel::CHUNK;
use crate::particles::Water;
use crate::pressure::matrix::{PressureMatrix, RowChunk};
use crate::vector::{Vector, dot};
use crate::walls::{WALL_SETS, WallSet, Walls};

/// Part of A_full added to every diagonal, so that a closed full tank has one solution.
pub(crate) const REGULARISATION: f64 = 1e-6;

/// Sums over the walls near each water particle, `[n]` each.
#[derive(Debug, Default)]
pub struct WallMoments<const D: usize> {
    /// V sum F r over the components that face the walls, 1/m. Leaving the tangential components in would brake water that
    /// moves along a wall whose particles end or are uneven: beside a moving body by 10 % of its added mass.
    pub first: Vec<Vector<D>>,
    /// V sum F v_w . r, 1/s.
    pub flux: Vec<f64>,
    /// Sum of the Robin coefficients times the known part of the wall pressure, Pa/m2; empty without a Robin wall.
    pub robin: Vec<f32>,
}

/// The Robin wall as the assembly needs it, per body particle.
#[derive(Debug, Clone, Copy)]
pub struct RobinTerms<'a, const D: usize> {
    /// 2 rho0 / m_r, 1/m.
    pub coefficient: &'a [f32],
    /// Wall pressure of the last coupling step on both sides, Pa.
    pub old_pressure: &'a [[f32; 2]],
    /// rho0 g, Pa/m.
    pub weight_density: Vector<D>,
}

/// What the assembly reads.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a, const D: usize> {
    /// Search grid.
    pub grid: &'a Grid<D>,
    /// Kernel.
    pub kernel: &'a Kernel<D>,
    /// Wall particles.
    pub walls: &'a Walls<D>,
    /// How often the share of the missing neighbours counts, -.
    pub air: f64,
    /// Robin wall, where there is one.
    pub robin: Option<RobinTerms<'a, D>>,
}

/// What the walls contribute to one row.
#[derive(Debug, Clone, Copy)]
struct WallSums<const D: usize> {
    density: f64,
    coupling: f64,
    first: Vector<D>,
    flux: f64,
    robin_diagonal: f64,
    robin_source: f64,
}

impl<const D: usize> Default for WallSums<D> {
    fn default() -> Self {
        Self {
            density: 0.0,
            coupling: 0.0,
            first: [0.0; D],
            flux: 0.0,
            robin_diagonal: 0.0,
            robin_source: 0.0,
        }
    }
}

/// Fills matrix, number density and wall moments for all water particles.
///
/// Source: left side of (6), (8), (9) of the paper and (7) for n_i. Cost: one neighbour search.
pub fn assemble_pressure_matrix<const D: usize>(
    around: Surroundings<'_, D>,
    water: &mut Water<D>,
    matrix: &mut PressureMatrix,
    moments: &mut WallMoments<D>,
) {
    let count = water.len();
    matrix.resize(count);
    moments.first.resize(count, [0.0; D]);
    moments.flux.resize(count, 0.0);
    moments.robin.resize(if around.robin.is_some() { count } else { 0 }, 0.0);
    let mut density = std::mem::take(&mut water.number_density);
    let reader = &*water;
    let rows = (matrix.chunks.par_iter_mut(), matrix.inverse_diagonal.par_chunks_mut(CHUNK));
    let sums = (moments.first.par_chunks_mut(CHUNK), moments.flux.par_chunks_mut(CHUNK));
    let columns = (rows, sums, density.par_chunks_mut(CHUNK)).into_par_iter().enumerate();
    if around.robin.is_some() {
        let robin = moments.robin.par_chunks_mut(CHUNK);
        columns.zip(robin).for_each(|((number, ((rows, inverse), (first, flux), density)), robin)| {
            let out = Columns { first, flux, density, inverse, robin: Some(robin) };
            dispatch(ChunkTask { around, water: reader, first_row: number * CHUNK, rows, out });
        });
    } else {
        columns.for_each(|(number, ((rows, inverse), (first, flux), density))| {
            let out = Columns { first, flux, density, inverse, robin: None };
            dispatch(ChunkTask { around, water: reader, first_row: number * CHUNK, rows, out });
        });
    }
    water.number_density = density;
}

/// One chunk's share of the output columns.
struct Columns<'a, const D: usize> {
    first: &'a mut [Vector<D>],
    flux: &'a mut [f64],
    density: &'a mut [f32],
    inverse: &'a mut [f32],
    robin: Option<&'a mut [f32]>,
}

/// The work on one chunk, compiled for each vector width the processor may have.
struct ChunkTask<'a, const D: usize> {
    around: Surroundings<'a, D>,
    water: &'a Water<D>,
    first_row: usize,
    rows: &'a mut RowChunk,
    out: Columns<'a, D>,
}

impl<const D: usize> Task for ChunkTask<'_, D> {
    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) {
        let rows = (self.first_row, self.rows);
        with_shape!(self.around.kernel.shape, shape => {
            assemble_chunk((lanes, shape), self.around, self.water, rows, &mut self.out);
        });
    }
}

#[inline(always)]
fn assemble_chunk<L: Lanes, S: Shape, const D: usize>(
    (lanes, shape): (L, S),
    around: Surroundings<'_, D>,
    water: &Water<D>,
    (first_row, rows): (usize, &mut RowChunk),
    out: &mut Columns<'_, D>,
) {
    rows.clear();
    let aggregates = &water.aggregate[first_row..first_row + out.flux.len()];
    rows.first_aggregate = aggregates[0] as usize;
    let stencil = 3usize.pow(D as u32);
    let count = aggregates[aggregates.len() - 1] as usize + 1 - rows.first_aggregate;
    rows.stencil.resize(count * stencil, 0.0);
    let (kernel, walls) = (around.kernel, around.walls);
    let reach = (kernel.support_radius * kernel.support_radius, kernel.inverse_square());
    let mut sets = [None; WALL_SETS];
    let mut gathered = None;
    for (k, &aggregate) in aggregates.iter().enumerate() {
        if gathered != Some(aggregate) {
            gathered = Some(aggregate);
            let cell = water.occupied[aggregate as usize] as usize;
            rows.near.gather((around.grid, &water.cells), cell, reach);
            sets = walls.sets_near(around.grid, cell);
            for (near, set) in rows.near_walls.iter_mut().zip(sets) {
                if let Some(set) = set {
                    near.gather((around.grid, set.cells), cell, reach);
                }
            }
        }
        let share = (aggregate as usize - rows.first_aggregate) * stencil;
        let share = share..share + stencil;
        let own = add_water_row((lanes, shape), (kernel, water), first_row + k, rows, share.clone());
        let place = water.cells.place(first_row + k);
        let mut wall = WallSums::default();
        for (number, set) in sets.into_iter().enumerate() {
            if let Some(set) = set {
                add_wall_set((lanes, shape), around, (number, set), &place, rows, &mut wall);
            }
        }
        rows.wall_end.push(rows.wall_value.len() as u32);
        let missing = around.air * (kernel.full_diagonal - own.coupling - wall.coupling).max(0.0);
        let extra = REGULARISATION * kernel.full_diagonal + wall.robin_diagonal;
        let diagonal = (own.coupling + missing + extra) as f32;
        rows.value[own.own] = diagonal;
        rows.stencil[share.start + stencil / 2] += f64::from(diagonal);
        out.inverse[k] = 1.0 / diagonal;
        out.density[k] = (own.density + wall.density) as f32;
        out.first[k] = wall.first;
        out.flux[k] = wall.flux;
        if let Some(robin) = &mut out.robin {
            robin[k] = wall.robin_source as f32;
        }
    }
}

/// Sums over the water around a particle.
struct RowSums {
    /// Sum of W, itself included, 1/m^D.
    density: f64,
    /// Sum of a_ij, 1/m2.
    coupling: f64,
    /// Place of the diagonal in the values.
    own: usize,
}

/// Finds the water neighbours, writes their row with a zero at the particle's own place, and adds the row to `share` of
/// the matrix of the cells.
#[inline(always)]
fn add_water_row<L: Lanes, S: Shape, const D: usize>(
    (lanes, shape): (L, S),
    (kernel, water): (&Kernel<D>, &Water<D>),
    particle: usize,
    rows: &mut RowChunk,
    share: Range<usize>,
) -> RowSums {
    rows.near.find(lanes, &water.cells.place(particle));
    let count = rows.near.len();
    let begin = rows.value.len();
    let density = rows.near.weigh(shape, -kernel.coupling_factor());
    // The particle itself is in the middle cell of its stencil, behind the neighbours with smaller numbers.
    let middle = 3usize.pow(D as u32) / 2;
    let (first, last) = (rows.near.end_of(middle - 1), rows.near.end_of(middle));
    let before = rows.near.index[first..last].iter().map(|&j| usize::from((j as usize) < particle));
    let own = first + before.sum::<usize>();
    rows.near.slope[own] = 0.0;
    rows.column.extend_from_slice(&rows.near.index[..count]);
    rows.value.extend_from_slice(&rows.near.slope[..count]);
    rows.end.push((begin + count) as u32);
    // The share of each cell is a difference of running sums, without a loop over each.
    let sum = run_up(&rows.near.slope[..count.next_multiple_of(LANES)], &mut rows.running);
    let mut before = 0.0;
    for (cell, target) in rows.stencil[share].iter_mut().enumerate() {
        let up_to = rows.running[rows.near.end_of(cell)];
        *target += up_to - before;
        before = up_to;
    }
    RowSums { density: f64::from(density) * kernel.value_factor(), coupling: -sum, own: begin + own }
}

/// running\[k\] = sum of the first k values; whole vectors, each summed on its own first, so that the additions of
/// several overlap. Returns the sum.
#[inline(always)]
fn run_up(values: &[f32], running: &mut Vec<f64>) -> f64 {
    if running.len() <= values.len() {
        running.resize(2 * values.len() + 1, 0.0);
    }
    running[0] = 0.0;
    let mut base = 0.0;
    for (values, running) in values.chunks_exact(LANES).zip(running[1..].chunks_exact_mut(LANES)) {
        let mut sum = 0.0;
        for k in 0..LANES {
            sum += f64::from(values[k]);
            running[k] = base + sum;
        }
        base += sum;
    }
    base
}

/// Finds the particles of one set of walls, writes their row and adds up what they contribute.
#[inline(always)]
fn add_wall_set<L: Lanes, S: Shape, const D: usize>(
    (lanes, shape): (L, S),
    around: Surroundings<'_, D>,
    (number, set): (usize, WallSet<'_, D>),
    place: &Place<D>,
    rows: &mut RowChunk,
    sums: &mut WallSums<D>,
) {
    let (kernel, walls) = (around.kernel, around.walls);
    let near = &mut rows.near_walls[number];
    near.find(lanes, place);
    if near.is_empty() {
        return;
    }
    near.weigh(shape, kernel.coupling_factor());
    let (moving, body) = (walls.obstacles().start, walls.body());
    for k in 0..near.len() {
        let wall = set.column(near.index[k]) as usize;
        let weight = walls.weight[wall];
        if weight == 0.0 {
            continue;
        }
        let coupling = near.slope[k] * weight;
        rows.wall_column.push(wall as u32);
        rows.wall_value.push(coupling);
        let at = set.cells.place(near.index[k] as usize);
        let d: Vector<D> =
            std::array::from_fn(|k| f64::from(place[k].wrapping_sub(at[k])) * around.grid.part());
        let half = 0.5 * f64::from(coupling);
        sums.density += f64::from(near.q2[k] * weight) * kernel.value_factor();
        sums.coupling += f64::from(coupling);
        let facing = &walls.facing[wall];
        for k in 0..D {
            sums.first[k] += half * facing[k] * d[k];
        }
        if wall >= moving {
            let velocity = &walls.velocity[wall];
            sums.flux += half * (0..D).map(|k| facing[k] * velocity[k] * d[k]).sum::<f64>();
            if let (Some(robin), true) = (around.robin, wall >= body.start) {
                let known = robin.old_pressure[wall - body.start][walls.side(wall, &d)];
                let c = half
                    * f64::from(robin.coefficient[wall - body.start])
                    * dot(&d, &walls.director[wall]).abs();
                sums.robin_diagonal += c;
                // p_w as seen from i is p_i + rho0 g . (x_w - x_i); x_w - x_i = -d.
                sums.robin_source += c * (f64::from(known) + dot(&robin.weight_density, &d));
            }
        }
    }
}
