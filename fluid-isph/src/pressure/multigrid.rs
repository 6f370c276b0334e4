//! Preconditioner: z = D^-1 r + P C P' r.
//!
//! D is the diagonal, P is piecewise constant over the non-empty search cells (their particles are contiguous), and C
//! is one symmetric V-cycle on the Galerkin matrix P'AP, a 3^D stencil because the support is one cell wide. Coarser
//! levels join 2^D cells until at most `DIRECT` are left, which are solved by Cholesky factors; their corrections are
//! taken 1.5 times.
//! Aggregation with over-correction: Braess (1995), Computing 55, 379.

use rayon::prelude::*;

use super::matrix::PressureMatrix;
use crate::cells::Grid;
use crate::parallel::{CHUNK, LIGHT, MEDIUM, dot_product};
use crate::particles::Water;

/// Factor of the corrections between levels of cells.
const OVER_CORRECTION: f32 = 1.5;

/// At most so many cells are solved directly.
const DIRECT: usize = 60;

/// Rows per Gauss-Seidel block; between blocks the sweep is a Jacobi sweep.
const BLOCK: usize = 512;

/// One level of cells.
#[derive(Debug, Default)]
struct Level {
    /// Cell coordinates, three of them (the last 0 in 2-D).
    at: Vec<[u32; 3]>,
    /// Neighbour in each stencil place, itself where there is none (its value is then 0), `[n, S]`.
    column: Vec<u32>,
    /// Matrix values, `[n, S]`, 1/m2.
    value: Vec<f32>,
    inverse_diagonal: Vec<f32>,
    /// Cell of the next level each cell belongs to.
    parent: Vec<u32>,
    /// Cells of the finer level joined in each cell, in rising order, one cell's behind the other's.
    child: Vec<u32>,
    /// First of each cell's children, `[n + 1]`.
    child_start: Vec<u32>,
    /// Cell at each place of the level's own grid.
    place: Vec<u32>,
    extent: [u32; 3],
    solution: Vec<f32>,
    old: Vec<f32>,
    right_side: Vec<f32>,
    residual: Vec<f32>,
}

/// The hierarchy; memory is kept from step to step.
#[derive(Debug, Default)]
pub struct Multigrid<const D: usize> {
    levels: Vec<Level>,
    depth: usize,
    /// Cholesky factor of the last level, lower triangle row by row.
    factor: Vec<f64>,
    work: Vec<f64>,
}

const NOWHERE: u32 = u32::MAX;

impl<const D: usize> Multigrid<D> {
    const STENCIL: usize = 3usize.pow(D as u32);

    /// Builds all levels from the chunks' shares in the matrix of the cells.
    pub fn build(&mut self, grid: &Grid<D>, water: &Water<D>, matrix: &PressureMatrix) {
        if self.levels.is_empty() {
            self.levels.push(Level::default());
        }
        self.levels[0].gather_cells(grid, water);
        self.levels[0].gather_matrix::<D>(water, matrix);
        self.depth = 1;
        while self.levels[self.depth - 1].at.len() > DIRECT {
            if self.levels.len() == self.depth {
                self.levels.push(Level::default());
            }
            let (finer, coarser) = self.levels.split_at_mut(self.depth);
            coarser[0].coarsen::<D>(&mut finer[self.depth - 1]);
            self.depth += 1;
            if self.levels[self.depth - 1].at.len() == self.levels[self.depth - 2].at.len() {
                break;
            }
        }
        self.factorise();
    }

    /// Number of levels of cells.
    pub fn depth(&self) -> usize {
        self.depth
    }

    /// z = D^-1 r + P C P' r; returns r . z. `partial` holds one value per chunk.
    pub fn apply(
        &mut self,
        (water, matrix): (&Water<D>, &PressureMatrix),
        r: &[f32],
        z: &mut [f32],
        partial: &mut [f64],
    ) -> f64 {
        let start = &water.aggregate_start;
        let sums = self.levels[0].right_side.par_chunks_mut(CHUNK).enumerate().with_min_len(MEDIUM);
        sums.for_each(|(number, sums)| {
            for (k, sum) in sums.iter_mut().enumerate() {
                let cell = number * CHUNK + k;
                *sum = r[start[cell] as usize..start[cell + 1] as usize].iter().sum();
            }
        });
        self.cycle(0);
        let coarse = &self.levels[0].solution;
        let columns = (z.par_chunks_mut(CHUNK), r.par_chunks(CHUNK), partial.par_iter_mut());
        let given = (matrix.inverse_diagonal.par_chunks(CHUNK), water.aggregate.par_chunks(CHUNK));
        (columns, given).into_par_iter().with_min_len(LIGHT).for_each(
            |((z, r, partial), (inverse_diagonal, aggregate))| {
                for k in 0..z.len() {
                    z[k] = r[k] * inverse_diagonal[k] + coarse[aggregate[k] as usize];
                }
                *partial = dot_product(z, r);
            },
        );
        partial.iter().sum()
    }

    /// One V-cycle for the level's right side, starting from zero: forward sweep before, backward sweep after.
    fn cycle(&mut self, number: usize) {
        if number + 1 == self.depth {
            return self.solve_directly();
        }
        self.levels[number].sweep_forward_from_zero::<D>();
        self.levels[number].find_residual::<D>();
        let (finer, coarser) = self.levels.split_at_mut(number + 1);
        coarser[0].restrict(&finer[number].residual);
        self.cycle(number + 1);
        let (finer, coarser) = self.levels.split_at_mut(number + 1);
        finer[number].correct(&coarser[0].solution);
        finer[number].sweep_backward::<D>();
    }

    fn factorise(&mut self) {
        let level = &self.levels[self.depth - 1];
        let n = level.at.len();
        self.factor.clear();
        self.factor.resize(n * n, 0.0);
        for i in 0..n {
            for s in 0..Self::STENCIL {
                let j = level.column[i * Self::STENCIL + s] as usize;
                self.factor[i * n + j] += f64::from(level.value[i * Self::STENCIL + s]);
            }
        }
        for i in 0..n {
            for j in 0..=i {
                let mut sum = self.factor[i * n + j];
                for k in 0..j {
                    sum -= self.factor[i * n + k] * self.factor[j * n + k];
                }
                // The matrix is strictly dominant: a pivot is only ever rounded away, then the row stands alone.
                let diagonal = self.factor[j * n + j];
                self.factor[i * n + j] =
                    if i == j { sum.max(f64::MIN_POSITIVE).sqrt() } else { sum / diagonal };
            }
        }
    }

    fn solve_directly(&mut self) {
        let level = &mut self.levels[self.depth - 1];
        let n = level.at.len();
        self.work.clear();
        self.work.extend(level.right_side.iter().map(|&value| f64::from(value)));
        for i in 0..n {
            for k in 0..i {
                self.work[i] -= self.factor[i * n + k] * self.work[k];
            }
            self.work[i] /= self.factor[i * n + i];
        }
        for i in (0..n).rev() {
            for k in i + 1..n {
                self.work[i] -= self.factor[k * n + i] * self.work[k];
            }
            self.work[i] /= self.factor[i * n + i];
        }
        for (solution, &value) in level.solution.iter_mut().zip(&self.work) {
            *solution = value as f32;
        }
    }
}

impl Level {
    fn resize(&mut self, count: usize, stencil: usize) {
        self.column.resize(count * stencil, 0);
        self.value.resize(count * stencil, 0.0);
        for column in [&mut self.inverse_diagonal, &mut self.solution, &mut self.old] {
            column.resize(count, 0.0);
        }
        for column in [&mut self.right_side, &mut self.residual] {
            column.resize(count, 0.0);
        }
    }

    /// Level 0: the non-empty cells of the search grid.
    fn gather_cells<const D: usize>(&mut self, grid: &Grid<D>, water: &Water<D>) {
        let count = grid.count();
        self.extent = [1; 3];
        for k in 0..D {
            self.extent[k] = count[k] as u32;
        }
        self.at.clear();
        self.at.extend(water.occupied.iter().map(|&cell| {
            let mut at = [0; 3];
            for (target, source) in at.iter_mut().zip(grid.coordinates(cell as usize)) {
                *target = source as u32;
            }
            at
        }));
        self.link::<D>();
    }

    /// Fills `place` and `column` from the cells' coordinates.
    fn link<const D: usize>(&mut self) {
        let stencil = Multigrid::<D>::STENCIL;
        self.resize(self.at.len(), stencil);
        let [nx, ny, nz] = self.extent.map(|n| n as usize);
        self.place.clear();
        self.place.resize(nx * ny * nz, NOWHERE);
        let index = |at: [u32; 3]| at[0] as usize + nx * (at[1] as usize + ny * at[2] as usize);
        for (cell, &at) in self.at.iter().enumerate() {
            self.place[index(at)] = cell as u32;
        }
        let (place, extent) = (&self.place, self.extent);
        let rows = self.column.par_chunks_mut(CHUNK * stencil).zip(self.at.par_chunks(CHUNK)).enumerate();
        rows.with_min_len(MEDIUM).for_each(|(number, (columns, cells))| {
            for (k, (row, at)) in columns.chunks_exact_mut(stencil).zip(cells).enumerate() {
                for (s, column) in row.iter_mut().enumerate() {
                    let steps = [s % 3, s / 3 % 3, if D == 3 { s / 9 } else { 1 }];
                    let to: [u32; 3] = std::array::from_fn(|k| (at[k] + steps[k] as u32).wrapping_sub(1));
                    let inside = (0..3).all(|k| to[k] < extent[k]);
                    let found = if inside { place[index(to)] } else { NOWHERE };
                    *column = if found == NOWHERE { (number * CHUNK + k) as u32 } else { found };
                }
            }
        });
    }

    /// Level 0: sums the chunks' shares; a cell may lie in several chunks.
    fn gather_matrix<const D: usize>(&mut self, water: &Water<D>, matrix: &PressureMatrix) {
        let stencil = Multigrid::<D>::STENCIL;
        let start = &water.aggregate_start;
        let rows =
            self.value.par_chunks_mut(CHUNK * stencil).zip(self.inverse_diagonal.par_chunks_mut(CHUNK));
        rows.enumerate().with_min_len(MEDIUM).for_each(|(number, (values, inverse_diagonal))| {
            for (k, row) in values.chunks_exact_mut(stencil).enumerate() {
                let cell = number * CHUNK + k;
                let (first, last) = (start[cell] as usize / CHUNK, (start[cell + 1] as usize - 1) / CHUNK);
                let mut sums = [0.0; crate::cells::STENCIL_MAX];
                for chunk in &matrix.chunks[first..=last] {
                    let share = (cell - chunk.first_aggregate) * stencil;
                    for (sum, value) in sums.iter_mut().zip(&chunk.stencil[share..share + stencil]) {
                        *sum += value;
                    }
                }
                for (value, sum) in row.iter_mut().zip(sums) {
                    *value = sum as f32;
                }
                inverse_diagonal[k] = 1.0 / row[stencil / 2];
            }
        });
    }

    /// Makes this level from the finer one by joining 2^D cells.
    fn coarsen<const D: usize>(&mut self, finer: &mut Self) {
        self.extent = finer.extent.map(|n| n.div_ceil(2));
        let [nx, ny, nz] = self.extent.map(|n| n as usize);
        self.place.clear();
        self.place.resize(nx * ny * nz, NOWHERE);
        self.at.clear();
        finer.parent.clear();
        for at in &finer.at {
            let parent = at.map(|k| k / 2);
            let place = parent[0] as usize + nx * (parent[1] as usize + ny * parent[2] as usize);
            if self.place[place] == NOWHERE {
                self.place[place] = self.at.len() as u32;
                self.at.push(parent);
            }
            finer.parent.push(self.place[place]);
        }
        self.link::<D>();
        self.list_children(&finer.parent);
        self.join_rows::<D>(finer);
    }

    /// Sorts the finer level's cells by their parent (counting sort).
    fn list_children(&mut self, parent: &[u32]) {
        // Two places further on, so that after the children are placed each start stands where it belongs.
        self.child_start.clear();
        self.child_start.resize(self.at.len() + 2, 0);
        for &parent in parent {
            self.child_start[parent as usize + 2] += 1;
        }
        for cell in 2..self.child_start.len() {
            self.child_start[cell] += self.child_start[cell - 1];
        }
        self.child.resize(parent.len(), 0);
        for (cell, &parent) in parent.iter().enumerate() {
            let place = &mut self.child_start[parent as usize + 1];
            self.child[*place as usize] = cell as u32;
            *place += 1;
        }
    }

    /// Each row is the sum of its children's rows, entry by entry onto the parent of the entry's cell.
    fn join_rows<const D: usize>(&mut self, finer: &Self) {
        let stencil = Multigrid::<D>::STENCIL;
        let rows =
            self.value.par_chunks_mut(CHUNK * stencil).zip(self.inverse_diagonal.par_chunks_mut(CHUNK));
        let (start, child) = (&self.child_start, &self.child);
        rows.enumerate().for_each(|(number, (values, inverse_diagonal))| {
            for (k, row) in values.chunks_exact_mut(stencil).enumerate() {
                row.fill(0.0);
                let cell = number * CHUNK + k;
                for &child in &child[start[cell] as usize..start[cell + 1] as usize] {
                    let at = finer.at[child as usize];
                    let first = child as usize * stencil;
                    for (s, value) in finer.value[first..first + stencil].iter().enumerate() {
                        let steps = [s % 3, s / 3 % 3, if D == 3 { s / 9 } else { 1 }];
                        // Step of the parents: floor((parity + step) / 2), all shifted by one to stay positive.
                        let up: [usize; 3] =
                            std::array::from_fn(|k| (at[k] as usize % 2 + steps[k]).div_ceil(2));
                        let target = if D == 3 { up[0] + 3 * up[1] + 9 * up[2] } else { up[0] + 3 * up[1] };
                        row[target] += value;
                    }
                }
                inverse_diagonal[k] = 1.0 / row[stencil / 2];
            }
        });
    }

    /// right side = sum of the children's residuals.
    fn restrict(&mut self, residual: &[f32]) {
        let (start, child) = (&self.child_start, &self.child);
        self.right_side.par_chunks_mut(CHUNK).enumerate().with_min_len(MEDIUM).for_each(|(number, sums)| {
            for (k, sum) in sums.iter_mut().enumerate() {
                let cell = number * CHUNK + k;
                *sum = 0.0;
                for &child in &child[start[cell] as usize..start[cell + 1] as usize] {
                    *sum += residual[child as usize];
                }
            }
        });
    }

    /// solution += 1.5 times that of the parents.
    fn correct(&mut self, coarse: &[f32]) {
        let columns = self.solution.par_chunks_mut(CHUNK).zip(self.parent.par_chunks(CHUNK));
        columns.with_min_len(LIGHT).for_each(|(solution, parent)| {
            for (solution, &parent) in solution.iter_mut().zip(parent) {
                *solution += OVER_CORRECTION * coarse[parent as usize];
            }
        });
    }

    /// x = M^-1 b with M the lower triangle inside each block; columns outside the block count as zero.
    fn sweep_forward_from_zero<const D: usize>(&mut self) {
        let stencil = Multigrid::<D>::STENCIL;
        let (column, value) = (&self.column, &self.value);
        let (inverse_diagonal, right_side) = (&self.inverse_diagonal, &self.right_side);
        self.solution.par_chunks_mut(BLOCK).enumerate().for_each(|(number, x)| {
            let first = number * BLOCK;
            for k in 0..x.len() {
                let (row, mut sum) = ((first + k) * stencil, right_side[first + k]);
                // Cells are in rising order: smaller numbers stand in the first half of the stencil.
                for s in row..row + stencil / 2 {
                    let j = (column[s] as usize).wrapping_sub(first);
                    if j < k {
                        sum -= value[s] * x[j];
                    }
                }
                x[k] = sum * inverse_diagonal[first + k];
            }
        });
    }

    /// Adjoint of the forward sweep: backwards inside each block, old values from outside.
    fn sweep_backward<const D: usize>(&mut self) {
        let stencil = Multigrid::<D>::STENCIL;
        self.old.copy_from_slice(&self.solution);
        let (column, value, old) = (&self.column, &self.value, &self.old);
        let (inverse_diagonal, right_side) = (&self.inverse_diagonal, &self.right_side);
        self.solution.par_chunks_mut(BLOCK).enumerate().for_each(|(number, x)| {
            let first = number * BLOCK;
            for k in (0..x.len()).rev() {
                let (row, mut sum) = ((first + k) * stencil, right_side[first + k]);
                for s in row..row + stencil {
                    let j = column[s] as usize;
                    let inside = x.get(j.wrapping_sub(first)).copied();
                    sum -= value[s] * inside.unwrap_or(old[j]);
                }
                // The row's own term was subtracted with the rest.
                x[k] += sum * inverse_diagonal[first + k];
            }
        });
    }

    /// residual = b - A x.
    fn find_residual<const D: usize>(&mut self) {
        let stencil = Multigrid::<D>::STENCIL;
        let (column, value, x, right_side) = (&self.column, &self.value, &self.solution, &self.right_side);
        self.residual.par_chunks_mut(BLOCK).enumerate().for_each(|(number, residual)| {
            for (k, target) in residual.iter_mut().enumerate() {
                let row = (number * BLOCK + k) * stencil;
                let mut sum = right_side[number * BLOCK + k];
                for s in row..row + stencil {
                    sum -= value[s] * x[column[s] as usize];
                }
                *target = sum;
            }
        });
    }
}
