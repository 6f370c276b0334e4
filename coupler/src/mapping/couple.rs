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
    arms: Arms,
    /// q_a, m.
    turned: Arms,
    /// J^-1, 1/m2.
    inverse_inertia: Matrix3<f64>,
    points: Vec<Hanging>,
}

/// Of the corners of a facet, zero where it has less than four.
type Arms = [Vector3<f64>; 4];

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
        let arms = about_centre(corners.len(), |corner| Vector3::from(corners[corner].1));
        let hang = |&(point, offset): &(usize, [f64; 3])| {
            let offset = Vector3::from(offset);
            Hanging { point, reference: offset, offset }
        };
        let inverse_inertia = inertia(corners.len(), &arms, &arms).try_inverse()?;
        let nodes = corners.iter().map(|corner| corner.0).collect();
        let points = points.iter().map(hang).collect();
        Some(Self { nodes, turned: arms, arms, inverse_inertia, points })
    }

    /// Turns with the facet to where the solid's nodes are now, `[n, D]` m. A facet that has lost its extent stays as it was.
    pub(super) fn turn(&mut self, dimension: usize, position: &[f64]) {
        let Self { nodes, arms, turned, inverse_inertia, points } = self;
        let corner = |corner: usize| vector(|component| position[component], nodes[corner], dimension);
        let present = about_centre(nodes.len(), corner);
        let Some(nearest) = nearest_rotation(nodes.len(), arms, &present) else { return };
        *inverse_inertia = nearest.inverse_inertia;
        *turned = nearest.turned;
        points.iter_mut().for_each(|point| point.offset = nearest.rotation * point.reference);
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

/// R, and what follows from it.
struct Nearest {
    rotation: Rotation3<f64>,
    turned: Arms,
    inverse_inertia: Matrix3<f64>,
}

/// R from the places of the corners about their centre; `None` without extent.
fn nearest_rotation(corners: usize, reference: &Arms, present: &Arms) -> Option<Nearest> {
    let frames = frame(corners, present)? * frame(corners, reference)?.transpose();
    let mut rotation = Rotation3::from_matrix_unchecked(frames);
    let size = |places: &Arms| places.iter().map(Vector3::norm_squared).sum::<f64>();
    let round_off = 4.0 * f64::EPSILON * (size(reference) * size(present)).sqrt();
    for step in 0.. {
        let turned = reference.map(|arm| rotation * arm);
        let inverse_inertia = inertia(corners, &turned, present).try_inverse()?;
        let left: Vector3<f64> = turned.iter().zip(present).map(|(q, r)| q.cross(r)).sum();
        if left.norm() <= round_off || step == MOST_STEPS {
            return Some(Nearest { rotation, turned, inverse_inertia });
        }
        rotation = Rotation3::from_scaled_axis(inverse_inertia * left) * rotation;
    }
    None
}

/// An orthonormal frame fixed to the corners: the first axis towards one of them, the third across the facet (in 2-D along z).
fn frame(corners: usize, [a, b, c, d]: &Arms) -> Option<Matrix3<f64>> {
    let across = match corners {
        2 => Vector3::z(),
        3 => (b - a).cross(&(c - a)).try_normalize(0.0)?,
        _ => (c - a).cross(&(d - b)).try_normalize(0.0)?,
    };
    let first = (a - across * across.dot(a)).try_normalize(0.0)?;
    Some(Matrix3::from_columns(&[first, across.cross(&first), across]))
}

/// J. A segment does not resist a turn about itself; in 2-D, where segments are facets, none occurs.
fn inertia(corners: usize, turned: &Arms, present: &Arms) -> Matrix3<f64> {
    let mut inertia = Matrix3::zeros();
    for (q, r) in turned.iter().zip(present) {
        inertia += Matrix3::from_diagonal_element(q.dot(r));
        if corners > 2 {
            inertia -= 0.5 * (q * r.transpose() + r * q.transpose());
        }
    }
    inertia
}

fn about_centre(corners: usize, place: impl Fn(usize) -> Vector3<f64>) -> Arms {
    let mut arms = [Vector3::zeros(); 4];
    arms[..corners].iter_mut().enumerate().for_each(|(corner, arm)| *arm = place(corner));
    let centre = arms.iter().sum::<Vector3<f64>>() / corners as f64;
    arms[..corners].iter_mut().for_each(|arm| *arm -= centre);
    arms
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

    fn facet() -> Arms {
        let corners = [[0.0, 0.0, 0.0], [2.0, 0.1, 0.3], [2.2, 3.0, 0.0], [-0.4, 2.5, 0.5]];
        about_centre(4, |corner| Vector3::from(corners[corner]))
    }

    #[test]
    fn a_facet_that_turns_as_a_whole_turns_by_that() {
        let turn = Rotation3::from_scaled_axis(Vector3::new(1.0, -2.0, 0.7));
        let found = nearest_rotation(4, &facet(), &facet().map(|arm| turn * arm)).unwrap();
        assert!((found.rotation.matrix() - turn.matrix()).norm() < 1e-14);
    }

    #[test]
    fn no_rotation_is_nearer_than_the_one_found() {
        // The same, stretched, sheared and warped.
        let strain = Matrix3::new(1.3, 0.2, 0.0, -0.1, 0.8, 0.1, 0.3, 0.0, 1.0);
        let present = facet().map(|arm| strain * arm);
        let found = nearest_rotation(4, &facet(), &present).unwrap().rotation;
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
