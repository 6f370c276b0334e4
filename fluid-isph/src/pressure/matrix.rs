//! Rows of the pressure matrix and of the walls near each water particle, in chunks of fixed length.
//!
//! Each chunk packs its rows one behind the other and keeps its memory from step to step: no count pass, no copy.
//! The diagonal stands in its row at its own column. Values are single precision: half the traffic, and the residual
//! still reaches 1e-5.

use rayon::prelude::*;

use crate::neighbours::Neighbours;
use crate::parallel::{CHUNK, MEDIUM, chunk_count, dot_product};
use crate::walls::WALL_SETS;

/// Rows of up to `CHUNK` water particles.
#[derive(Debug, Default)]
pub struct RowChunk {
    /// End of each row in `column` and `value`.
    pub end: Vec<u32>,
    /// Water particle.
    pub column: Vec<u32>,
    /// A_ij, 1/m2: -a_ij beside the diagonal.
    pub value: Vec<f32>,
    /// End of each row in `wall_column` and `wall_value`.
    pub wall_end: Vec<u32>,
    /// Wall particle.
    pub wall_column: Vec<u32>,
    /// a_iw = 2 V F_iw times the weight of the wall particle, 1/m2.
    pub wall_value: Vec<f32>,
    /// First non-empty cell a row of this chunk lies in.
    pub first_aggregate: usize,
    /// Share of this chunk in the matrix of the cells, `[cells, 3^D]`.
    pub stencil: Vec<f64>,
    /// Search buffer for the water.
    pub near: Neighbours,
    /// Search buffers for the walls of tank, obstacles and body.
    pub near_walls: [Neighbours; WALL_SETS],
    /// Running sums of the row being written.
    pub running: Vec<f64>,
}

impl RowChunk {
    /// Forgets all rows, keeps the memory.
    pub fn clear(&mut self) {
        self.end.clear();
        self.column.clear();
        self.value.clear();
        self.wall_end.clear();
        self.wall_column.clear();
        self.wall_value.clear();
        self.stencil.clear();
    }

    /// Row `k` of the chunk: water particles and A_ij.
    #[inline(always)]
    pub fn row(&self, k: usize) -> (&[u32], &[f32]) {
        let first = if k == 0 { 0 } else { self.end[k - 1] as usize };
        let last = self.end[k] as usize;
        (&self.column[first..last], &self.value[first..last])
    }

    /// Row `k` of the chunk: wall particles and a_iw.
    #[inline(always)]
    pub fn wall_row(&self, k: usize) -> (&[u32], &[f32]) {
        let first = if k == 0 { 0 } else { self.wall_end[k - 1] as usize };
        let last = self.wall_end[k] as usize;
        (&self.wall_column[first..last], &self.wall_value[first..last])
    }
}

/// The symmetric positive definite pressure matrix and the wall rows beside it.
#[derive(Debug, Default)]
pub struct PressureMatrix {
    /// Chunks of rows.
    pub chunks: Vec<RowChunk>,
    /// 1 / A_ii, m2.
    pub inverse_diagonal: Vec<f32>,
}

impl PressureMatrix {
    /// Prepares for `count` rows.
    pub fn resize(&mut self, count: usize) {
        self.chunks.resize_with(chunk_count(count), RowChunk::default);
        self.inverse_diagonal.resize(count, 0.0);
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.inverse_diagonal.len()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.inverse_diagonal.is_empty()
    }

    /// Number of stored entries, the diagonal included.
    pub fn entry_count(&self) -> usize {
        self.chunks.iter().map(|chunk| chunk.value.len()).sum()
    }

    /// Bytes one product reads and writes if every vector is moved once.
    pub fn product_bytes(&self) -> usize {
        8 * self.entry_count() + 12 * self.len()
    }

    /// Bytes held by the rows.
    pub fn bytes(&self) -> usize {
        let entries = |chunk: &RowChunk| 8 * (chunk.value.capacity() + chunk.wall_value.capacity());
        self.chunks.iter().map(entries).sum()
    }

    /// y = A x; returns x . y, summed chunk by chunk. `partial` holds one value per chunk.
    pub fn multiply(&self, x: &[f32], y: &mut [f32], partial: &mut [f64]) -> f64 {
        let rows = y.par_chunks_mut(CHUNK).zip(&self.chunks).zip(partial.par_iter_mut()).enumerate();
        rows.with_min_len(MEDIUM).for_each(|(number, ((y, chunk), partial))| {
            let own = &x[number * CHUNK..number * CHUNK + y.len()];
            let mut first = 0;
            for k in 0..y.len() {
                let last = chunk.end[k] as usize;
                y[k] = row_product(&chunk.column[first..last], &chunk.value[first..last], x);
                first = last;
            }
            *partial = dot_product(y, own);
        });
        partial.iter().sum()
    }
}

/// sum_k value_k x\[column_k\] with four running sums, so that additions overlap.
#[inline(always)]
fn row_product(column: &[u32], value: &[f32], x: &[f32]) -> f32 {
    let mut sums = [0.0f32; 4];
    let (columns, values) = (column.chunks_exact(4), value.chunks_exact(4));
    let mut tail = 0.0;
    for (&j, &a) in columns.remainder().iter().zip(values.remainder()) {
        tail += a * x[j as usize];
    }
    for (j, a) in columns.zip(values) {
        for k in 0..4 {
            sums[k] += a[k] * x[j[k] as usize];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + tail
}
