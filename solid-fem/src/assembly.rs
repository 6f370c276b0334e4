//! From elements to the whole body: forces, tangent, mass, energy.
//!
//! Elements are evaluated in parallel into a buffer of fixed size and added up in the order of their numbers by one
//! thread, so that results have the same bits for any number of threads.

use std::sync::Arc;

use rayon::prelude::*;

use crate::cell::MAX_NODES;
use crate::element::{Collapse, Element};
use crate::error::Trouble;
use crate::linear::block_matrix::{BlockMatrix, BlockPattern};
use crate::material::History;
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
    /// What each element gives: its force and the history it would keep, or its tangent.
    batch: Vec<f64>,
}

/// Displacement of the body and what its elements kept, `[n, D]` and `[elements, history]`.
#[derive(Clone, Copy)]
pub(crate) struct At<'a> {
    pub(crate) displacement: &'a [f64],
    pub(crate) history: &'a [f64],
}

/// Components of the largest element.
const MAX_COMPONENTS: usize = 3 * MAX_NODES;

/// Numbers kept by the element that keeps most: 27 points of plasticity.
const MAX_HISTORY: usize = 27 * 7;

impl Assembly {
    pub(crate) fn new(mesh: Mesh, element: Box<dyn Element>) -> Self {
        let pattern = Arc::new(BlockPattern::new(&mesh));
        let size = mesh.nodes_per_element() * mesh.dimension;
        let stride = (size * size).max(size + element.history_len());
        let batch = vec![0.0; BATCH.min(mesh.element_count()) * stride];
        Self { mesh, pattern, element, batch }
    }

    /// Numbers the elements keep from one accepted state to the next, `[elements, history]`.
    pub(crate) fn history_len(&self) -> usize {
        self.element.history_len() * self.mesh.element_count()
    }

    fn element_size(&self) -> usize {
        self.mesh.nodes_per_element() * self.mesh.dimension
    }

    /// Writes the internal force, `[n, D]`, and the history that goes with it.
    pub(crate) fn internal_force(
        &mut self,
        at: At<'_>,
        force: &mut [f64],
        history: &mut [f64],
    ) -> Result<(), Trouble> {
        let kept = self.element.history_len();
        let element = &self.element;
        let work = |e: usize, u: &[f64], out: &mut [f64]| {
            let (force, new) = out.split_at_mut(u.len());
            element.internal_force(e, u, History { old: &at.history[e * kept..][..kept], new }, force)
        };
        let take = |e: usize, new: &[f64]| history[e * kept..][..kept].copy_from_slice(new);
        add_forces(&self.mesh, &mut self.batch, (at.displacement, kept), force, work, take)
    }

    /// Writes the force of the energy-momentum method between two displacements, `[n, D]`.
    pub(crate) fn conserving_force(
        &mut self,
        before: &[f64],
        after: &[f64],
        force: &mut [f64],
    ) -> Result<(), Trouble> {
        let (mesh, element) = (&self.mesh, &self.element);
        let work = |e: usize, after: &[f64], out: &mut [f64]| {
            let mut local = [0.0; MAX_COMPONENTS];
            gather(mesh, e, before, &mut local[..after.len()]);
            element.conserving_force(e, [&local[..after.len()], after], out)
        };
        add_forces(mesh, &mut self.batch, (after, 0), force, work, |_, _| {})
    }

    /// Writes the tangent stiffness.
    pub(crate) fn tangent(&mut self, at: At<'_>, tangent: &mut BlockMatrix) -> Result<(), Trouble> {
        let (d, size, kept) = (self.mesh.dimension, self.element_size(), self.element.history_len());
        let (mesh, element) = (&self.mesh, &self.element);
        let stride = size * size;
        tangent.values.fill(0.0);
        for first in (0..mesh.element_count()).step_by(BATCH) {
            let count = BATCH.min(mesh.element_count() - first);
            let work = |e: usize, out: &mut [f64]| {
                let mut local = [0.0; MAX_COMPONENTS];
                let mut unused = [0.0; MAX_HISTORY];
                gather(mesh, first + e, at.displacement, &mut local[..size]);
                let old = &at.history[(first + e) * kept..][..kept];
                let history = History { old, new: &mut unused[..kept] };
                element.tangent(first + e, &local[..size], history, out)
            };
            let out = &mut self.batch[..count * stride];
            evaluate(out, stride, count, |e, out| work(e, out).map_err(|collapse| (first + e, collapse)))?;
            for (e, out) in out.chunks_exact(stride).enumerate() {
                let nodes = mesh.nodes_per_element();
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
        let (d, nodes) = (self.mesh.dimension, self.mesh.nodes_per_element());
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

    /// Strain energy, J.
    pub(crate) fn strain_energy(&self, at: At<'_>) -> f64 {
        let (mut local, kept) = (vec![0.0; self.element_size()], self.element.history_len());
        (0..self.mesh.element_count())
            .map(|e| {
                gather(&self.mesh, e, at.displacement, &mut local);
                self.element.strain_energy(e, &local, &at.history[e * kept..][..kept])
            })
            .sum()
    }

    /// Cauchy stress at the nodes, `[n]` xx yy zz xy yz zx Pa: the mean over the elements around by their volume.
    pub(crate) fn nodal_stress(&self, at: At<'_>) -> Vec<[f64; 6]> {
        let (mut local, kept) = (vec![0.0; self.element_size()], self.element.history_len());
        let mut own = vec![[0.0; 6]; self.mesh.nodes_per_element()];
        let mut sum = vec![([0.0; 6], 0.0); self.mesh.node_count()];
        for e in 0..self.mesh.element_count() {
            gather(&self.mesh, e, at.displacement, &mut local);
            let volume = self.element.nodal_stress(e, &local, &at.history[e * kept..][..kept], &mut own);
            for (stress, &node) in own.iter().zip(self.mesh.element(e)).filter(|_| volume > 0.0) {
                let (sum, weight) = &mut sum[node];
                (0..6).for_each(|s| sum[s] += volume * stress[s]);
                *weight += volume;
            }
        }
        sum.iter()
            .map(|(stress, weight)| stress.map(|s| if *weight > 0.0 { s / weight } else { 0.0 }))
            .collect()
    }
}

/// Writes the sum of what `work` gives for every element; `take` gets what stands behind the force, `kept` numbers.
fn add_forces(
    mesh: &Mesh,
    batch: &mut [f64],
    (displacement, kept): (&[f64], usize),
    force: &mut [f64],
    work: impl Fn(usize, &[f64], &mut [f64]) -> Result<(), Collapse> + Sync,
    mut take: impl FnMut(usize, &[f64]),
) -> Result<(), Trouble> {
    let (d, size) = (mesh.dimension, mesh.nodes_per_element() * mesh.dimension);
    let stride = size + kept;
    force.fill(0.0);
    for first in (0..mesh.element_count()).step_by(BATCH) {
        let count = BATCH.min(mesh.element_count() - first);
        let out = &mut batch[..count * stride];
        evaluate(out, stride, count, |e, out| {
            let mut local = [0.0; MAX_COMPONENTS];
            gather(mesh, first + e, displacement, &mut local[..size]);
            work(first + e, &local[..size], out).map_err(|collapse| (first + e, collapse))
        })?;
        for (e, out) in out.chunks_exact(stride).enumerate() {
            for (a, &node) in mesh.element(first + e).iter().enumerate() {
                for i in 0..d {
                    force[node * d + i] += out[a * d + i];
                }
            }
            take(first + e, &out[size..]);
        }
    }
    Ok(())
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
    work: impl Fn(usize, &mut [f64]) -> Result<(), (usize, Collapse)> + Sync,
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
        Some((element, Collapse::Inverted(determinant))) => Err(Trouble::Inverted { element, determinant }),
        Some((element, Collapse::Unsolvable)) => Err(Trouble::Material { element }),
    }
}
