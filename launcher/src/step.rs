//! One coupling step: who does what, and in which turn.
//!
//! All get their parts of a pass at once, so that within it only data wakes the next in turn. The Robin wall and the
//! displacement prediction differ only in what the coupler sends on [`Part::Predict`].

use protocol::case::{Scheme, Side};
use protocol::control::{Order, Part, Reply, StepReport, StepTime};
use protocol::failure::{Failure, FailureClass};

use crate::processes::{Call, Crew};

/// Who takes part in a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cast {
    /// Water and structure, tied by the coupler.
    Coupled(Scheme),
    /// The same with a recording, which the coupler reads, in the place of one of them.
    Replayed(Scheme, Side),
    /// Water alone.
    FluidAlone,
    /// A structure alone.
    SolidAlone,
}

/// A participant's part; each waits for the data of the one before.
type Turn = (&'static str, Part);

/// Conventional serial staggered, in one pass.
const SERIAL: &[Turn] = &[
    ("coupler", Part::Predict),    // interface motion over the step -> fluid
    ("fluid", Part::Advance),      // (3) to (9): pressure and forces -> coupler
    ("coupler", Part::TakeLoad),   // tractions and nodal forces
    ("coupler", Part::SendLoad),   // -> solid
    ("solid", Part::Advance),      // displacement, velocity, acceleration -> coupler
    ("coupler", Part::TakeMotion), // for the next prediction
    ("coupler", Part::Book),       // ledger of both sides
    ("fluid", Part::Record),
    ("solid", Part::Record),
];

/// Both solvers at the same time, one step behind each other.
const PARALLEL: &[Turn] = &[
    ("coupler", Part::Predict),
    ("coupler", Part::SendLoad), // of the last step
    ("fluid", Part::Advance),
    ("solid", Part::Advance),
    ("coupler", Part::TakeMotion),
    ("coupler", Part::TakeLoad),
    ("coupler", Part::Book),
    ("fluid", Part::Record),
    ("solid", Part::Record),
];

/// The first pass of a strong step.
const FIRST_PASS: &[Turn] = &[
    ("coupler", Part::Predict),
    ("fluid", Part::Save),
    ("fluid", Part::Advance),
    ("coupler", Part::TakeLoad),
    ("coupler", Part::SendLoad),
    ("solid", Part::Save),
    ("solid", Part::Advance),
    ("coupler", Part::TakeMotion), // compared with what the fluid was given
];

/// Another pass over the same step.
const ANOTHER_PASS: &[Turn] = &[
    ("coupler", Part::Correct),
    ("fluid", Part::Restore),
    ("fluid", Part::Advance),
    ("coupler", Part::TakeLoad),
    ("coupler", Part::SendLoad),
    ("solid", Part::Restore),
    ("solid", Part::Advance),
    ("coupler", Part::TakeMotion),
];

/// What is left once both sides agree.
const SETTLE: &[Turn] = &[("coupler", Part::Book), ("fluid", Part::Record), ("solid", Part::Record)];

/// Takes one coupling step.
///
/// # Errors
/// The first failure of any participant.
pub fn step(crew: &mut dyn Crew, cast: Cast, at: StepTime) -> Result<StepReport, Failure> {
    let (scheme, absent) = match cast {
        Cast::Coupled(scheme) => (scheme, None),
        Cast::Replayed(scheme, side) => (scheme, Some(side.role())),
        Cast::FluidAlone => return pass(crew, &[("fluid", Part::Advance), ("fluid", Part::Record)], at),
        Cast::SolidAlone => return pass(crew, &[("solid", Part::Advance), ("solid", Part::Record)], at),
    };
    let mut pass = |turns: &[Turn]| {
        let present: Vec<Turn> = turns.iter().copied().filter(|turn| Some(turn.0) != absent).collect();
        pass(crew, &present, at)
    };
    match scheme {
        Scheme::Parallel => pass(PARALLEL),
        Scheme::Strong => {
            let mut done = pass(FIRST_PASS)?;
            while done.is_open {
                done = pass(ANOTHER_PASS)?;
            }
            done.merge(pass(SETTLE)?);
            Ok(done)
        }
        Scheme::Robin | Scheme::Css | Scheme::ToSolid | Scheme::ToFluid => pass(SERIAL),
    }
}

/// Gives everyone their parts of one pass and gathers the answers.
fn pass(crew: &mut dyn Crew, turns: &[Turn], at: StepTime) -> Result<StepReport, Failure> {
    let first = turns[0].0;
    // Whoever has the first turn gets the order last and is woken by it; the others by the data they wait for.
    for (turn, (process, _)) in turns.iter().enumerate().rev() {
        if turns[..turn].iter().all(|(earlier, _)| earlier != process) {
            let parts: Vec<_> =
                turns.iter().filter(|(other, _)| other == process).map(|(_, part)| *part).collect();
            let gets_data = *process != first && parts.contains(&Part::Advance);
            let call = if gets_data { Call::WithData } else { Call::Now };
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
