//! Points off the solid's surface turn with the patch of it under them, and their load comes back with the moment it has.
//!
//! A patch is a facet and, where the points are off by more than a part of its length, nodes around it: a rotation taken from
//! a short arm would carry the noise of the nodes to the points enlarged. It turns by the rotation R nearest to its motion
//! (Kabsch 1976, Acta Cryst. A 32, 922): with R_a and r_a the places of its nodes about their centre, in the unloaded body
//! and now, and q_a = R R_a, it is the one with sum q_a x r_a = 0. Its rate is
//! omega = J^-1 sum q_a x v_a with J = sum (q_a . r_a) I - q_a r_a', symmetric for that R. A point at the offset D of the
//! unloaded body stands at d = R D and moves with omega x d; its force f returns the couple m = d x f as forces
//! (J^-1 m) x q_a, which sum to zero and have the moment m about the centre. That is the transpose, so force, moment and
//! work are kept in the present place, however far the patch has turned.

use nalgebra::{Matrix3, Rotation3, Vector3};

/// A node and its place in the unloaded body, m.
pub(super) type Place = (usize, [f64; 3]);

/// The points that hang on one patch.
#[derive(Debug, Clone)]
pub(super) struct Couple {
    /// The corners of the facet, then the other nodes of the patch.
    nodes: Vec<usize>,
    /// Number of corners.
    corners: usize,
    /// R_a, m.
    arms: Vec<Vector3<f64>>,
    /// r_a, m.
    present: Vec<Vector3<f64>>,
    /// q_a, m.
    turned: Vec<Vector3<f64>>,
    /// J^-1, 1/m2.
    inverse_inertia: Matrix3<f64>,
    points: Vec<Hanging>,
}

/// One point of the fluid's side.
#[derive(Debug, Clone)]
struct Hanging {
    point: usize,
    /// D, m.
    reference: Vector3<f64>,
    /// d, m.
    offset: Vector3<f64>,
}

/// Newton steps to the nearest rotation; three are enough from the facet's own frame.
const MOST_STEPS: usize = 20;

impl Couple {
    /// Hangs points, each at an offset from the mean it follows, on a patch: the corners of a facet, and then the other
    /// nodes of it; `None` for one without extent.
    pub(super) fn new(
        dimension: usize,
        (corners, patch): (usize, &[Place]),
        points: &[(usize, [f64; 3])],
    ) -> Option<Self> {
        let mut arms: Vec<_> = patch.iter().map(|place| Vector3::from(place.1)).collect();
        about_centre(&mut arms);
        let hang = |&(point, offset): &(usize, [f64; 3])| {
            let offset = Vector3::from(offset);
            Hanging { point, reference: offset, offset }
        };
        Some(Self {
            nodes: patch.iter().map(|place| place.0).collect(),
            corners,
            inverse_inertia: inertia(dimension, &arms, &arms).try_inverse()?,
            present: arms.clone(),
            turned: arms.clone(),
            arms,
            points: points.iter().map(hang).collect(),
        })
    }

    /// Turns with the patch to where the solid's nodes are now, `[n, D]` m. One that has lost its extent stays as it was.
    pub(super) fn turn(&mut self, dimension: usize, position: &[f64]) {
        for (place, &node) in self.present.iter_mut().zip(&self.nodes) {
            *place = vector(|component| position[component], node, dimension);
        }
        about_centre(&mut self.present);
        let Some(rotation) = self.find_rotation(dimension) else { return };
        self.points.iter_mut().for_each(|point| point.offset = rotation * point.reference);
    }

    /// R, and with it q_a and J^-1; `None` without extent.
    fn find_rotation(&mut self, dimension: usize) -> Option<Rotation3<f64>> {
        let Self { corners, arms, present, turned, inverse_inertia, .. } = self;
        let frames = frame(&present[..*corners])? * frame(&arms[..*corners])?.transpose();
        let mut rotation = Rotation3::from_matrix_unchecked(frames);
        let size = |places: &[Vector3<f64>]| places.iter().map(Vector3::norm_squared).sum::<f64>();
        let round_off = 4.0 * f64::EPSILON * (size(arms) * size(present)).sqrt();
        for step in 0.. {
            turned.iter_mut().zip(&*arms).for_each(|(turned, arm)| *turned = rotation * arm);
            *inverse_inertia = inertia(dimension, turned, present).try_inverse()?;
            let left: Vector3<f64> = turned.iter().zip(&*present).map(|(q, r)| q.cross(r)).sum();
            if left.norm() <= round_off || step == MOST_STEPS {
                break;
            }
            rotation = Rotation3::from_scaled_axis(*inverse_inertia * left) * rotation;
        }
        Some(rotation)
    }

    /// target[point] += d - D.
    pub(super) fn add_turn(&self, dimension: usize, target: &mut [f64]) {
        for point in &self.points {
            add(target, point.point, dimension, &(point.offset - point.reference));
        }
    }

    /// target[point] += omega x d of the motion `source`, `[n, D]`, a function of the component.
    pub(super) fn add_motion(&self, dimension: usize, source: impl Fn(usize) -> f64, target: &mut [f64]) {
        let rotation = self.rotation(dimension, source);
        for point in &self.points {
            add(target, point.point, dimension, &rotation.cross(&point.offset));
        }
    }

    /// Work of the forces at the points along omega x d, J.
    pub(super) fn work(&self, dimension: usize, force: &[f64], source: impl Fn(usize) -> f64) -> f64 {
        self.rotation(dimension, source).dot(&self.moment(dimension, force))
    }

    /// Adds the couple of the forces at the points to the facet's nodes.
    pub(super) fn add_load(&self, dimension: usize, force: &[f64], target: &mut [f64]) {
        let turning = self.inverse_inertia * self.moment(dimension, force);
        for (&node, arm) in self.nodes.iter().zip(&self.turned) {
            add(target, node, dimension, &turning.cross(arm));
        }
    }

    /// omega.
    fn rotation(&self, dimension: usize, source: impl Fn(usize) -> f64) -> Vector3<f64> {
        let corners = self.nodes.iter().zip(&self.turned);
        let turned = corners.map(|(&node, arm)| arm.cross(&vector(&source, node, dimension)));
        self.inverse_inertia * turned.sum::<Vector3<f64>>()
    }

    /// Sum of d x f.
    fn moment(&self, dimension: usize, force: &[f64]) -> Vector3<f64> {
        let force = |point: usize| vector(|component| force[component], point, dimension);
        self.points.iter().map(|point| point.offset.cross(&force(point.point))).sum()
    }
}

/// An orthonormal frame fixed to the corners of a facet: the first axis along its first edge, the third across it (in 2-D along z).
fn frame(corners: &[Vector3<f64>]) -> Option<Matrix3<f64>> {
    let edge = corners[1] - corners[0];
    let across = match corners {
        [_, _] => Vector3::z(),
        [a, _, c] => edge.cross(&(c - a)).try_normalize(0.0)?,
        [a, b, c, d] => (c - a).cross(&(d - b)).try_normalize(0.0)?,
        _ => return None,
    };
    let first = (edge - across * across.dot(&edge)).try_normalize(0.0)?;
    Some(Matrix3::from_columns(&[first, across.cross(&first), across]))
}

/// J. In 2-D nothing turns but about z, and what does not resist a turn about the line it lies on need not.
fn inertia(dimension: usize, turned: &[Vector3<f64>], present: &[Vector3<f64>]) -> Matrix3<f64> {
    let mut inertia = Matrix3::zeros();
    for (q, r) in turned.iter().zip(present) {
        inertia += Matrix3::from_diagonal_element(q.dot(r));
        if dimension > 2 {
            inertia -= 0.5 * (q * r.transpose() + r * q.transpose());
        }
    }
    inertia
}

fn about_centre(places: &mut [Vector3<f64>]) {
    let centre = places.iter().sum::<Vector3<f64>>() / places.len() as f64;
    places.iter_mut().for_each(|place| *place -= centre);
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

#[cfg(test)]
mod tests {
    use super::*;

    fn couple() -> Couple {
        let corners = [[0.0, 0.0, 0.0], [2.0, 0.1, 0.3], [2.2, 3.0, 0.0], [-0.4, 2.5, 0.5], [3.0, -1.0, 0.1]];
        let patch: Vec<Place> = corners.into_iter().enumerate().collect();
        Couple::new(3, (4, &patch), &[(0, [0.0, 0.0, 1.0])]).unwrap()
    }

    /// R where the patch is moved by a matrix.
    fn found(moved: Matrix3<f64>) -> (Rotation3<f64>, Couple) {
        let mut couple = couple();
        couple.present = couple.arms.iter().map(|arm| moved * arm).collect();
        (couple.find_rotation(3).unwrap(), couple)
    }

    #[test]
    fn a_patch_that_turns_as_a_whole_turns_by_that() {
        let turn = Rotation3::from_scaled_axis(Vector3::new(1.0, -2.0, 0.7));
        let (found, _) = found(turn.into_inner());
        assert!((found.matrix() - turn.matrix()).norm() < 1e-14);
    }

    #[test]
    fn no_rotation_is_nearer_than_the_one_found() {
        // Stretched, sheared and warped.
        let (found, couple) = found(Matrix3::new(1.3, 0.2, 0.0, -0.1, 0.8, 0.1, 0.3, 0.0, 1.0));
        let alike = |rotation: Rotation3<f64>| -> f64 {
            couple.arms.iter().zip(&couple.present).map(|(arm, now)| (rotation * arm).dot(now)).sum()
        };
        for axis in 0..3 {
            for angle in [-1e-3, 1e-3] {
                let mut other = Vector3::zeros();
                other[axis] = angle;
                assert!(alike(Rotation3::from_scaled_axis(other) * found) < alike(found));
            }
        }
    }
}
