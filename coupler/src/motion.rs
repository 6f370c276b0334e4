//! What the fluid is told about the motion of the interface over the coming step.

use protocol::interface::Response;

use crate::case::Scheme;
use crate::mapping::Mapping;

/// Displacement, velocity and acceleration of the solid's interface nodes, each `[n, D]`.
#[derive(Debug, Clone, Default)]
pub struct SolidMotion {
    /// m
    pub displacement: Vec<f64>,
    /// m/s
    pub velocity: Vec<f64>,
    /// m/s2
    pub acceleration: Vec<f64>,
}

impl SolidMotion {
    /// Takes the three blocks of a motion message.
    pub fn read(&mut self, values: &[f64]) {
        let block = values.len() / 3;
        self.displacement.clear();
        self.displacement.extend_from_slice(&values[..block]);
        self.velocity.clear();
        self.velocity.extend_from_slice(&values[block..2 * block]);
        self.acceleration.clear();
        self.acceleration.extend_from_slice(&values[2 * block..]);
    }
}

/// The paper's displacement prediction: x_p,n+1 = X + u_n (order 0) or X + u_n + dt v_n (order 1).
///
/// The fluid sees the wall move from the last prediction to this one: w = (x_p,n+1 - x_p,n) / dt at x_p,n.
#[derive(Debug, Clone)]
pub struct DisplacementPredictor {
    order: u8,
    predicted: Vec<f64>,
}

impl DisplacementPredictor {
    /// Starts at the reference positions moved by the initial displacement.
    pub fn new(order: u8, position: &[f64]) -> Self {
        Self { order, predicted: position.to_vec() }
    }

    /// Predicts from the current position `[n, D]` m and velocity `[n, D]` m/s on the fluid's side; leaves the start
    /// of the step in `position` and the mean velocity over it in `velocity`.
    pub fn predict(&mut self, dt: f64, position: &mut [f64], velocity: &mut [f64]) {
        for i in 0..position.len() {
            let next = if self.order == 0 { position[i] } else { position[i] + dt * velocity[i] };
            position[i] = self.predicted[i];
            velocity[i] = (next - self.predicted[i]) / dt;
            self.predicted[i] = next;
        }
    }
}

/// How the motion sent to the fluid follows from the solid's.
#[derive(Debug, Clone)]
enum Rule {
    /// True position, v_n + dt a_n: what the Robin wall gives way from.
    Robin,
    /// The paper's prediction.
    Predicted(DisplacementPredictor),
    /// A motion known beforehand: true position, mean velocity v_n + dt/2 a_n, and the acceleration.
    Prescribed,
    /// A body that stands still.
    Fixed,
}

/// The motion of the fluid's side of the interface, `[n, D]` each.
#[derive(Debug, Clone)]
pub struct FluidMotion {
    rule: Rule,
    reference: Vec<f64>,
    /// Position at the start of the step, m.
    pub position: Vec<f64>,
    /// Velocity over the step, m/s.
    pub velocity: Vec<f64>,
    /// Acceleration, m/s2; sent for a prescribed motion only.
    pub acceleration: Vec<f64>,
}

impl FluidMotion {
    /// Chooses the rule from (scheme, rigid, prescribed): a rigid body has no coupling scheme, it stands still or
    /// follows its prescribed motion. Positions and initial displacements `[n, D]` m.
    pub fn new(
        (scheme, rigid, prescribed): (Scheme, bool, bool),
        reference: &[f64],
        initial: &[f64],
    ) -> Self {
        let position: Vec<f64> = reference.iter().zip(initial).map(|(x, u)| x + u).collect();
        let rule = match (scheme, rigid, prescribed) {
            (_, _, true) => Rule::Prescribed,
            (_, true, false) => Rule::Fixed,
            (Scheme::Robin, ..) => Rule::Robin,
            (Scheme::Css { order }, ..) => Rule::Predicted(DisplacementPredictor::new(order, &position)),
        };
        let zero = vec![0.0; position.len()];
        Self { rule, reference: reference.to_vec(), position, velocity: zero.clone(), acceleration: zero }
    }

    /// How the fluid must treat the motion.
    pub fn response(&self) -> Response {
        match self.rule {
            Rule::Robin => Response::Robin,
            Rule::Predicted(_) | Rule::Fixed => Response::Given,
            Rule::Prescribed => Response::Prescribed,
        }
    }

    /// Fills in the motion over the coming step from the solid's state at its start.
    pub fn predict(&mut self, dt: f64, solid: &SolidMotion, mapping: &Mapping) {
        if matches!(self.rule, Rule::Fixed) {
            return;
        }
        mapping.spread_motion(&solid.displacement, &mut self.position);
        mapping.spread_motion(&solid.velocity, &mut self.velocity);
        mapping.spread_motion(&solid.acceleration, &mut self.acceleration);
        self.position
            .iter_mut()
            .zip(&self.reference)
            .for_each(|(position, reference)| *position += reference);
        let share = match &mut self.rule {
            Rule::Predicted(predictor) => {
                return predictor.predict(dt, &mut self.position, &mut self.velocity);
            }
            Rule::Robin => dt,
            Rule::Prescribed | Rule::Fixed => 0.5 * dt,
        };
        self.velocity.iter_mut().zip(&self.acceleration).for_each(|(v, a)| *v += share * a);
    }

    /// The blocks of a motion message to the fluid.
    pub fn write(&self, out: &mut [f64]) {
        let block = self.position.len();
        out[..block].copy_from_slice(&self.position);
        out[block..2 * block].copy_from_slice(&self.velocity);
        if out.len() > 2 * block {
            out[2 * block..].copy_from_slice(&self.acceleration);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uniform_motion_is_predicted_exactly_by_order_one_and_one_step_late_by_order_zero() {
        let dt = 0.5;
        for (order, expected) in [(0, [0.0, 1.0, 1.0]), (1, [2.0, 2.0, 2.0])] {
            let mut predictor = DisplacementPredictor::new(order, &[0.0]);
            for (step, expected) in expected.iter().enumerate() {
                // x = 2 t, seen at the start of the step.
                let (mut position, mut velocity) = ([2.0 * dt * step as f64], [2.0]);
                predictor.predict(dt, &mut position, &mut velocity);
                let late = if order == 0 && step > 0 { 2.0 } else { *expected };
                assert_eq!(velocity[0], if order == 0 && step == 0 { 0.0 } else { late });
            }
        }
    }
}
