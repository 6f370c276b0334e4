//! Ties the fluid's side of the interface to the solid's surface: u_f = H u_s for motion, f_s = H' f_f for loads, with
//! the same H, so that force and work are kept to round-off.
//!
//! The fluid's side is a set of points: the nodes of the dummy mesh, or those the fluid offers. Points off the solid's
//! surface hang on it by a couple (`couple.rs`), so that the moment is kept as well.

mod couple;
mod facet;
mod footprint;
mod identity;
mod nearest;
mod projection;
mod rbf;
mod sparse;

use protocol::interface::{Points, Surface};

pub use projection::{feet, marker_rows};
pub use sparse::Sparse;

use crate::case::MappingKind;
use crate::parallel;
use couple::Couple;

/// H: rows of (solid node, weight), whose weights sum to one, and the couples of the points off the surface.
#[derive(Debug, Clone)]
pub struct Mapping {
    dimension: usize,
    rows: Sparse,
    /// H', by which loads are gathered node by node.
    transposed: Sparse,
    couples: Vec<Couple>,
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
    /// `rbf` and too many nodes for a dense matrix.
    #[error(
        "rbf mapping: the solid's surface has {count} nodes, at most {limit} are allowed; use projection"
    )]
    TooManyNodes {
        /// Nodes of the solid's surface.
        count: usize,
        /// The most a dense matrix is made for.
        limit: usize,
    },
    /// `rbf` and two nodes at one place.
    #[error("rbf mapping: two nodes of the solid's surface are at the same place; use projection")]
    Coincident,
}

/// Rows of H, one per point of the fluid's side.
type Rows = Vec<Vec<(usize, f64)>>;

impl Mapping {
    /// Makes H of the chosen kind between `points` of the fluid's side, `[n, D]` m, and the solid's surface, both of
    /// the unloaded body.
    ///
    /// # Errors
    /// [`MappingError`] when the sides do not allow it.
    pub fn new(kind: MappingKind, points: &[f64], surface: &Surface) -> Result<Self, MappingError> {
        Self::of(kind, points, surface, || projection::rows(points, surface))
    }

    /// The same of points without a mesh, each as wide as the piece of the surface that is its own.
    ///
    /// # Errors
    /// [`MappingError`] when the sides do not allow it.
    pub fn of_points(kind: MappingKind, points: &Points, surface: &Surface) -> Result<Self, MappingError> {
        let position = &points.reference_position;
        Self::of(kind, position, surface, || {
            projection::rows_of_points(position, &footprint::widths(points), surface)
        })
    }

    fn of(
        kind: MappingKind,
        points: &[f64],
        surface: &Surface,
        project: impl FnOnce() -> Result<(Rows, Vec<Couple>), MappingError>,
    ) -> Result<Self, MappingError> {
        let (rows, couples) = match kind {
            MappingKind::Identity => (identity::rows(points, surface)?, Vec::new()),
            MappingKind::Projection => project()?,
            MappingKind::Nearest => (nearest::rows(points, surface), Vec::new()),
            MappingKind::Rbf => (rbf::rows(points, surface)?, Vec::new()),
        };
        let rows = Sparse::pack(rows);
        let transposed = rows.transpose(surface.reference_position.len() / surface.dimension);
        Ok(Self { dimension: surface.dimension, rows, transposed, couples })
    }

    /// Whether points hang off the solid's surface: H then depends on how far that has turned.
    pub fn turns(&self) -> bool {
        !self.couples.is_empty()
    }

    /// Turns the points off the surface with it to where the solid's nodes are now, `[n, D]` m.
    pub fn turn(&mut self, position: &[f64]) {
        let dimension = self.dimension;
        parallel::each(&mut self.couples, |couple| couple.turn(dimension, position));
    }

    /// Where the points are, `[n, D]` m, from their places at the unloaded body and the displacement of the solid's nodes, to
    /// which the points off the surface must have been turned.
    pub fn place(&self, reference: &[f64], displacement: &[f64], target: &mut [f64]) {
        self.rows.spread(self.dimension, |i| reference[i], |i| displacement[i], target);
        self.couples.iter().for_each(|couple| couple.add_turn(self.dimension, target));
    }

    /// Motion to the fluid's side: `target = H source`, both `[n, D]`.
    pub fn spread_motion(&self, source: &[f64], target: &mut [f64]) {
        self.spread(|component| source[component], target);
    }

    /// The same of a source that is a function of the flat number of the component.
    pub fn spread(&self, source: impl Fn(usize) -> f64 + Sync, target: &mut [f64]) {
        let dimension = self.dimension;
        self.rows.spread(dimension, |_| 0.0, &source, target);
        self.couples.iter().for_each(|couple| couple.add_motion(dimension, &source, target));
    }

    /// Work of nodal forces on the fluid's side, `[n, D]` N, along H source, J.
    pub fn work(&self, force: &[f64], source: impl Fn(usize) -> f64 + Sync) -> f64 {
        let dimension = self.dimension;
        let turning = parallel::sum(0..self.couples.len(), &|couples| {
            self.couples[couples].iter().map(|couple| couple.work(dimension, force, &source)).sum::<f64>()
        });
        self.rows.product(dimension, force, &source) + turning
    }

    /// A number per node to the fluid's side, `[n]`.
    pub fn spread_scalar(&self, source: &[f64]) -> Vec<f64> {
        let value = |row| self.rows.row(row).iter().map(|&(solid, weight)| weight * source[solid]).sum();
        (0..self.rows.len()).map(value).collect()
    }

    /// Load to the solid's side: `target = H' source`, both `[n, D]` N.
    pub fn gather_load(&self, source: &[f64], target: &mut [f64]) {
        let dimension = self.dimension;
        self.transposed.spread(dimension, |_| 0.0, |component| source[component], target);
        self.couples.iter().for_each(|couple| couple.add_load(dimension, source, target));
    }
}
