//! What the structure moves on the water's side: the nodes of the dummy mesh, or the fluid's own points.

use crate::vector::{Vector, add_scaled, norm};

/// Motion of the interface nodes, or points, over one coupling step.
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a> {
    /// Robin: true positions x_n; otherwise positions at the start of the step, `[n, D]` m.
    pub position: &'a [f64],
    /// Robin: w* = v_n + dt a_n; otherwise the velocity over the step, `[n, D]` m/s.
    pub velocity: &'a [f64],
    /// Of prescribed motion only, `[n, D]` m/s2.
    pub acceleration: Option<&'a [f64]>,
    /// At points without a mesh only: the structure's outward unit normal, `[n, D]`.
    pub normal: Option<&'a [f64]>,
}

/// Interface nodes, or points, `[n]`, in the current sub-step.
#[derive(Debug)]
pub struct Nodes<const D: usize> {
    /// `[n, D]` m.
    pub position: Vec<Vector<D>>,
    /// Of the current coupling step, `[n, D]` m/s.
    pub velocity: Vec<Vector<D>>,
    /// That shifts the wall pressure, `[n, D]` m/s2.
    pub acceleration: Vec<Vector<D>>,
    /// Outward unit normals of the current coupling step, `[n, D]`; of points without a mesh only.
    pub normal: Vec<Vector<D>>,
}

impl<const D: usize> Nodes<D> {
    /// Nodes of a mesh at rest.
    pub fn of_mesh(position: Vec<Vector<D>>) -> Self {
        let count = position.len();
        Self {
            position,
            velocity: vec![[0.0; D]; count],
            acceleration: vec![[0.0; D]; count],
            normal: Vec::new(),
        }
    }

    /// Points without a mesh at rest.
    pub fn without_mesh(position: Vec<Vector<D>>) -> Self {
        let normal = vec![[0.0; D]; position.len()];
        Self { normal, ..Self::of_mesh(position) }
    }

    /// Number of nodes or points.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Takes the motion of a coupling step.
    pub fn take(&mut self, motion: Motion<'_>) {
        let copy = |to: &mut [Vector<D>], from: &[f64]| to.as_flattened_mut().copy_from_slice(from);
        copy(&mut self.position, motion.position);
        copy(&mut self.velocity, motion.velocity);
        if let Some(acceleration) = motion.acceleration {
            copy(&mut self.acceleration, acceleration);
        }
        if let Some(normal) = motion.normal {
            copy(&mut self.normal, normal);
        }
    }

    /// Moves on by `dt` s of a sub-step.
    pub fn move_on(&mut self, dt: f64) {
        for (x, v) in self.position.iter_mut().zip(&self.velocity) {
            add_scaled(x, dt, v);
        }
    }

    /// Largest speed, m/s.
    pub fn largest_speed(&self) -> f64 {
        self.velocity.iter().map(norm).fold(0.0, f64::max)
    }
}
