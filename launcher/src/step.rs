//! One coupling step: the conventional serial staggered order of the paper, one order at a time.
//!
//! The Robin wall and the displacement prediction differ only in what the coupler sends on `Predict`.

use protocol::control::{Order, Reply, StepReport, StepTime};
use protocol::failure::{Failure, FailureClass};

use crate::processes::Crew;

/// Who takes part in a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cast {
    /// Water and structure, tied by the coupler.
    Coupled,
    /// Water alone.
    FluidAlone,
    /// A structure alone.
    SolidAlone,
}

/// Gives the orders of one step and gathers the answers.
///
/// # Errors
/// The first failure of any participant.
pub fn step(crew: &mut dyn Crew, cast: Cast, at: StepTime) -> Result<StepReport, Failure> {
    let mut done = StepReport { admitted_dt: f64::INFINITY, ..StepReport::default() };
    match cast {
        Cast::Coupled => {
            order(crew, "coupler", Order::Predict(at), &mut done)?; // interface motion over the step -> fluid
            order(crew, "fluid", Order::Advance(at), &mut done)?; // (3) to (9): pressure and forces -> coupler
            order(crew, "coupler", Order::Transfer(at), &mut done)?; // traction and nodal forces -> solid
            order(crew, "solid", Order::Advance(at), &mut done)?; // displacement, velocity, acceleration -> coupler
            order(crew, "coupler", Order::Book(at), &mut done)?; // ledger of both sides
        }
        Cast::FluidAlone => order(crew, "fluid", Order::Advance(at), &mut done)?,
        Cast::SolidAlone => order(crew, "solid", Order::Advance(at), &mut done)?,
    }
    Ok(done)
}

fn order(crew: &mut dyn Crew, process: &str, order: Order, done: &mut StepReport) -> Result<(), Failure> {
    let Reply::Done(report) = crew.ask(process, &order)? else {
        let what = format!("expected a step report in answer to {order:?}");
        return Err(Failure::new(FailureClass::Process, process, "order", what));
    };
    done.admitted_dt = done.admitted_dt.min(report.admitted_dt);
    done.substeps = done.substeps.max(report.substeps);
    done.shown = done.shown.take().or(report.shown);
    done.verdict = done.verdict.take().or(report.verdict);
    Ok(())
}
