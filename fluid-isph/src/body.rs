//! The structure as the water sees it: wall particles that go along with the interface.

use protocol::interface::{BodyMesh, PointWall, Response};

use crate::body_layout::{LayoutRules, embed_particles};
use crate::columns::Columns;
use crate::embedding::Embedding;
use crate::error::SetupError;
use crate::nodes::{Motion, Nodes};
use crate::offer::Offer;
use crate::vector::{Vector, add_scaled};
use crate::walls::Walls;

/// The structure as the fluid is told of it.
#[derive(Debug, Clone)]
pub enum Structure<const D: usize> {
    /// A dummy mesh, whose cells the particles are embedded in.
    Mesh(BodyMesh),
    /// The wall behind the fluid's own points.
    Points(Offer<D>, PointWall),
}

/// What the particles hang on.
#[derive(Debug)]
enum Hold<const D: usize> {
    Cells(Embedding<D>),
    Points(Columns),
}

/// The body's particles, `[b]`, and the interface nodes or points, `[n]`.
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
    /// Interface nodes, or points.
    pub nodes: Nodes<D>,
    hold: Hold<D>,
    /// Speed along the director by which each particle has given way in earlier sub-steps, m/s.
    give_way: Vec<f64>,
}

impl<const D: usize> Body<D> {
    /// Lays out the particles at the unloaded position.
    ///
    /// # Errors
    /// [`SetupError::BodyMesh`], [`SetupError::BodyTooThin`].
    pub fn new(
        structure: &Structure<D>,
        rules: LayoutRules<'_, D>,
        reference_density: f64,
    ) -> Result<Self, SetupError> {
        let weight = |volume: f64| (volume / rules.spacing.powi(D as i32)) as f32;
        let body = match structure {
            Structure::Mesh(mesh) => {
                let particles = embed_particles(mesh, rules)?;
                let weights = particles.iter().map(|particle| weight(particle.volume)).collect();
                let nodes = Nodes::of_mesh(mesh.reference_position.as_chunks().0.to_vec());
                let hold = Hold::Cells(Embedding::new(mesh, &particles));
                let masses = particles.iter().map(|particle| particle.response_mass(mesh));
                Self::at_rest((nodes, hold), weights, mesh.response).held_by(masses, reference_density)
            }
            Structure::Points(offer, wall) => {
                let weights = offer.volume.iter().map(|&volume| weight(volume)).collect();
                let nodes = Nodes::without_mesh(offer.position.clone());
                let hold = Hold::Points(Columns::new(offer));
                let masses = wall.response_mass[..offer.particle_count()].iter().copied();
                Self::at_rest((nodes, hold), weights, wall.response).held_by(masses, reference_density)
            }
        };
        Ok(body)
    }

    fn at_rest((nodes, hold): (Nodes<D>, Hold<D>), weight: Vec<f32>, response: Response) -> Self {
        let (count, robin) = (weight.len(), response == Response::Robin);
        Self {
            response,
            gives_way: robin,
            weight,
            robin_coefficient: Vec::new(),
            old_pressure: vec![[0.0; 2]; if robin { count } else { 0 }],
            load: vec![[0.0; D]; count],
            nodes,
            hold,
            give_way: vec![0.0; if robin { count } else { 0 }],
        }
    }

    /// Takes m_r of each particle, kg/m2; Robin only.
    fn held_by(mut self, masses: impl Iterator<Item = f64>, reference_density: f64) -> Self {
        if self.response == Response::Robin {
            // A wall without mass behind it (0: rigid) does not give way.
            let coefficient = |mass| if mass > 0.0 { (2.0 * reference_density / mass) as f32 } else { 0.0 };
            self.robin_coefficient = masses.map(coefficient).collect();
        }
        self
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.load.len()
    }

    /// Whether the body has no particle.
    pub fn is_empty(&self) -> bool {
        self.load.is_empty()
    }

    /// Takes the motion of a coupling step; it holds until the next one.
    pub fn set_motion(&mut self, motion: Motion<'_>) {
        self.nodes.take(motion);
        self.give_way.fill(0.0);
    }

    /// Largest speed of a node or point, m/s.
    pub fn largest_speed(&self) -> f64 {
        self.nodes.largest_speed()
    }

    /// Writes position, velocity, acceleration and director of all particles into the wall columns.
    pub fn place(&self, walls: &mut Walls<D>) {
        match &self.hold {
            Hold::Cells(embedding) => embedding.place(&self.nodes, walls),
            Hold::Points(columns) => columns.place(&self.nodes, walls),
        }
        let first = walls.body().start;
        for (wall, &give_way) in (first..).zip(&self.give_way) {
            add_scaled(&mut walls.velocity[wall], give_way, &walls.director[wall]);
        }
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

    /// Adds `factor` times the load at the nodes or points, `[n D]` N: in a mesh by the transpose of the embedding.
    pub fn add_nodal_load(&self, factor: f64, nodal: &mut [f64]) {
        match &self.hold {
            Hold::Cells(embedding) => embedding.add_nodal_load(factor, &self.load, nodal),
            Hold::Points(columns) => columns.add_load(factor, &self.load, nodal),
        }
    }
}
