//! Symmetric sparse matrix in blocks of D x D, one block row per node (block compressed rows).

use std::sync::Arc;

use rayon::prelude::*;

use super::PARALLEL_NODES;
use crate::mesh::Mesh;

/// Block rows handed to a thread at a time; fixed, so that results do not depend on the number of threads.
const ROWS_PER_CHUNK: usize = 256;

/// Which nodes share an element, and where each element's blocks go.
#[derive(Debug)]
pub struct BlockPattern {
    /// 2 or 3.
    pub dimension: usize,
    /// First block of each row, `[n + 1]`.
    pub row_start: Vec<usize>,
    /// Node of each block, ascending in a row, `[blocks]`.
    pub column: Vec<u32>,
    /// Block of node pair (a, b) of each element, `[elements, N, N]`.
    pub element_block: Vec<u32>,
}

impl BlockPattern {
    /// The pattern of a mesh.
    pub fn new(mesh: &Mesh) -> Self {
        let nodes = mesh.node_count();
        let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); nodes];
        for element in 0..mesh.element_count() {
            for &a in mesh.element(element) {
                neighbours[a].extend(mesh.element(element).iter().map(|&b| b as u32));
            }
        }
        let mut row_start = vec![0];
        let mut column = Vec::new();
        for row in &mut neighbours {
            row.sort_unstable();
            row.dedup();
            column.extend_from_slice(row);
            row_start.push(column.len());
        }
        let block = |a: usize, b: usize| {
            let row = &column[row_start[a]..row_start[a + 1]];
            row_start[a] + row.binary_search(&(b as u32)).expect("nodes of one element are neighbours")
        };
        let mut element_block = Vec::with_capacity(mesh.element_count() * mesh.nodes_per_element().pow(2));
        for element in 0..mesh.element_count() {
            for &a in mesh.element(element) {
                element_block.extend(mesh.element(element).iter().map(|&b| block(a, b) as u32));
            }
        }
        Self { dimension: mesh.dimension, row_start, column, element_block }
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.row_start.len() - 1
    }

    /// Number of blocks.
    pub fn block_count(&self) -> usize {
        self.column.len()
    }
}

/// A matrix on a pattern.
#[derive(Debug, Clone)]
pub struct BlockMatrix {
    /// Where the blocks are.
    pub pattern: Arc<BlockPattern>,
    /// `[blocks, D, D]`.
    pub values: Vec<f64>,
}

impl BlockMatrix {
    /// All zero.
    pub fn zeros(pattern: &Arc<BlockPattern>) -> Self {
        let values = vec![0.0; pattern.block_count() * pattern.dimension.pow(2)];
        Self { pattern: Arc::clone(pattern), values }
    }

    /// y = A x, both `[n, D]`.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        match self.pattern.dimension {
            2 => self.multiply_blocks::<2>(x, y),
            _ => self.multiply_blocks::<3>(x, y),
        }
    }

    fn multiply_blocks<const D: usize>(&self, x: &[f64], y: &mut [f64]) {
        if self.pattern.node_count() < PARALLEL_NODES {
            self.multiply_rows::<D>(0, x, y);
        } else {
            y.par_chunks_mut(ROWS_PER_CHUNK * D)
                .enumerate()
                .for_each(|(chunk, y)| self.multiply_rows::<D>(chunk * ROWS_PER_CHUNK, x, y));
        }
    }

    fn multiply_rows<const D: usize>(&self, first: usize, x: &[f64], y: &mut [f64]) {
        for (row, y) in y.chunks_exact_mut(D).enumerate() {
            let range = self.pattern.row_start[first + row]..self.pattern.row_start[first + row + 1];
            let blocks = self.values[range.start * D * D..range.end * D * D].chunks_exact(D * D);
            let mut sum = [0.0; D];
            for (&column, block) in self.pattern.column[range].iter().zip(blocks) {
                let x = &x[column as usize * D..][..D];
                for i in 0..D {
                    for j in 0..D {
                        sum[i] += block[i * D + j] * x[j];
                    }
                }
            }
            y.copy_from_slice(&sum);
        }
    }

    /// Writes the diagonal, `[n, D]`.
    pub fn diagonal(&self, diagonal: &mut [f64]) {
        let d = self.pattern.dimension;
        for node in 0..self.pattern.node_count() {
            let row = self.pattern.row_start[node]..self.pattern.row_start[node + 1];
            let own = self.pattern.column[row.clone()].binary_search(&(node as u32));
            let block = row.start + own.expect("every node is its own neighbour");
            for i in 0..d {
                diagonal[node * d + i] = self.values[block * d * d + i * d + i];
            }
        }
    }

    /// Turns the rows and columns of fixed components into those of the identity.
    pub fn fix(&mut self, is_fixed: &[bool]) {
        let d = self.pattern.dimension;
        for node in 0..self.pattern.node_count() {
            for block in self.pattern.row_start[node]..self.pattern.row_start[node + 1] {
                let column = self.pattern.column[block] as usize;
                for i in 0..d {
                    for j in 0..d {
                        if is_fixed[node * d + i] || is_fixed[column * d + j] {
                            let same = node == column && i == j;
                            self.values[block * d * d + i * d + j] = if same { 1.0 } else { 0.0 };
                        }
                    }
                }
            }
        }
    }
}
