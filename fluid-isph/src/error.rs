//! Why a scene cannot be made or a step cannot be done; each says the value, the limit and what to try.

use protocol::failure::{Failure, FailureClass};

/// A scene that cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SetupError {
    /// Water or tank are no whole number of any spacing near the one asked for.
    #[error("the length {length} m is no whole number of spacings near {spacing} m (misfit {:.2} %)", stretch * 100.0)]
    SpacingDoesNotFit {
        /// Spacing asked for, m.
        spacing: f64,
        /// The length that fits worst, m.
        length: f64,
        /// Relative stretch it would need.
        stretch: f64,
    },
    /// A side of the water or the tank is shorter than a spacing.
    #[error("the spacing {spacing} m is larger than a side of {length} m")]
    SpacingTooLarge {
        /// Spacing asked for, m.
        spacing: f64,
        /// The short side, m.
        length: f64,
    },
    /// Water boxes without a single particle.
    #[error("the water boxes hold no particle")]
    NoWater,
    /// Water would see itself through the body.
    #[error("a body wet on both faces is {thickness} m thick, less than two spacings of {spacing} m")]
    BodyTooThin {
        /// Thickness across, m.
        thickness: f64,
        /// Spacing, m.
        spacing: f64,
    },
    /// Water boxes lie inside the body altogether.
    #[error("all {count} water particles overlap the body")]
    WaterInsideBody {
        /// Particles the water boxes hold.
        count: usize,
    },
    /// The pressure the explicit scheme starts from cannot be solved for.
    #[error("the pressure of the start: {0}")]
    StartPressure(StepFault),
    /// The body mesh has another dimension than the scene, or cells without volume.
    #[error("the body mesh cannot be used: {what}")]
    BodyMesh {
        /// What is wrong.
        what: &'static str,
    },
}

impl SetupError {
    /// The failure the run ends with.
    pub fn into_failure(self, process: &str) -> Failure {
        let hint = match &self {
            Self::SpacingDoesNotFit { length, spacing, .. } => {
                let count = (length / spacing).round().max(1.0);
                format!("try spacing = {:.6} or a length of {:.6}", length / count, count * spacing)
            }
            Self::SpacingTooLarge { length, .. } => format!("use a spacing of {:.4} m or less", length / 4.0),
            Self::NoWater => "enlarge [[fluid.region]], refine the spacing, or carve less".to_owned(),
            Self::BodyTooThin { thickness, .. } => {
                format!("use a spacing of {:.6} m or less", thickness / 2.0)
            }
            Self::WaterInsideBody { .. } => "move the water or the body".to_owned(),
            Self::StartPressure(_) => "look at the places and velocities of the start".to_owned(),
            Self::BodyMesh { .. } => "the coupler and the fluid disagree: this is a bug".to_owned(),
        };
        Failure::new(FailureClass::Case, process, "start", self.to_string()).with_hint(hint)
    }
}

/// What stopped a step.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StepFault {
    /// Conjugate gradients did not reach the tolerance.
    #[error("pressure solve stalled after {iterations} iterations at relative residual {residual:.2e}")]
    PressureSolveStalled {
        /// Iterations done.
        iterations: u32,
        /// Relative residual reached.
        residual: f64,
        /// Tolerance asked for.
        tolerance: f64,
    },
    /// A residual, pressure or motion that is no number.
    #[error("{what} is not finite")]
    NonFinite {
        /// Which quantity.
        what: &'static str,
    },
    /// Water moves further in a sub-step than its stencil bears, however short the sub-step.
    #[error("particle {item} moves {moved:.3} spacings in one sub-step of {dt:.3e} s")]
    StepTooLarge {
        /// Particle number.
        item: usize,
        /// |v| dt/spacing.
        moved: f64,
        /// Sub-step, s.
        dt: f64,
    },
    /// One coupling step would need too many sub-steps.
    #[error("one coupling step needs {needed} sub-steps")]
    TooManySubsteps {
        /// Sub-steps needed.
        needed: u64,
        /// Largest number allowed.
        limit: u32,
    },
    /// Speeds beyond anything the scene can produce.
    #[error("water particle {item} has {speed:.3} m/s")]
    Runaway {
        /// Particle number.
        item: usize,
        /// Its speed, m/s.
        speed: f64,
        /// Ten times the largest speed the scene can produce, m/s.
        limit: f64,
    },
    /// Motion arrays of the wrong length.
    #[error("motion with {found} values where {expected} are due")]
    MotionSize {
        /// Values expected per array.
        expected: usize,
        /// Values found.
        found: usize,
    },
}

/// A step that could not be done, with its place.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("step {step}, t = {time:.6} s: {fault}")]
pub struct FluidError {
    /// Number of the coupling step, from 1.
    pub step: u64,
    /// Simulated time at the start of the sub-step, s.
    pub time: f64,
    /// What happened.
    pub fault: StepFault,
}

impl FluidError {
    /// The failure the run ends with.
    pub fn into_failure(self, process: &str) -> Failure {
        let (phase, limits, hint) = match &self.fault {
            StepFault::PressureSolveStalled { residual, tolerance, .. } => {
                let hint =
                    "loosen fluid.pressure_tolerance (single precision floors at 1e-5) or shorten the step";
                ("solve", Some((*residual, *tolerance)), hint)
            }
            StepFault::NonFinite { .. } => {
                ("solve", None, "shorten the step; with a structure, use the Robin wall")
            }
            StepFault::StepTooLarge { moved, .. } => {
                ("correct", Some((*moved, 0.5)), "shorten time.max_dt or lower fluid.courant")
            }
            StepFault::TooManySubsteps { needed, limit } => (
                "time step",
                Some((*needed as f64, f64::from(*limit))),
                "shorten the coupling step or raise fluid.max_substeps",
            ),
            StepFault::Runaway { speed, limit, .. } => (
                "move",
                Some((*speed, *limit)),
                "look at the last output; shorten the step or lower the relaxation",
            ),
            StepFault::MotionSize { expected, found } => (
                "receive motion",
                Some((*found as f64, *expected as f64)),
                "the coupler and the fluid disagree: this is a bug",
            ),
        };
        let class = if phase == "receive motion" { FailureClass::Bug } else { FailureClass::Numerical };
        let failure = Failure::new(class, process, phase, self.fault.to_string()).at(self.step, self.time);
        let failure = failure.with_hint(hint);
        match limits {
            Some((value, limit)) => failure.with_value(value, limit),
            None => failure,
        }
    }
}
