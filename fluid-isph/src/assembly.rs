//! One pass per water particle: neighbours, n_i, matrix row, wall row, wall moments, Robin terms.
//!
//! Diagonal: sum a_ij over water + max(0, A_full - sum a_ij over water and wall) + 1e-6 A_full. The middle term stands
//! for the missing neighbours, which are air at P = 0: no free-surface flag, no Dirichlet set. Walls are not in the
//! matrix (Neumann by omission). Strictly dominant, so symmetric positive definite always.

use rayon::prelude::*;

use crate::cells::{Grid, STENCIL_MAX};
use crate::kernel::{Kernel, shape};
use crate::parallel::CHUNK;
use crate::particles::Water;
use crate::pressure::matrix::{PressureMatrix, RowChunk};
use crate::vector::{Vector, dot, sub};
use crate::walls::{WallSet, Walls};

/// Part of A_full added to every diagonal, so that a closed full tank has one solution.
const REGULARISATION: f64 = 1e-6;

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
    /// Robin wall, where there is one.
    pub robin: Option<RobinTerms<'a, D>>,
}

/// Results of one row beside the row itself.
#[derive(Debug, Default, Clone, Copy)]
struct WallSums<const D: usize> {
    density: f64,
    coupling: f64,
    first: Option<Vector<D>>,
    flux: f64,
    robin_diagonal: f64,
    robin_source: f64,
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
    let arch = pulp::Arch::new();
    let reader = &*water;
    let rows = (matrix.chunks.par_iter_mut(), matrix.inverse_diagonal.par_chunks_mut(CHUNK));
    let sums = (moments.first.par_chunks_mut(CHUNK), moments.flux.par_chunks_mut(CHUNK));
    let columns = (rows, sums, density.par_chunks_mut(CHUNK)).into_par_iter().enumerate();
    if around.robin.is_some() {
        let robin = moments.robin.par_chunks_mut(CHUNK);
        columns.zip(robin).for_each(|((number, ((rows, inverse), (first, flux), density)), robin)| {
            let out = Columns { first, flux, density, inverse, robin: Some(robin) };
            arch.dispatch(ChunkTask { around, water: reader, first_row: number * CHUNK, rows, out });
        });
    } else {
        columns.for_each(|(number, ((rows, inverse), (first, flux), density))| {
            let out = Columns { first, flux, density, inverse, robin: None };
            arch.dispatch(ChunkTask { around, water: reader, first_row: number * CHUNK, rows, out });
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

impl<const D: usize> pulp::NullaryFnOnce for ChunkTask<'_, D> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        assemble_chunk(self.around, self.water, self.first_row, self.rows, &mut self.out);
    }
}

#[inline(always)]
fn assemble_chunk<const D: usize>(
    around: Surroundings<'_, D>,
    water: &Water<D>,
    first_row: usize,
    rows: &mut RowChunk,
    out: &mut Columns<'_, D>,
) {
    rows.clear();
    rows.first_aggregate = water.aggregate[first_row] as usize;
    let last_aggregate = water.aggregate[first_row + out.flux.len() - 1] as usize;
    let stencil = 3usize.pow(D as u32);
    rows.stencil.resize((last_aggregate + 1 - rows.first_aggregate) * stencil, 0.0);
    for k in 0..out.flux.len() {
        let aggregate = water.aggregate[first_row + k] as usize;
        let at = (water.occupied[aggregate] as usize, &water.position[first_row + k]);
        let own = add_water_row(around, water, at, first_row + k, rows);
        let walls = add_wall_row(around, at, rows);
        rows.wall_end.push(rows.wall_value.len() as u32);
        let full = around.kernel.full_diagonal;
        let missing = (full - own.coupling - walls.coupling).max(0.0);
        let diagonal = own.coupling + missing + REGULARISATION * full + walls.robin_diagonal;
        rows.value[own.own] = diagonal as f32;
        rows.stencil[(aggregate - rows.first_aggregate) * stencil + stencil / 2] +=
            f64::from(diagonal as f32);
        out.inverse[k] = 1.0 / diagonal as f32;
        out.density[k] = (own.density + walls.density) as f32;
        out.first[k] = walls.first.unwrap_or([0.0; D]);
        out.flux[k] = walls.flux;
        if let Some(robin) = &mut out.robin {
            robin[k] = walls.robin_source as f32;
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

/// Finds the water neighbours, writes their row with a zero at the particle's own place, and adds the row to the matrix
/// of the cells.
#[inline(always)]
fn add_water_row<const D: usize>(
    around: Surroundings<'_, D>,
    water: &Water<D>,
    at: (usize, &Vector<D>),
    particle: usize,
    rows: &mut RowChunk,
) -> RowSums {
    let kernel = around.kernel;
    let support2 = kernel.support_radius * kernel.support_radius;
    rows.near.find(around.grid, &water.cells, at, (support2, kernel.inverse_square()));
    let count = rows.near.len();
    let begin = rows.value.len();
    rows.column.extend_from_slice(&rows.near.index[..count]);
    rows.value.resize(begin + count, 0.0);
    let factor = -kernel.coupling_factor();
    let values = &mut rows.value[begin..];
    for (value, q2) in values.iter_mut().zip(&mut rows.near.q2[..count]) {
        let (w, f) = shape(q2.sqrt());
        *value = factor * f;
        *q2 = w;
    }
    let density = sum_in_lanes(&rows.near.q2[..count]);
    // The particle itself is in the middle cell of its stencil.
    let stencil = 3usize.pow(D as u32);
    let middle = rows.near.segment_end[stencil / 2 - 1] as usize..rows.near.segment_end[stencil / 2] as usize;
    let own = rows.near.index[middle.clone()].iter().position(|&j| j as usize == particle);
    let own = middle.start + own.expect("a particle is its own neighbour");
    values[own] = 0.0;
    rows.end.push((begin + count) as u32);
    // Running sums: the share of each cell is a difference, without a loop over each.
    rows.running.clear();
    let mut sum = 0.0;
    rows.running.push(sum);
    for &value in &rows.value[begin..] {
        sum += f64::from(value);
        rows.running.push(sum);
    }
    let share = (water.aggregate[particle] as usize - rows.first_aggregate) * stencil;
    let mut before = 0.0;
    let segments = &rows.near.segment_end[..stencil.min(STENCIL_MAX)];
    for (target, &end) in rows.stencil[share..share + stencil].iter_mut().zip(segments) {
        let up_to = rows.running[end as usize];
        *target += up_to - before;
        before = up_to;
    }
    RowSums { density: f64::from(density) * kernel.value_factor(), coupling: -sum, own: begin + own }
}

/// Sum with eight running sums.
#[inline(always)]
fn sum_in_lanes(values: &[f32]) -> f32 {
    let mut lanes = [0.0f32; 8];
    let chunks = values.chunks_exact(8);
    let tail: f32 = chunks.remainder().iter().sum();
    for chunk in chunks {
        for k in 0..8 {
            lanes[k] += chunk[k];
        }
    }
    lanes.iter().sum::<f32>() + tail
}

#[inline(always)]
fn add_wall_row<const D: usize>(
    around: Surroundings<'_, D>,
    at: (usize, &Vector<D>),
    rows: &mut RowChunk,
) -> WallSums<D> {
    let mut sums = WallSums::default();
    for set in around.walls.sets_near(around.grid, at.0).into_iter().flatten() {
        add_wall_set(around, set, at, rows, &mut sums);
    }
    sums
}

#[inline(always)]
fn add_wall_set<const D: usize>(
    around: Surroundings<'_, D>,
    set: WallSet<'_, D>,
    at: (usize, &Vector<D>),
    rows: &mut RowChunk,
    sums: &mut WallSums<D>,
) {
    let (kernel, walls) = (around.kernel, around.walls);
    let support2 = kernel.support_radius * kernel.support_radius;
    rows.near.find(around.grid, set.cells, at, (support2, kernel.inverse_square()));
    let body = walls.body();
    for k in 0..rows.near.len() {
        let wall = set.column(rows.near.index[k]) as usize;
        let weight = walls.weight[wall];
        if weight == 0.0 {
            continue;
        }
        let (w, f) = shape(rows.near.q2[k].sqrt());
        let coupling = kernel.coupling_factor() * f * weight;
        rows.wall_column.push(wall as u32);
        rows.wall_value.push(coupling);
        let d = sub(at.1, &walls.position[wall]);
        let half = 0.5 * f64::from(coupling);
        sums.density += f64::from(w * weight) * kernel.value_factor();
        sums.coupling += f64::from(coupling);
        let facing = &walls.facing[wall];
        let first = sums.first.get_or_insert([0.0; D]);
        for k in 0..D {
            first[k] += half * facing[k] * d[k];
        }
        if wall >= body.start {
            sums.flux += half * dot(&walls.velocity[wall], &d);
            if let Some(robin) = around.robin {
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
