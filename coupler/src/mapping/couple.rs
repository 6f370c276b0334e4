//! A point off the solid's surface turns with the facet under it, and its load comes back with the moment it has.
//!
//! The facet's small rotation is that of the rigid body nearest to its motion: omega = J^-1 sum r_a x u_a with
//! J = sum |r_a|^2 I - r_a r_a', r_a from the facet's centre. The point at the offset d follows with omega x d, and its
//! force f returns the couple m = d x f as forces (J^-1 m) x r_a, which sum to zero: the transpose, so the work is kept.

use nalgebra::{Matrix3, Vector3};

/// How one point of the fluid's side hangs on a facet.
#[derive(Debug, Clone)]
pub(super) struct Couple {
    /// The point.
    node: usize,
    /// From the facet to the point, m.
    offset: Vector3<f64>,
    /// J^-1, 1/m2.
    inverse_inertia: Matrix3<f64>,
    /// The facet's nodes and their places r_a about its centre, m.
    arms: Vec<(usize, Vector3<f64>)>,
}

impl Couple {
    /// Hangs point `node` at `offset` from its foot on the facet with these corners; `None` for a facet without extent.
    pub(super) fn new(node: usize, offset: [f64; 3], corners: &[(usize, [f64; 3])]) -> Option<Self> {
        let points = corners.iter().map(|(_, corner)| Vector3::from(*corner));
        let centre = points.sum::<Vector3<f64>>() / corners.len() as f64;
        let arms: Vec<_> =
            corners.iter().map(|(solid, corner)| (*solid, Vector3::from(*corner) - centre)).collect();
        let mut inertia = Matrix3::zeros();
        for (_, arm) in &arms {
            inertia += Matrix3::identity() * arm.norm_squared() - arm * arm.transpose();
        }
        // A segment does not resist a turn about itself; in 2-D, where segments are facets, none occurs.
        if let [(_, arm), _] = arms[..] {
            inertia += arm * arm.transpose();
        }
        let inverse_inertia = inertia.try_inverse()?;
        Some(Self { node, offset: Vector3::from(offset), inverse_inertia, arms })
    }

    /// target[node] += omega x d of the motion `source`, `[n, D]`, a function of the component.
    pub(super) fn add_motion(&self, dimension: usize, source: impl Fn(usize) -> f64, target: &mut [f64]) {
        add(target, self.node, dimension, &self.motion(dimension, source));
    }

    /// Work of the force at the point along omega x d, J.
    pub(super) fn work(&self, dimension: usize, force: &[f64], source: impl Fn(usize) -> f64) -> f64 {
        vector(|component| force[component], self.node, dimension).dot(&self.motion(dimension, source))
    }

    fn motion(&self, dimension: usize, source: impl Fn(usize) -> f64) -> Vector3<f64> {
        let turned = self.arms.iter().map(|(solid, arm)| arm.cross(&vector(&source, *solid, dimension)));
        let rotation = self.inverse_inertia * turned.sum::<Vector3<f64>>();
        rotation.cross(&self.offset)
    }

    /// Adds the couple of the force at the point to the facet's nodes.
    pub(super) fn add_load(&self, dimension: usize, source: &[f64], target: &mut [f64]) {
        let couple = self.offset.cross(&vector(|component| source[component], self.node, dimension));
        let turning = self.inverse_inertia * couple;
        for (solid, arm) in &self.arms {
            add(target, *solid, dimension, &turning.cross(arm));
        }
    }
}

fn vector(values: impl Fn(usize) -> f64, node: usize, dimension: usize) -> Vector3<f64> {
    let mut vector = Vector3::zeros();
    for axis in 0..dimension {
        vector[axis] = values(node * dimension + axis);
    }
    vector
}

fn add(values: &mut [f64], node: usize, dimension: usize, vector: &Vector3<f64>) {
    for axis in 0..dimension {
        values[node * dimension + axis] += vector[axis];
    }
}
