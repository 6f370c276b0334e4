//! What can go wrong in the solid.

use protocol::failure::{Failure, FailureClass};

/// Why an iteration failed, before the step and time are known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Trouble {
    /// det F <= 0 somewhere in the element.
    Inverted { element: usize, determinant: f64 },
    /// The material law of the element has no answer.
    Material { element: usize },
    /// The residual did not fall below the limit.
    Stalled { residual: f64, limit: f64, iterations: u32 },
    /// The tangent is not positive definite.
    Indefinite,
    /// The linear solver did not converge.
    LinearStalled { residual: f64, limit: f64 },
    /// A residual that is not a number.
    NonFinite,
}

/// A failure of the run, once step halving is used up.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolidError {
    /// An element turned inside out.
    #[error("element {element} is inverted: det F = {determinant:.3e} at step {step}, t = {time_s:.6} s")]
    InvertedElement {
        /// Step, 0 in the static start.
        step: u64,
        /// Time, s.
        time_s: f64,
        /// Element number.
        element: usize,
        /// Determinant of the deformation gradient, must be above 0.
        determinant: f64,
    },
    /// The strain of an element is beyond its material law.
    #[error("element {element} is strained beyond its material law at step {step}, t = {time_s:.6} s")]
    MaterialFailed {
        /// Step, 0 in the static start.
        step: u64,
        /// Time, s.
        time_s: f64,
        /// Element number.
        element: usize,
    },
    /// Newton's method did not converge, not even in 1/256 of the step.
    #[error(
        "Newton stalled at step {step}, t = {time_s:.6} s: residual {residual:.3e} N, limit {limit:.3e} N"
    )]
    NewtonStalled {
        /// Step, 0 in the static start.
        step: u64,
        /// Time, s.
        time_s: f64,
        /// Iterations of the last attempt.
        iterations: u32,
        /// Norm of the residual, N.
        residual: f64,
        /// Its limit, N.
        limit: f64,
    },
    /// The tangent stiffness is not positive definite: the body buckles.
    #[error("the tangent stiffness is not positive definite at step {step}, t = {time_s:.6} s")]
    NotPositiveDefinite {
        /// Step, 0 in the static start.
        step: u64,
        /// Time, s.
        time_s: f64,
    },
    /// The conjugate gradients did not converge.
    #[error(
        "linear solve stalled at step {step}, t = {time_s:.6} s: residual {residual:.3e}, limit {limit:.3e}"
    )]
    LinearSolveStalled {
        /// Step, 0 in the static start.
        step: u64,
        /// Time, s.
        time_s: f64,
        /// Relative residual.
        residual: f64,
        /// Its limit.
        limit: f64,
    },
    /// A load or displacement that is no finite number.
    #[error("a value in the solid is not finite at step {step}, t = {time_s:.6} s")]
    NonFinite {
        /// Step, 0 in the static start.
        step: u64,
        /// Time, s.
        time_s: f64,
    },
    /// The scene cannot be built.
    #[error("{what}")]
    Scene {
        /// What is wrong with it.
        what: SceneError,
    },
}

/// Why a scene is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// Not 2 or 3.
    #[error("dimension {0} is neither 2 nor 3")]
    Dimension(usize),
    /// Upper corner not above the lower one.
    #[error("the body has no extent along axis {0}")]
    Extent(usize),
    /// No element along an axis.
    #[error("the body has no element along axis {0}")]
    Elements(usize),
    /// Element of the other dimension.
    #[error("element {0} does not exist in {1}-D")]
    Element(&'static str, usize),
    /// Out of range, with range.
    #[error("{name} is {value}, must be {range}")]
    Range {
        /// Quantity.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
    /// A face that does not exist, or cannot do what it is named for.
    #[error("face {0} cannot be used here: {1}")]
    Face(String, &'static str),
    /// Supports that let the body move.
    #[error("the supports leave the body free to {0}")]
    Mechanism(&'static str),
    /// Two settings that exclude each other.
    #[error("{0}")]
    Conflict(&'static str),
    /// A point of a load outside the body.
    #[error("the point {0:?} of a load lies outside the body")]
    Point(Vec<f64>),
}

impl From<SceneError> for SolidError {
    fn from(what: SceneError) -> Self {
        Self::Scene { what }
    }
}

impl Trouble {
    /// The same, placed at a step.
    pub(crate) fn at(self, step: u64, time_s: f64) -> SolidError {
        match self {
            Self::Inverted { element, determinant } => {
                SolidError::InvertedElement { step, time_s, element, determinant }
            }
            Self::Material { element } => SolidError::MaterialFailed { step, time_s, element },
            Self::Stalled { residual, limit, iterations } => {
                SolidError::NewtonStalled { step, time_s, iterations, residual, limit }
            }
            Self::Indefinite => SolidError::NotPositiveDefinite { step, time_s },
            Self::LinearStalled { residual, limit } => {
                SolidError::LinearSolveStalled { step, time_s, residual, limit }
            }
            Self::NonFinite => SolidError::NonFinite { step, time_s },
        }
    }
}

impl SolidError {
    /// The failure that ends the run with it.
    pub fn into_failure(self, phase: &str) -> Failure {
        let text = self.to_string();
        let numerical =
            |step, time_s| Failure::new(FailureClass::Numerical, "solid", phase, &text).at(step, time_s);
        match self {
            Self::InvertedElement { step, time_s, determinant, .. } => numerical(step, time_s)
                .with_value(determinant, 0.0)
                .with_hint("the body is crushed: check young_modulus against the load, or use more elements"),
            Self::MaterialFailed { step, time_s, .. } => numerical(step, time_s)
                .with_hint("use more load steps or a smaller time step, or material = \"neo_hookean\""),
            Self::NewtonStalled { step, time_s, residual, limit, .. } => numerical(step, time_s)
                .with_value(residual, limit)
                .with_hint("try a smaller time step, or check the load for jumps"),
            Self::NotPositiveDefinite { step, time_s } => numerical(step, time_s).with_hint(
                "the body buckles under its load: check young_modulus, density, gravity and supports",
            ),
            Self::LinearSolveStalled { step, time_s, residual, limit } => numerical(step, time_s)
                .with_value(residual, limit)
                .with_hint("very stretched elements make the matrix hard to solve: use more even ones"),
            Self::NonFinite { step, time_s } => {
                numerical(step, time_s).with_hint("the load received was not finite, or the run blew up")
            }
            Self::Scene { what } => Failure::new(FailureClass::Case, "solid", phase, what.to_string()),
        }
    }
}
