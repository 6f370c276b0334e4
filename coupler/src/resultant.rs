//! What nodal forces come to: force, moment, work. The same to the last bit on any number of threads.

use std::ops::Add;

use crate::parallel;

/// Force and moment of the nodal forces on one side of the interface, padded to three components.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Resultant {
    /// Sum of the nodal forces, N.
    pub force: [f64; 3],
    /// About the origin, N m.
    pub moment: [f64; 3],
    /// The same with the nodes where the mapping ties them: in the unloaded body, or in the place it has been turned to, N m.
    pub tied_moment: [f64; 3],
    /// Sum of the absolute values, axis by axis, N: what round-off is measured by.
    pub absolute: [f64; 3],
}

impl Resultant {
    /// Of nodal forces, `[n, D]` N, at nodes whose place, present and as the mapping ties them, is a function of the flat
    /// number of the component, m.
    pub fn new(
        dimension: usize,
        force: &[f64],
        position: impl Fn(usize) -> f64 + Sync,
        tied: impl Fn(usize) -> f64 + Sync,
    ) -> Self {
        if dimension == 2 {
            Self::of::<2>(force, position, tied)
        } else {
            Self::of::<3>(force, position, tied)
        }
    }

    fn of<const D: usize>(
        force: &[f64],
        position: impl Fn(usize) -> f64 + Sync,
        tied: impl Fn(usize) -> f64 + Sync,
    ) -> Self {
        let forces = force.as_chunks::<D>().0;
        parallel::sum(0..forces.len(), &|nodes| {
            let mut sum = Self::default();
            for node in nodes {
                let force = padded(|axis| forces[node][axis], D);
                let moment = cross(padded(|axis| position(node * D + axis), D), force);
                let tied_moment = cross(padded(|axis| tied(node * D + axis), D), force);
                sum = sum + Self { force, moment, tied_moment, absolute: force.map(f64::abs) };
            }
            sum
        })
    }
}

impl Add for Resultant {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            force: add(self.force, other.force),
            moment: add(self.moment, other.moment),
            tied_moment: add(self.tied_moment, other.tied_moment),
            absolute: add(self.absolute, other.absolute),
        }
    }
}

/// Weighted sum of nodal vectors, `[n, D]`, padded to three components.
pub fn total(dimension: usize, vectors: &[f64], weight: impl Fn(usize) -> f64 + Sync) -> [f64; 3] {
    let sum = parallel::sum(0..vectors.len() / dimension, &|nodes| {
        nodes.fold(Vector([0.0; 3]), |sum, node| {
            let weight = weight(node);
            sum + Vector(padded(|axis| weight * vectors[node * dimension + axis], dimension))
        })
    });
    sum.0
}

/// Sum of products, a . b, of a vector and a function of the flat number of the component.
pub fn dot(a: &[f64], b: impl Fn(usize) -> f64 + Sync) -> f64 {
    parallel::sum(0..a.len(), &|range| range.map(|i| a[i] * b(i)).sum())
}

/// Work of nodal forces, `[n, D]` N, along a motion, J, and the greatest component of that, m.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Work {
    /// Sum of force times motion, J.
    pub work: f64,
    /// Greatest component of the motion, m.
    pub greatest: f64,
}

impl Work {
    /// Of forces along a motion given as a function of the flat number of the component.
    pub fn new(force: &[f64], motion: impl Fn(usize) -> f64 + Sync) -> Self {
        parallel::sum(0..force.len(), &|range| {
            range.fold(Self::default(), |sum, i| {
                let motion = motion(i);
                sum + Self { work: force[i] * motion, greatest: motion.abs() }
            })
        })
    }
}

impl Add for Work {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { work: self.work + other.work, greatest: self.greatest.max(other.greatest) }
    }
}

struct Vector([f64; 3]);

impl Add for Vector {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(add(self.0, other.0))
    }
}

fn padded(component: impl Fn(usize) -> f64, dimension: usize) -> [f64; 3] {
    std::array::from_fn(|axis| if axis < dimension { component(axis) } else { 0.0 })
}

fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
