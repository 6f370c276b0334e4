//! Obstacles: rigid boxes or closed surfaces in the water's way, at rest or with a motion known beforehand.
//!
//! They are wall particles like the tank's, in their own range of the wall columns, without a process of their own: a
//! piston, a wave maker, a pier, a bed read from a file. Elastic bodies and their loads are `[solid]`'s.

use protocol::case::Prescribed;

use crate::lattice::SHELL_LAYERS;
use crate::surface::Surface;
use crate::vector::{Vector, add_scaled, norm, sub};
use crate::walls::Walls;

/// Thinner than this many spacings, water on one side comes within reach of the other: the two are told apart.
const THIN: f64 = 2.0 * SHELL_LAYERS as f64;

/// What an obstacle fills.
#[derive(Debug, Clone, PartialEq)]
pub enum Outline<const D: usize> {
    /// An axis-aligned box.
    Box {
        /// Lower corner, m.
        min: Vector<D>,
        /// Upper corner, m.
        max: Vector<D>,
    },
    /// The inside of a closed surface of triangles (3-D).
    Surface(Surface),
}

/// One obstacle.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle<const D: usize> {
    /// Its place at time 0 without its motion.
    pub outline: Outline<D>,
    /// Its motion; `None`: at rest.
    pub motion: Option<Prescribed>,
}

/// One wall particle of an obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObstacleParticle<const D: usize> {
    /// x without the motion, m.
    pub position: Vector<D>,
    /// Volume over that of a water particle, -.
    pub weight: f32,
    /// 1 along the axes whose velocity it mirrors, else 0.
    pub facing: Vector<D>,
    /// Unit vector across a thin obstacle, whose two sides have a pressure each; zero for a thick one.
    pub director: Vector<D>,
}

impl<const D: usize> Obstacle<D> {
    /// Displacement at time 0, m.
    pub fn start(&self) -> Vector<D> {
        std::array::from_fn(|k| self.motion.as_ref().map_or(0.0, |motion| motion.at(k, 0.0)[0]))
    }

    /// Whether a point lies inside at time 0.
    pub fn contains(&self, x: &Vector<D>) -> bool {
        self.outline.contains(&sub(x, &self.start()))
    }
}

impl<const D: usize> Outline<D> {
    /// The box around it.
    pub fn bounds(&self) -> (Vector<D>, Vector<D>) {
        match self {
            Self::Box { min, max } => (*min, *max),
            Self::Surface(surface) => surface.bounds(),
        }
    }

    /// Whether a point lies inside.
    pub fn contains(&self, x: &Vector<D>) -> bool {
        let (min, max) = self.bounds();
        (0..D).all(|k| min[k] < x[k] && x[k] < max[k])
            && match self {
                Self::Box { .. } => true,
                Self::Surface(surface) => surface.contains(x),
            }
    }

    /// Its volume, m^D.
    pub fn volume(&self) -> f64 {
        match self {
            Self::Box { min, max } => (0..D).map(|k| max[k] - min[k]).product(),
            Self::Surface(surface) => surface.volume(),
        }
    }

    /// Its wall particles: a shell of three layers, the first half a pitch inside the faces.
    pub fn fill(&self, spacing: f64) -> Vec<ObstacleParticle<D>> {
        match self {
            Self::Box { min, max } => fill_box((min, max), spacing),
            Self::Surface(surface) => surface.fill(spacing),
        }
    }
}

/// Particles of a box; its pitch along each axis is the edge over a whole number, their volume goes with it.
fn fill_box<const D: usize>((min, max): (&Vector<D>, &Vector<D>), spacing: f64) -> Vec<ObstacleParticle<D>> {
    let count: [usize; D] = std::array::from_fn(|k| ((max[k] - min[k]) / spacing).round().max(1.0) as usize);
    let pitch: Vector<D> = std::array::from_fn(|k| (max[k] - min[k]) / count[k] as f64);
    let weight = (0..D).map(|k| pitch[k] / spacing).product::<f64>() as f32;
    let across = (0..D).min_by_key(|&k| count[k]).unwrap_or(0);
    let mut director = [0.0; D];
    if (max[across] - min[across]) < THIN * spacing {
        director[across] = 1.0;
    }
    let mut particles = Vec::new();
    for number in 0..count.iter().product() {
        let mut rest: usize = number;
        let at: [usize; D] = std::array::from_fn(|k| {
            let digit = rest % count[k];
            rest /= count[k];
            digit
        });
        let near_face = |k: usize| at[k] < SHELL_LAYERS || at[k] + SHELL_LAYERS >= count[k];
        if (0..D).any(near_face) {
            particles.push(ObstacleParticle {
                position: std::array::from_fn(|k| min[k] + (at[k] as f64 + 0.5) * pitch[k]),
                weight,
                facing: std::array::from_fn(|k| if near_face(k) { 1.0 } else { 0.0 }),
                director,
            });
        }
    }
    particles
}

/// The obstacles of a scene that has some, with their range in the wall columns.
#[derive(Debug)]
pub struct Obstacles<const D: usize> {
    particles: Vec<ObstacleParticle<D>>,
    /// Motion and end of each obstacle's particles.
    parts: Vec<(Option<Prescribed>, usize)>,
    /// Force of the water on each particle, `[o, D]` N, of the last sub-step; empty if all are at rest.
    pub load: Vec<Vector<D>>,
}

impl<const D: usize> Obstacles<D> {
    /// Fills all obstacles; `None` if there are none.
    pub fn new(obstacles: &[Obstacle<D>], spacing: f64) -> Option<Self> {
        let (mut particles, mut parts) = (Vec::new(), Vec::new());
        for obstacle in obstacles {
            particles.extend(obstacle.outline.fill(spacing));
            parts.push((obstacle.motion.clone(), particles.len()));
        }
        let moving = parts.iter().any(|part| part.0.is_some());
        let load = vec![[0.0; D]; if moving { particles.len() } else { 0 }];
        (!parts.is_empty()).then_some(Self { particles, parts, load })
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.particles.len()
    }

    /// Whether no obstacle holds a particle.
    pub fn is_empty(&self) -> bool {
        self.particles.is_empty()
    }

    /// Whether any moves.
    pub fn is_moving(&self) -> bool {
        !self.load.is_empty()
    }

    /// Writes the columns of a sub-step from `time` s over `dt` s: the place at its start, the mean velocity over it
    /// (so that no place drifts from the motion given), the acceleration at its end.
    pub fn place(&self, walls: &mut Walls<D>, time: f64, dt: f64) {
        let first = walls.obstacles().start;
        let mut begin = 0;
        for (motion, end) in &self.parts {
            let at =
                |axis: usize, time: f64| motion.as_ref().map_or([0.0; 3], |motion| motion.at(axis, time));
            let (now, then): ([_; D], [_; D]) =
                (std::array::from_fn(|k| at(k, time)), std::array::from_fn(|k| at(k, time + dt)));
            let mean = |k: usize| if dt > 0.0 { (then[k][0] - now[k][0]) / dt } else { now[k][1] };
            for (particle, wall) in self.particles[begin..*end].iter().zip(first + begin..) {
                walls.position[wall] = particle.position;
                add_scaled(&mut walls.position[wall], 1.0, &std::array::from_fn(|k| now[k][0]));
                walls.velocity[wall] = std::array::from_fn(mean);
                walls.acceleration[wall] = std::array::from_fn(|k| then[k][2]);
            }
            begin = *end;
        }
    }

    /// Writes what does not change: volumes, directions.
    pub fn enter(&self, walls: &mut Walls<D>) {
        let first = walls.obstacles().start;
        for (particle, wall) in self.particles.iter().zip(first..) {
            walls.weight[wall] = particle.weight;
            walls.facing[wall] = particle.facing;
            walls.director[wall] = particle.director;
        }
    }

    /// Speed and acceleration of the fastest at a time, m/s and m/s2.
    pub fn speed_and_acceleration(&self, time: f64) -> (f64, f64) {
        let size = |motion: &Prescribed, order: usize| {
            norm::<D>(&std::array::from_fn(|axis| motion.at(axis, time)[order]))
        };
        let motions = self.parts.iter().flat_map(|part| &part.0);
        motions.fold((0.0, 0.0), |most: (f64, f64), m| (most.0.max(size(m, 1)), most.1.max(size(m, 2))))
    }

    /// Largest speed of any of them at any time, m/s.
    pub fn largest_speed(&self) -> f64 {
        self.parts.iter().flat_map(|part| &part.0).map(Prescribed::largest_speed).fold(0.0, f64::max)
    }
}
