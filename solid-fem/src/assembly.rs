//! From elements to the whole body: forces, tangent, mass, energy.
//!
//! Elements are evaluated in parallel into a buffer of fixed size and added up in the order of their numbers by one
//! thread, so that results have the same bits for any number of threads.

use std::sync::Arc;

use rayon::prelude::*;

use crate::element::Element;
use crate::error::Trouble;
use crate::linear::block_matrix::{BlockMatrix, BlockPattern};
use crate::mesh::Mesh;

/// Elements evaluated before they are added up; bounds the buffer of element matrices.
const BATCH: usize = 512;

/// Elements a thread takes at a time.
const ELEMENTS_PER_CHUNK: usize = 16;

/// Below this number of elements one thread does all.
const PARALLEL_ELEMENTS: usize = 96;

/// The body's elements and the buffers to add them up.
pub(crate) struct Assembly {
    pub(crate) mesh: Mesh,
    pub(crate) pattern: Arc<BlockPattern>,
    element: Box<dyn Element>,
    batch_force: Vec<f64>,
    batch_tangent: Vec<f64>,
}

impl Assembly {
    pub(crate) fn new(mesh: Mesh, element: Box<dyn Element>) -> Self {
        let pattern = Arc::new(BlockPattern::new(&mesh));
        let size = mesh.nodes_per_element * mesh.dimension;
        let batch = BATCH.min(mesh.element_count());
        let (batch_force, batch_tangent) = (vec![0.0; batch * size], vec![0.0; batch * size * size]);
        Self { mesh, pattern, element, batch_force, batch_tangent }
    }

    /// Writes the internal force at a displacement, both `[n, D]`.
    pub(crate) fn internal_force(&mut self, displacement: &[f64], force: &mut [f64]) -> Result<(), Trouble> {
        let (d, size) = (self.mesh.dimension, self.mesh.nodes_per_element * self.mesh.dimension);
        let (mesh, element) = (&self.mesh, &self.element);
        force.fill(0.0);
        for first in (0..mesh.element_count()).step_by(BATCH) {
            let count = BATCH.min(mesh.element_count() - first);
            let work = |e: usize, out: &mut [f64]| {
                let mut local = [0.0; 24];
                gather(mesh, first + e, displacement, &mut local[..size]);
                element.internal_force(first + e, &local[..size], out)
            };
            let out = &mut self.batch_force[..count * size];
            evaluate(out, size, count, |e, out| work(e, out).map_err(|inverted| (first + e, inverted.0)))?;
            for (e, out) in out.chunks_exact(size).enumerate() {
                for (a, &node) in mesh.element(first + e).iter().enumerate() {
                    for i in 0..d {
                        force[node * d + i] += out[a * d + i];
                    }
                }
            }
        }
        Ok(())
    }

    /// Writes the tangent stiffness at a displacement.
    pub(crate) fn tangent(&mut self, displacement: &[f64], tangent: &mut BlockMatrix) -> Result<(), Trouble> {
        let (d, size) = (self.mesh.dimension, self.mesh.nodes_per_element * self.mesh.dimension);
        let (mesh, element) = (&self.mesh, &self.element);
        let stride = size * size;
        tangent.values.fill(0.0);
        for first in (0..mesh.element_count()).step_by(BATCH) {
            let count = BATCH.min(mesh.element_count() - first);
            let work = |e: usize, out: &mut [f64]| {
                let (mut local, mut unused) = ([0.0; 24], [0.0; 24]);
                gather(mesh, first + e, displacement, &mut local[..size]);
                element.tangent(first + e, &local[..size], &mut unused[..size], out)
            };
            let out = &mut self.batch_tangent[..count * stride];
            evaluate(out, stride, count, |e, out| work(e, out).map_err(|inverted| (first + e, inverted.0)))?;
            for (e, out) in out.chunks_exact(stride).enumerate() {
                let nodes = mesh.nodes_per_element;
                let blocks = &self.pattern.element_block[(first + e) * nodes * nodes..][..nodes * nodes];
                for (pair, &block) in blocks.iter().enumerate() {
                    let (a, b) = (pair / nodes, pair % nodes);
                    let target = &mut tangent.values[block as usize * d * d..][..d * d];
                    for i in 0..d {
                        let row = &out[(a * d + i) * size + b * d..][..d];
                        for j in 0..d {
                            target[i * d + j] += row[j];
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// The consistent mass matrix, kg.
    pub(crate) fn mass(&self, density: f64) -> BlockMatrix {
        let (d, nodes) = (self.mesh.dimension, self.mesh.nodes_per_element);
        let mut mass = BlockMatrix::zeros(&self.pattern);
        let mut product = vec![0.0; nodes * nodes];
        for e in 0..self.mesh.element_count() {
            self.element.shape_product(e, &mut product);
            for pair in 0..nodes * nodes {
                let block = self.pattern.element_block[e * nodes * nodes + pair] as usize;
                for i in 0..d {
                    mass.values[block * d * d + i * d + i] += density * product[pair];
                }
            }
        }
        mass
    }

    /// Strain energy at a displacement, J.
    pub(crate) fn strain_energy(&self, displacement: &[f64]) -> f64 {
        let mut local = vec![0.0; self.mesh.nodes_per_element * self.mesh.dimension];
        (0..self.mesh.element_count())
            .map(|e| {
                gather(&self.mesh, e, displacement, &mut local);
                self.element.strain_energy(e, &local)
            })
            .sum()
    }
}

fn gather(mesh: &Mesh, element: usize, values: &[f64], local: &mut [f64]) {
    let d = mesh.dimension;
    for (local, &node) in local.chunks_exact_mut(d).zip(mesh.element(element)) {
        local.copy_from_slice(&values[node * d..node * d + d]);
    }
}

/// Runs `work` on every element's part of the buffer; on trouble names the lowest element.
fn evaluate(
    out: &mut [f64],
    stride: usize,
    count: usize,
    work: impl Fn(usize, &mut [f64]) -> Result<(), (usize, f64)> + Sync,
) -> Result<(), Trouble> {
    let chunk_of = |chunk: usize, out: &mut [f64]| {
        let elements = out.chunks_exact_mut(stride).enumerate();
        elements.filter_map(|(e, out)| work(chunk * ELEMENTS_PER_CHUNK + e, out).err()).next()
    };
    let worst = if count < PARALLEL_ELEMENTS {
        out.chunks_mut(ELEMENTS_PER_CHUNK * stride).enumerate().find_map(|(chunk, out)| chunk_of(chunk, out))
    } else {
        out.par_chunks_mut(ELEMENTS_PER_CHUNK * stride)
            .enumerate()
            .filter_map(|(chunk, out)| chunk_of(chunk, out))
            .min_by_key(|&(element, _)| element)
    };
    match worst {
        None => Ok(()),
        Some((element, determinant)) => Err(Trouble::Inverted { element, determinant }),
    }
}
