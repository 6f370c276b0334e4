//! Points off the solid's surface turn with the facet under them, and their load comes back with the moment it has.
//!
//! A facet turns by the rotation R nearest to its motion (Kabsch 1976, Acta Cryst. A 32, 922): with R_a and r_a the places of
//! its corners about their centre, in the unloaded body and now, and q_a = R R_a, it is the one with sum q_a x r_a = 0. Its
//! rate is omega = J^-1 sum q_a x v_a with J = sum (q_a . r_a) I - q_a r_a', symmetric for that R. A point at the offset D of
//! the unloaded body stands at d = R D and moves with omega x d; its force f returns the couple m = d x f as forces
//! (J^-1 m) x q_a, which sum to zero and have the moment m about the centre. That is the transpose, so force, moment and
//! work are kept in the present place, however far the facet has turned.

use nalgebra::{Matrix3, Rotation3, Vector3};

/// A facet's corner: node and place.
pub(super) type Corner = (usize, [f64; 3]);

/// The points that hang on one facet.
#[derive(Debug, Clone)]
pub(super) struct Couple {
    /// The facet's nodes.
    nodes: Vec<usize>,
    /// R_a, m.
    arms: Vec<Vector3<f64>>,
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
    /// Hangs points, each at an offset from its foot, on the facet with these corners; `None` for a facet without extent.
    pub(super) fn new(corners: &[Corner], points: &[(usize, [f64; 3])]) -> Option<Self> {
        let arms = about_centre(corners.iter().map(|corner| Vector3::from(corner.1)).collect());
        let hang = |&(point, offset): &(usize, [f64; 3])| {
            let offset = Vector3::from(offset);
            Hanging { point, reference: offset, offset }
        };
        let inverse_inertia = inertia(&arms, &arms).try_inverse()?;
        let nodes = corners.iter().map(|corner| corner.0).collect();
        let points = points.iter().map(hang).collect();
        Some(Self { nodes, turned: arms.clone(), arms, inverse_inertia, points })
    }

    /// Turns with the facet to where the solid's nodes are now, `[n, D]` m. A facet that has lost its extent stays as it was.
    pub(super) fn turn(&mut self, dimension: usize, position: &[f64]) {
        let corner = |&node: &usize| vector(|component| position[component], node, dimension);
        let present = about_centre(self.nodes.iter().map(corner).collect());
        let Some((rotation, inverse_inertia)) = nearest_rotation(&self.arms, &present) else { return };
        self.inverse_inertia = inverse_inertia;
        self.turned.iter_mut().zip(&self.arms).for_each(|(turned, arm)| *turned = rotation * arm);
        self.points.iter_mut().for_each(|point| point.offset = rotation * point.reference);
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

/// R from the places of the corners about their centre, and J^-1; `None` without extent.
fn nearest_rotation(
    reference: &[Vector3<f64>],
    present: &[Vector3<f64>],
) -> Option<(Rotation3<f64>, Matrix3<f64>)> {
    let frames = frame(present)? * frame(reference)?.transpose();
    let mut rotation = Rotation3::from_matrix_unchecked(frames);
    let size = |places: &[Vector3<f64>]| places.iter().map(Vector3::norm_squared).sum::<f64>();
    let round_off = f64::EPSILON * (size(reference) * size(present)).sqrt();
    let mut turned: [Vector3<f64>; 4] = [Vector3::zeros(); 4];
    let turned = &mut turned[..reference.len()];
    for _ in 0..MOST_STEPS {
        turned.iter_mut().zip(reference).for_each(|(turned, arm)| *turned = rotation * arm);
        let inverse = inertia(turned, present).try_inverse()?;
        let left: Vector3<f64> = turned.iter().zip(present).map(|(q, r)| q.cross(r)).sum();
        if left.norm() <= round_off {
            return Some((rotation, inverse));
        }
        rotation = Rotation3::from_scaled_axis(inverse * left) * rotation;
    }
    let inverse = inertia(turned, present).try_inverse()?;
    Some((rotation, inverse))
}

/// An orthonormal frame fixed to the corners: the first axis towards one of them, the third across the facet (in 2-D along z).
fn frame(places: &[Vector3<f64>]) -> Option<Matrix3<f64>> {
    let across = match places {
        [_, _] => Vector3::z(),
        [a, b, c] => (b - a).cross(&(c - a)).try_normalize(0.0)?,
        [a, b, c, d] => (c - a).cross(&(d - b)).try_normalize(0.0)?,
        _ => return None,
    };
    let first = (places[0] - across * across.dot(&places[0])).try_normalize(0.0)?;
    Some(Matrix3::from_columns(&[first, across.cross(&first), across]))
}

/// J. A segment does not resist a turn about itself; in 2-D, where segments are facets, none occurs.
fn inertia(turned: &[Vector3<f64>], present: &[Vector3<f64>]) -> Matrix3<f64> {
    let mut inertia = Matrix3::zeros();
    for (q, r) in turned.iter().zip(present) {
        inertia += Matrix3::from_diagonal_element(q.dot(r));
        if turned.len() > 2 {
            inertia -= 0.5 * (q * r.transpose() + r * q.transpose());
        }
    }
    inertia
}

fn about_centre(mut places: Vec<Vector3<f64>>) -> Vec<Vector3<f64>> {
    let centre = places.iter().sum::<Vector3<f64>>() / places.len() as f64;
    places.iter_mut().for_each(|place| *place -= centre);
    places
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

    fn facet() -> Vec<Vector3<f64>> {
        let corners = [[0.0, 0.0, 0.0], [2.0, 0.1, 0.3], [2.2, 3.0, 0.0], [-0.4, 2.5, 0.5]];
        about_centre(corners.map(Vector3::from).to_vec())
    }

    #[test]
    fn a_facet_that_turns_as_a_whole_turns_by_that() {
        let turn = Rotation3::from_scaled_axis(Vector3::new(1.0, -2.0, 0.7));
        let present: Vec<_> = facet().iter().map(|arm| turn * arm).collect();
        let (found, _) = nearest_rotation(&facet(), &present).unwrap();
        assert!((found.matrix() - turn.matrix()).norm() < 1e-14);
    }

    #[test]
    fn no_rotation_is_nearer_than_the_one_found() {
        // The same, stretched, sheared and warped.
        let strain = Matrix3::new(1.3, 0.2, 0.0, -0.1, 0.8, 0.1, 0.3, 0.0, 1.0);
        let present: Vec<_> = facet().iter().map(|arm| strain * arm).collect();
        let (found, _) = nearest_rotation(&facet(), &present).unwrap();
        let alike = |rotation: Rotation3<f64>| -> f64 {
            facet().iter().zip(&present).map(|(arm, now)| (rotation * arm).dot(now)).sum()
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
