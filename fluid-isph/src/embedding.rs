//! How the body's particles hang on a dummy mesh: each in a cell, by the cell's shape functions.
//!
//! Position, velocity and director of a particle are the shape functions of the nodes; the load goes back to the nodes by
//! the transpose, so force, moment and work balance by construction, also at uneven pitch.

use protocol::interface::BodyMesh;

use crate::body_layout::{Embedded, corners, shape_derivatives, shape_functions};
use crate::nodes::Nodes;
use crate::vector::{Vector, add_scaled, normalised};
use crate::walls::Walls;

/// Particles in cells, `[b]`.
#[derive(Debug)]
pub struct Embedding<const D: usize> {
    /// Nodes each particle hangs on, `[b, 2^D]`.
    node: Vec<u32>,
    /// Shape functions, `[b, 2^D]`.
    shape: Vec<f64>,
    /// Their derivatives across the wall, `[b, 2^D]`.
    across: Vec<f64>,
    /// Constant offset of the ghost rows, m.
    offset: Vec<Vector<D>>,
}

impl<const D: usize> Embedding<D> {
    /// Hangs the particles on the nodes of their cells.
    pub fn new(mesh: &BodyMesh, particles: &[Embedded<D>]) -> Self {
        let count = particles.len();
        let mut embedding = Self {
            node: Vec::with_capacity(count << D),
            shape: Vec::with_capacity(count << D),
            across: Vec::with_capacity(count << D),
            offset: Vec::with_capacity(count),
        };
        for particle in particles {
            embedding.node.extend(corners::<D>(mesh, particle.cell).iter().map(|&node| node as u32));
            embedding.shape.extend(shape_functions(&particle.local));
            embedding.across.extend(shape_derivatives(&particle.inside(), 0));
            embedding.offset.push(particle.offset);
        }
        embedding
    }

    /// Writes position, velocity, acceleration and director of all particles into the wall columns.
    pub fn place(&self, nodes: &Nodes<D>, walls: &mut Walls<D>) {
        let first = walls.body().start;
        for particle in 0..self.offset.len() {
            let wall = first + particle;
            walls.position[wall] = self.embed(particle, &self.shape, &nodes.position);
            add_scaled(&mut walls.position[wall], 1.0, &self.offset[particle]);
            walls.director[wall] = normalised(&self.embed(particle, &self.across, &nodes.position));
            walls.velocity[wall] = self.embed(particle, &self.shape, &nodes.velocity);
            walls.acceleration[wall] = self.embed(particle, &self.shape, &nodes.acceleration);
        }
    }

    fn embed(&self, particle: usize, weights: &[f64], nodal: &[Vector<D>]) -> Vector<D> {
        let mut sum = [0.0; D];
        for corner in particle << D..(particle + 1) << D {
            add_scaled(&mut sum, weights[corner], &nodal[self.node[corner] as usize]);
        }
        sum
    }

    /// nodal += factor times the transpose of the embedding applied to `load`, `[n D]` N.
    pub fn add_nodal_load(&self, factor: f64, load: &[Vector<D>], nodal: &mut [f64]) {
        for (particle, load) in load.iter().enumerate() {
            for corner in particle << D..(particle + 1) << D {
                let node = self.node[corner] as usize;
                for k in 0..D {
                    nodal[node * D + k] += factor * self.shape[corner] * load[k];
                }
            }
        }
    }
}
