//! What holds the body: components of nodes that are fixed or move as told.

use crate::error::SceneError;
use crate::facet::cross;
use crate::mesh::{Mesh, NamedFace};
use crate::scene::Scene;
use crate::state::State;
use protocol::case::Prescribed;

/// A named face (or set of nodes) held along some axes, at rest or with a prescribed motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Support {
    /// The face.
    pub face: String,
    /// Whether it is held along x, y, z.
    pub axes: [bool; 3],
    /// Its motion there.
    pub motion: Prescribed,
}

/// The supports of a mesh.
#[derive(Debug, Clone, Default)]
pub(crate) struct Supports {
    /// `[n, D]`.
    pub(crate) fixed: Vec<bool>,
    /// Component and motion of every component that moves as told.
    moving: Vec<(usize, usize)>,
    motions: Vec<Prescribed>,
    dimension: usize,
}

impl Supports {
    pub(crate) fn new(scene: &Scene, mesh: &Mesh) -> Result<Self, SceneError> {
        let d = mesh.dimension;
        let mut supports =
            Self { fixed: vec![false; mesh.node_count() * d], dimension: d, ..Self::default() };
        for face in &scene.clamped {
            supports.hold(find(mesh, face)?, [true; 3], None);
        }
        for name in &scene.rollers {
            let face = find(mesh, name)?;
            let axis = normal_axis(mesh, face).ok_or_else(|| {
                SceneError::Face(name.clone(), "a roller must be a plane face along the axes of space")
            })?;
            supports.hold(face, std::array::from_fn(|i| i == axis), None);
        }
        for support in &scene.supports {
            let motion = (support.motion != Prescribed::Fixed).then_some(&support.motion);
            supports.hold(find(mesh, &support.face)?, support.axes, motion);
        }
        Ok(supports)
    }

    fn hold(&mut self, face: &NamedFace, axes: [bool; 3], motion: Option<&Prescribed>) {
        let d = self.dimension;
        if let Some(motion) = motion {
            self.motions.push(motion.clone());
        }
        for &node in &face.nodes {
            for axis in (0..d).filter(|&axis| axes[axis]) {
                let component = node * d + axis;
                // What holds first counts: a node of two faces keeps the support named first.
                if motion.is_some() && !self.fixed[component] {
                    self.moving.push((component, self.motions.len() - 1));
                }
                self.fixed[component] = true;
            }
        }
    }

    /// Whether a face moves as told.
    pub(crate) fn are_moving(&self) -> bool {
        !self.moving.is_empty()
    }

    /// Puts the components that move as told where they are at the state's time.
    pub(crate) fn move_to(&self, state: &mut State) {
        for &(component, motion) in &self.moving {
            let motion = &self.motions[motion];
            let [displacement, velocity, acceleration] = motion.at(component % self.dimension, state.time);
            state.displacement[component] = displacement;
            state.velocity[component] = velocity;
            state.acceleration[component] = acceleration;
        }
    }

    /// The rigid motion the supports leave to the body, if any: the motions that vanish at all fixed components.
    pub(crate) fn free_motion(&self, mesh: &Mesh) -> Option<&'static str> {
        let d = self.dimension;
        let (low, high) = mesh.bounding_box();
        let size = (0..d).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
        let count = if d == 2 { 3 } else { 6 };
        let mut normal = nalgebra::DMatrix::<f64>::zeros(count, count);
        for component in (0..self.fixed.len()).filter(|&component| self.fixed[component]) {
            let (node, axis) = (component / d, component % d);
            let mut x = [0.0; 3];
            for i in 0..d {
                x[i] = (mesh.reference_position[node * d + i] - 0.5 * (low[i] + high[i])) / size;
            }
            let row = nalgebra::DVector::from_fn(count, |mode, _| rigid(mode, d, &x)[axis]);
            normal += &row * row.transpose();
        }
        let eigen = nalgebra::SymmetricEigen::new(normal);
        let (least, value) = eigen.eigenvalues.argmin();
        let held = eigen.eigenvalues.max();
        if value > 1e-9 * held && held > 0.0 {
            return None;
        }
        let motion = eigen.eigenvectors.column(least);
        Some(if motion.rows(0, d).norm() > 0.5 { "move" } else { "turn" })
    }
}

/// Displacement of a rigid mode: along an axis, then about one.
fn rigid(mode: usize, dimension: usize, x: &[f64; 3]) -> [f64; 3] {
    let about = if dimension == 2 { 2 } else { mode.saturating_sub(3) };
    let mut axis = [0.0; 3];
    if mode < dimension {
        axis[mode] = 1.0;
        return axis;
    }
    axis[about] = 1.0;
    cross(axis, *x)
}

fn find<'m>(mesh: &'m Mesh, name: &str) -> Result<&'m NamedFace, SceneError> {
    mesh.face(name).ok_or_else(|| SceneError::Face(name.to_owned(), "the body has no face of this name"))
}

/// The axis normal to all nodes of a plane face.
fn normal_axis(mesh: &Mesh, face: &NamedFace) -> Option<usize> {
    let d = mesh.dimension;
    let spread = |axis: usize| {
        let along = face.nodes.iter().map(|&node| mesh.reference_position[node * d + axis]);
        let (low, high) =
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        high - low
    };
    let (least, greatest) =
        (0..d).map(spread).fold((f64::INFINITY, 0.0f64), |(a, b), s| (a.min(s), b.max(s)));
    (0..d).find(|&axis| spread(axis) <= least && least <= 1e-6 * greatest)
}
