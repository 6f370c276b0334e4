//! What the fluid is told about the motion of the interface over the coming step.

use protocol::case::Scheme;
use protocol::interface::Response;
use serde::{Deserialize, Serialize};

use crate::case::{OnGuard, Settings};
use crate::mapping::Mapping;

/// Displacement, velocity and acceleration of the solid's interface nodes, each `[n, D]`.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct SolidMotion {
    /// m
    pub displacement: Vec<f64>,
    /// m/s
    pub velocity: Vec<f64>,
    /// m/s2
    pub acceleration: Vec<f64>,
}

impl SolidMotion {
    /// The three blocks of a motion message.
    pub fn columns(&self) -> [&[f64]; 3] {
        [&self.displacement, &self.velocity, &self.acceleration]
    }

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

/// The paper's displacement prediction: x_p,n+1 = X + u_n (order 0), X + u_n + dt v_n (order 1) or, by Adams and
/// Bashforth, X + u_n + dt (3 v_n - v_n-1) / 2 (order 2; for unequal steps their general form).
///
/// The fluid sees the wall move from the last prediction to this one: w = (x_p,n+1 - x_p,n) / dt at x_p,n.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct DisplacementPredictor {
    order: u8,
    predicted: Vec<f64>,
    /// v_n-1 and the step from there, s; none before the second step.
    before: Option<(Vec<f64>, f64)>,
}

impl DisplacementPredictor {
    /// Starts at the reference positions moved by the initial displacement.
    pub fn new(order: u8, position: &[f64]) -> Self {
        Self { order, predicted: position.to_vec(), before: None }
    }

    /// Predicts from the current position `[n, D]` m and velocity `[n, D]` m/s on the fluid's side; leaves the start
    /// of the step in `position` and the mean velocity over it in `velocity`.
    pub fn predict(&mut self, dt: f64, position: &mut [f64], velocity: &mut [f64]) {
        let now = (self.order == 2).then(|| velocity.to_vec());
        for i in 0..position.len() {
            let next = position[i] + dt * self.mean_velocity(i, velocity[i], dt);
            position[i] = self.predicted[i];
            velocity[i] = (next - self.predicted[i]) / dt;
            self.predicted[i] = next;
        }
        self.before = now.map(|velocity| (velocity, dt));
    }

    fn mean_velocity(&self, component: usize, velocity: f64, dt: f64) -> f64 {
        match (self.order, &self.before) {
            (0, _) => 0.0,
            (_, Some((before, step))) => velocity + 0.5 * dt / step * (velocity - before[component]),
            (_, None) => velocity,
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
    /// A body that stands still, or that the water shall see so.
    Fixed,
    /// A guess of the displacement at the end of the step, see [`FluidMotion::follow`].
    Guessed,
}

/// The motion of the fluid's side of the interface, `[n, D]` each.
#[derive(Debug, Clone)]
pub struct FluidMotion {
    rule: Rule,
    response: Response,
    reference: Vec<f64>,
    /// Position at the start of the step, m.
    pub position: Vec<f64>,
    /// Velocity over the step, m/s.
    pub velocity: Vec<f64>,
    /// Acceleration, m/s2; of a prescribed motion only.
    pub acceleration: Vec<f64>,
}

impl FluidMotion {
    /// Chooses the rule from the scheme of the first step, the settings and (rigid, prescribed): a rigid body has no coupling scheme, it stands still
    /// or follows its prescribed motion. Places at the unloaded body and at the start, `[n, D]` m.
    pub fn new(
        (scheme, settings): (Scheme, &Settings),
        (rigid, prescribed): (bool, bool),
        reference: &[f64],
        position: Vec<f64>,
    ) -> Self {
        let rule = match scheme {
            _ if prescribed => Rule::Prescribed,
            _ if rigid => Rule::Fixed,
            Scheme::Robin => Rule::Robin,
            Scheme::Css | Scheme::Parallel => {
                Rule::Predicted(DisplacementPredictor::new(settings.prediction_order, &position))
            }
            Scheme::Strong => Rule::Guessed,
            Scheme::ToSolid => Rule::Fixed,
            Scheme::ToFluid => Rule::Prescribed,
        };
        let may_escalate = settings.on_guard == OnGuard::Escalate;
        let response = match rule {
            Rule::Robin => Response::Robin,
            Rule::Predicted(_) if may_escalate => Response::Robin,
            Rule::Predicted(_) | Rule::Fixed | Rule::Guessed => Response::Given,
            Rule::Prescribed => Response::Prescribed,
        };
        let velocity = vec![0.0; position.len()];
        let acceleration = if response == Response::Prescribed { velocity.clone() } else { Vec::new() };
        Self { rule, response, reference: reference.to_vec(), position, velocity, acceleration }
    }

    /// How the fluid must be ready to treat the motion.
    pub fn response(&self) -> Response {
        self.response
    }

    /// Goes over to the Robin wall, or to a motion that is given.
    pub fn escalate(&mut self, scheme: Scheme) {
        self.rule = if scheme == Scheme::Robin { Rule::Robin } else { Rule::Guessed };
    }

    /// The prediction, where the rule is one.
    pub(crate) fn predictor(&self) -> Option<&DisplacementPredictor> {
        match &self.rule {
            Rule::Predicted(predictor) => Some(predictor),
            _ => None,
        }
    }

    /// Begins at the solid's present state, a prediction where the one kept has left the wall.
    pub(crate) fn begin_at(
        &mut self,
        solid: &SolidMotion,
        mapping: &Mapping,
        kept: Option<DisplacementPredictor>,
    ) {
        let Rule::Predicted(predictor) = &mut self.rule else { return };
        let order = predictor.order;
        *predictor = match kept {
            Some(kept) => DisplacementPredictor { order, ..kept },
            None => {
                let (reference, displacement) = (&self.reference, &solid.displacement);
                mapping.place(reference, displacement, &mut self.position);
                DisplacementPredictor::new(order, &self.position)
            }
        };
    }

    /// Whether the wall does anything but stand still.
    pub fn is_moving(&self) -> bool {
        !matches!(self.rule, Rule::Fixed)
    }

    /// Fills in the motion over the coming step from the solid's state at its start.
    pub fn predict(&mut self, dt: f64, solid: &SolidMotion, mapping: &Mapping) {
        let share = match self.rule {
            Rule::Fixed => return,
            Rule::Predicted(_) => 0.0,
            Rule::Robin => dt,
            Rule::Prescribed | Rule::Guessed => 0.5 * dt,
        };
        let SolidMotion { displacement: u, velocity: v, acceleration: a } = solid;
        let reference = &self.reference;
        mapping.place(reference, u, &mut self.position);
        if let Rule::Predicted(predictor) = &mut self.rule {
            mapping.spread_motion(v, &mut self.velocity);
            predictor.predict(dt, &mut self.position, &mut self.velocity);
        } else {
            mapping.spread(|i| v[i] + share * a[i], &mut self.velocity);
        }
        if self.response == Response::Prescribed {
            mapping.spread_motion(a, &mut self.acceleration);
        }
    }

    /// Moves evenly from one displacement of the solid's nodes to another, `[n, D]` m, over the coming step.
    pub fn follow(&mut self, dt: f64, (start, end): (&[f64], &[f64]), mapping: &Mapping) {
        let reference = &self.reference;
        mapping.place(reference, start, &mut self.position);
        mapping.spread(|i| (end[i] - start[i]) / dt, &mut self.velocity);
    }

    /// A motion message to the fluid.
    pub fn write(&self, mut out: &mut [f64]) {
        if self.response == Response::Robin {
            let gives_way = matches!(self.rule, Rule::Robin);
            out[0] = f64::from(u8::from(gives_way));
            out = &mut out[1..];
        }
        let block = self.position.len();
        out[..block].copy_from_slice(&self.position);
        out[block..2 * block].copy_from_slice(&self.velocity);
        out[2 * block..].copy_from_slice(&self.acceleration);
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

    #[test]
    fn order_two_predicts_a_uniform_acceleration_exactly_with_unequal_steps_too() {
        // x = t^2 / 2, v = t: dt (v + kappa/2 (v - v_before)) is the mean of v over the step.
        let mut predictor = DisplacementPredictor::new(2, &[0.0]);
        let (mut time, mut mean) = (0.0_f64, Vec::new());
        for dt in [0.5, 0.25, 0.25, 0.1] {
            let (mut position, mut velocity) = ([0.5 * time * time], [time]);
            predictor.predict(dt, &mut position, &mut velocity);
            time += dt;
            mean.push((predictor.predicted[0], 0.5 * time * time));
        }
        assert!(mean[1..].iter().all(|(found, exact)| (found - exact).abs() < 1e-15), "{mean:?}");
    }
}
