//! How the body's particles hang on points without a mesh: particle k is point k, in columns across the wall.

use crate::nodes::Nodes;
use crate::offer::Offer;
use crate::vector::{Vector, add_scaled, normalised, sub};
use crate::walls::Walls;

/// Particles that are points, `[b]`.
#[derive(Debug)]
pub struct Columns {
    count: usize,
    /// Particles in a column.
    layers: usize,
    /// Places in a column of its particles at the lower and the upper end of the axis across the wall.
    ends: [usize; 2],
}

impl Columns {
    /// The particles of an offer.
    pub fn new<const D: usize>(offer: &Offer<D>) -> Self {
        let (count, layers) = (offer.particle_count(), offer.layers);
        let (first, last) = (0, layers - 1);
        let along: f64 = sub(&offer.position[last], &offer.position[first]).iter().sum();
        let ends = if along < 0.0 { [last, first] } else { [first, last] };
        Self { count, layers, ends }
    }

    /// Writes position, velocity, acceleration and director of all particles into the wall columns.
    ///
    /// The normals given do not tell the two faces of a wall apart near its other edges: there the nearest surface may be
    /// the wall's top. The director follows the column instead, from its lower to its upper end, as in a cell of a mesh.
    pub fn place<const D: usize>(&self, nodes: &Nodes<D>, walls: &mut Walls<D>) {
        let body = walls.body();
        walls.position[body.clone()].copy_from_slice(&nodes.position[..self.count]);
        walls.velocity[body.clone()].copy_from_slice(&nodes.velocity[..self.count]);
        walls.acceleration[body.clone()].copy_from_slice(&nodes.acceleration[..self.count]);
        let directors = &mut walls.director[body];
        if self.layers < 2 {
            directors.copy_from_slice(&nodes.normal[..self.count]);
            return;
        }
        let columns = directors.chunks_exact_mut(self.layers);
        for (directors, x) in columns.zip(nodes.position.chunks_exact(self.layers)) {
            let [lower, upper] = self.ends;
            directors.fill(normalised(&sub(&x[upper], &x[lower])));
        }
    }

    /// Adds `factor` times the load on each particle at its point, `[n D]` N.
    pub fn add_load<const D: usize>(&self, factor: f64, load: &[Vector<D>], at_points: &mut [f64]) {
        for (target, load) in at_points.as_chunks_mut::<D>().0.iter_mut().zip(load) {
            add_scaled(target, factor, load);
        }
    }
}
