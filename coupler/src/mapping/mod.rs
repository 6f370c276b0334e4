//! Ties the fluid's side of the interface to the solid's surface: u_f = H u_s for motion, f_s = H' f_f for loads, with
//! the same H, so that force and work are kept to round-off.

mod identity;
mod projection;

use protocol::interface::Surface;

pub use projection::marker_rows;

use crate::case::MappingKind;
use crate::dummy_mesh::DummyMesh;

/// H as rows of (solid node, weight); the weights of a row sum to one.
#[derive(Debug, Clone)]
pub struct Mapping {
    dimension: usize,
    starts: Vec<usize>,
    entries: Vec<(usize, f64)>,
}

/// Why two sides cannot be tied.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MappingError {
    /// `identity` and the nodes differ.
    #[error(
        "identity mapping: node {node} of the fluid's side lies {distance:.3e} m from the nearest node of the solid"
    )]
    NotIdentical {
        /// Node of the fluid's side.
        node: usize,
        /// Distance, m.
        distance: f64,
    },
    /// The solid's surface has no facet to project on.
    #[error("the solid's surface has no facet")]
    NoFacet,
}

impl Mapping {
    /// Makes H of the chosen kind.
    ///
    /// # Errors
    /// [`MappingError`] when the sides do not allow it.
    pub fn new(kind: MappingKind, dummy: &DummyMesh, surface: &Surface) -> Result<Self, MappingError> {
        let rows = match kind {
            MappingKind::Identity => identity::rows(dummy, surface)?,
            MappingKind::Projection => projection::rows(dummy, surface)?,
        };
        let mut starts = vec![0];
        let mut entries = Vec::new();
        for row in rows {
            entries.extend(row.into_iter().filter(|entry| entry.1 != 0.0));
            starts.push(entries.len());
        }
        Ok(Self { dimension: surface.dimension, starts, entries })
    }

    fn row(&self, node: usize) -> &[(usize, f64)] {
        &self.entries[self.starts[node]..self.starts[node + 1]]
    }

    /// Motion to the fluid's side: `target = H source`, both `[n, D]`.
    pub fn spread_motion(&self, source: &[f64], target: &mut [f64]) {
        let dimension = self.dimension;
        for (node, value) in target.chunks_exact_mut(dimension).enumerate() {
            value.fill(0.0);
            for &(solid, weight) in self.row(node) {
                for axis in 0..dimension {
                    value[axis] += weight * source[solid * dimension + axis];
                }
            }
        }
    }

    /// A number per node to the fluid's side, `[n]`.
    pub fn spread_scalar(&self, source: &[f64]) -> Vec<f64> {
        let value = |node: usize| self.row(node).iter().map(|&(solid, weight)| weight * source[solid]).sum();
        (0..self.starts.len() - 1).map(value).collect()
    }

    /// Load to the solid's side: `target = H' source`, both `[n, D]` N.
    pub fn gather_load(&self, source: &[f64], target: &mut [f64]) {
        let dimension = self.dimension;
        target.fill(0.0);
        for (node, force) in source.chunks_exact(dimension).enumerate() {
            for &(solid, weight) in self.row(node) {
                for axis in 0..dimension {
                    target[solid * dimension + axis] += weight * force[axis];
                }
            }
        }
    }
}
