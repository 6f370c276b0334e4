//! The structure as the water sees it: wall particles embedded in the cells of the dummy mesh.
//!
//! Position, velocity and director of each particle are its cell's shape functions of the nodes; the load goes back to
//! the nodes by the transpose, so force, moment and work balance by construction, also at uneven pitch.

use protocol::interface::{BodyMesh, Response};

use crate::body_layout::{LayoutRules, corners, embed_particles, shape_derivatives, shape_functions};
use crate::error::SetupError;
use crate::vector::{Vector, add_scaled, normalised};
use crate::walls::Walls;

/// Motion of the interface nodes over one coupling step.
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a> {
    /// Robin: true positions x_n; otherwise positions at the start of the step, `[n, D]` m.
    pub position: &'a [f64],
    /// Robin: w* = v_n + dt a_n; otherwise the velocity over the step, `[n, D]` m/s.
    pub velocity: &'a [f64],
    /// Of prescribed motion only, `[n, D]` m/s2.
    pub acceleration: Option<&'a [f64]>,
}

/// The body's particles, `[b]`, and the interface nodes, `[n]`.
#[derive(Debug)]
pub struct Body<const D: usize> {
    /// How the motion given is meant.
    pub response: Response,
    /// Robin only: whether the wall gives way in this coupling step, or moves as given.
    pub gives_way: bool,
    /// Volume of each particle over the lattice's, -.
    pub weight: Vec<f32>,
    /// 2 rho0 / m_r of each particle, 1/m; Robin only.
    pub robin_coefficient: Vec<f32>,
    /// Wall pressure at the last coupling step on both sides, Pa; Robin only.
    pub old_pressure: Vec<[f32; 2]>,
    /// Force of the water on each particle, `[b, D]` N, of the last sub-step.
    pub load: Vec<Vector<D>>,
    /// Node positions of the current sub-step, `[n, D]` m.
    pub node_position: Vec<Vector<D>>,
    /// Node velocities of the current coupling step, `[n, D]` m/s.
    pub node_velocity: Vec<Vector<D>>,
    /// Node accelerations that shift the wall pressure, `[n, D]` m/s2.
    pub node_acceleration: Vec<Vector<D>>,
    /// Nodes each particle hangs on, `[b, 2^D]`.
    node: Vec<u32>,
    /// Shape functions, `[b, 2^D]`.
    shape: Vec<f64>,
    /// Their derivatives across the wall, `[b, 2^D]`.
    across: Vec<f64>,
    /// Constant offset of the ghost rows, m.
    offset: Vec<Vector<D>>,
    /// Speed along the director by which each particle has given way in earlier sub-steps, m/s.
    give_way: Vec<f64>,
}

impl<const D: usize> Body<D> {
    /// Embeds particles in the cells of `mesh`, at the unloaded position.
    ///
    /// # Errors
    /// [`SetupError::BodyMesh`], [`SetupError::BodyTooThin`].
    pub fn new(
        mesh: &BodyMesh,
        rules: LayoutRules<'_, D>,
        reference_density: f64,
    ) -> Result<Self, SetupError> {
        let particles = embed_particles(mesh, rules)?;
        let robin = mesh.response == Response::Robin;
        let points = mesh.reference_position.chunks_exact(D);
        let node_position: Vec<Vector<D>> = points.map(|x| std::array::from_fn(|k| x[k])).collect();
        let node_count = node_position.len();
        let count = particles.len();
        let mut body = Self {
            response: mesh.response,
            gives_way: robin,
            weight: Vec::with_capacity(count),
            robin_coefficient: Vec::new(),
            old_pressure: vec![[0.0; 2]; if robin { count } else { 0 }],
            load: vec![[0.0; D]; count],
            node_position,
            node_velocity: vec![[0.0; D]; node_count],
            node_acceleration: vec![[0.0; D]; node_count],
            node: Vec::with_capacity(count << D),
            shape: Vec::with_capacity(count << D),
            across: Vec::with_capacity(count << D),
            offset: Vec::with_capacity(count),
            give_way: vec![0.0; if robin { count } else { 0 }],
        };
        for particle in &particles {
            let shape = shape_functions(&particle.local);
            let nodes = corners::<D>(mesh, particle.cell);
            if robin {
                let inside = shape_functions(&particle.local.map(|xi| xi.clamp(-1.0, 1.0)));
                let mass: f64 = nodes.iter().zip(&inside).map(|(&a, n)| n * mesh.response_mass[a]).sum();
                // A wall without mass behind it (0: rigid) does not give way.
                let coefficient = if mass > 0.0 { 2.0 * reference_density / mass } else { 0.0 };
                body.robin_coefficient.push(coefficient as f32);
            }
            body.weight.push((particle.volume / rules.spacing.powi(D as i32)) as f32);
            body.node.extend(nodes.iter().map(|&node| node as u32));
            body.across.extend(shape_derivatives(&particle.local.map(|xi| xi.clamp(-1.0, 1.0)), 0));
            body.shape.extend(shape);
            body.offset.push(particle.offset);
        }
        Ok(body)
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.offset.len()
    }

    /// Whether the body has no particle.
    pub fn is_empty(&self) -> bool {
        self.offset.is_empty()
    }

    /// Takes the motion of a coupling step; it holds until the next one.
    pub fn set_motion(&mut self, motion: Motion<'_>) {
        let copy = |to: &mut [Vector<D>], from: &[f64]| {
            for (to, from) in to.iter_mut().zip(from.chunks_exact(D)) {
                to.copy_from_slice(from);
            }
        };
        copy(&mut self.node_position, motion.position);
        copy(&mut self.node_velocity, motion.velocity);
        if let Some(acceleration) = motion.acceleration {
            copy(&mut self.node_acceleration, acceleration);
        }
        self.give_way.fill(0.0);
    }

    /// Moves the nodes on by `dt` s of a sub-step.
    pub fn move_nodes(&mut self, dt: f64) {
        for (x, v) in self.node_position.iter_mut().zip(&self.node_velocity) {
            add_scaled(x, dt, v);
        }
    }

    /// Largest speed of a node, m/s.
    pub fn largest_speed(&self) -> f64 {
        self.node_velocity.iter().map(crate::vector::norm).fold(0.0, f64::max)
    }

    /// Writes position, velocity, acceleration and director of all particles into the wall columns.
    pub fn place(&self, walls: &mut Walls<D>) {
        let first = walls.body().start;
        for particle in 0..self.len() {
            let wall = first + particle;
            walls.position[wall] = self.embed(particle, &self.shape, &self.node_position);
            add_scaled(&mut walls.position[wall], 1.0, &self.offset[particle]);
            walls.director[wall] = normalised(&self.embed(particle, &self.across, &self.node_position));
            walls.velocity[wall] = self.embed(particle, &self.shape, &self.node_velocity);
            walls.acceleration[wall] = self.embed(particle, &self.shape, &self.node_acceleration);
            if let Some(&give_way) = self.give_way.get(particle) {
                let director = walls.director[wall];
                add_scaled(&mut walls.velocity[wall], give_way, &director);
            }
        }
    }

    fn embed(&self, particle: usize, weights: &[f64], nodal: &[Vector<D>]) -> Vector<D> {
        let mut sum = [0.0; D];
        for corner in particle << D..(particle + 1) << D {
            add_scaled(&mut sum, weights[corner], &nodal[self.node[corner] as usize]);
        }
        sum
    }

    /// After a sub-step of a Robin wall: velocity the wall has given way by, (dt/m_r)(p - p0) on each side.
    pub fn give_way(&mut self, walls: &Walls<D>, dt: f64, reference_density: f64) {
        if !self.gives_way {
            return;
        }
        let first = walls.body().start;
        for particle in 0..self.give_way.len() {
            let (new, old) = (walls.pressure[first + particle], self.old_pressure[particle]);
            let inverse_mass = f64::from(self.robin_coefficient[particle]) / (2.0 * reference_density);
            // Water on the upper side pushes against the director.
            let push = f64::from(new[0] - old[0]) - f64::from(new[1] - old[1]);
            self.give_way[particle] += dt * inverse_mass * push;
        }
    }

    /// Keeps the wall pressure at the end of a coupling step for the next one.
    pub fn remember_pressure(&mut self, walls: &Walls<D>) {
        self.old_pressure.copy_from_slice(&walls.pressure[walls.body()]);
    }

    /// nodal += factor times the transpose of the embedding applied to `load`, `[n D]` N.
    pub fn add_nodal_load(&self, factor: f64, nodal: &mut [f64]) {
        for particle in 0..self.len() {
            for corner in particle << D..(particle + 1) << D {
                let node = self.node[corner] as usize;
                for k in 0..D {
                    nodal[node * D + k] += factor * self.shape[corner] * self.load[particle][k];
                }
            }
        }
    }
}
