//! One coupling step: the conventional serial staggered order of the paper.
//!
//! All get their orders at once, so that within the step only data wakes the next in turn.
//! The Robin wall and the displacement prediction differ only in what the coupler sends on [`Part::Predict`].

use protocol::control::{Order, Part, Reply, StepReport, StepTime};
use protocol::failure::{Failure, FailureClass};

use crate::processes::{Call, Crew};

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

/// The turns of one step: who does what; each waits for the data of the one before.
fn turns(cast: Cast) -> &'static [(&'static str, Part)] {
    match cast {
        Cast::Coupled => &[
            ("coupler", Part::Predict),  // interface motion over the step -> fluid
            ("fluid", Part::Advance),    // (3) to (9): pressure and forces -> coupler
            ("coupler", Part::Transfer), // traction and nodal forces -> solid
            ("solid", Part::Advance),    // displacement, velocity, acceleration -> coupler
            ("coupler", Part::Book),     // ledger of both sides
        ],
        Cast::FluidAlone => &[("fluid", Part::Advance)],
        Cast::SolidAlone => &[("solid", Part::Advance)],
    }
}

/// Gives everyone their parts of one step and gathers the answers.
///
/// # Errors
/// The first failure of any participant.
pub fn step(crew: &mut dyn Crew, cast: Cast, at: StepTime) -> Result<StepReport, Failure> {
    let turns = turns(cast);
    // Whoever has the first turn gets the orders last and is woken by them; the others by the data they wait for.
    for (turn, (process, _)) in turns.iter().enumerate().rev() {
        if turns[..turn].iter().all(|(earlier, _)| earlier != process) {
            let parts = turns.iter().filter(|(other, _)| other == process).map(|(_, part)| *part).collect();
            let call = if turn == 0 { Call::Now } else { Call::WithData };
            crew.order(process, &Order::Step { at, parts }, call)?;
        }
    }
    let mut done = StepReport::unlimited();
    for (process, reply) in crew.answers()? {
        let Reply::Done(report) = reply else {
            let what = format!("expected a step report, found {reply:?}");
            return Err(Failure::new(FailureClass::Process, &process, "step", what));
        };
        done.merge(report);
    }
    Ok(done)
}
