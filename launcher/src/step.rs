//! One coupling step: who does what, and in which turn.
//!
//! All get their parts of a pass at once, so that within it only data wakes the next in turn. Where a step is one pass, the
//! next one is ordered as soon as the water has said how long it may be, while the structure still moves: then nobody
//! waits for the launcher. The Robin wall and the displacement prediction differ only in what the coupler sends on
//! [`Part::Predict`].

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

/// Water alone.
const FLUID_ALONE: &[Turn] = &[("fluid", Part::Advance), ("fluid", Part::Record)];

/// A structure alone.
const SOLID_ALONE: &[Turn] = &[("solid", Part::Advance), ("solid", Part::Record)];

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

/// A step that was ordered.
#[derive(Debug, Clone, Copy)]
pub struct Ordered {
    /// The step.
    pub at: StepTime,
    cast: Cast,
}

/// Gives out the orders of a step, of its first pass where it may need several.
///
/// # Errors
/// The first failure of any participant.
pub fn order(crew: &mut dyn Crew, cast: Cast, at: StepTime) -> Result<Ordered, Failure> {
    let turns = match cast {
        Cast::Coupled(scheme) | Cast::Replayed(scheme, _) => match scheme {
            Scheme::Parallel => PARALLEL,
            Scheme::Strong => FIRST_PASS,
            Scheme::Robin | Scheme::Css | Scheme::ToSolid | Scheme::ToFluid => SERIAL,
        },
        Cast::FluidAlone => FLUID_ALONE,
        Cast::SolidAlone => SOLID_ALONE,
    };
    give(crew, cast, turns, at)?;
    Ok(Ordered { at, cast })
}

/// What the water alone says of the step, where that is enough to order the next one: whether the step stands is no
/// question, and nobody else limits the next.
///
/// # Errors
/// The first failure of any participant.
pub fn pace(crew: &mut dyn Crew, step: Ordered) -> Result<Option<StepReport>, Failure> {
    match step.cast {
        Cast::Coupled(scheme) if scheme != Scheme::Strong => {
            let reply = crew.answer("fluid")?;
            report(reply, "fluid").map(Some)
        }
        _ => Ok(None),
    }
}

/// What a step came to.
#[derive(Debug, Clone)]
pub struct Settled {
    /// The reports of all.
    pub done: StepReport,
    /// What all but the water admit for the next step, s.
    pub others_dt: f64,
}

/// Sees the step to its end: the answers of all who have not given theirs, and the passes it takes.
///
/// # Errors
/// The first failure of any participant.
pub fn settle(crew: &mut dyn Crew, step: Ordered, paced: Option<StepReport>) -> Result<Settled, Failure> {
    let Ordered { at, cast } = step;
    if let Some(mut done) = paced {
        let mut others = report(crew.answer("coupler")?, "coupler")?;
        others.merge(report(crew.answer("solid")?, "solid")?);
        let others_dt = others.admitted_dt;
        done.merge(others);
        return Ok(Settled { done, others_dt });
    }
    let mut settled = gather(crew)?;
    if let Cast::Coupled(Scheme::Strong) | Cast::Replayed(Scheme::Strong, _) = cast {
        while settled.done.is_open {
            give(crew, cast, ANOTHER_PASS, at)?;
            settled = gather(crew)?;
        }
        give(crew, cast, SETTLE, at)?;
        let last = gather(crew)?;
        settled.done.merge(last.done);
        settled.others_dt = settled.others_dt.min(last.others_dt);
    }
    Ok(settled)
}

/// Has all of them do one part at the end of a step that stands: [`Part::Keep`] or [`Part::TakeUp`].
///
/// # Errors
/// The first failure of any participant.
pub fn all(
    crew: &mut dyn Crew,
    cast: Cast,
    (roles, part): (&[&'static str], Part),
    at: StepTime,
) -> Result<StepReport, Failure> {
    let turns: Vec<Turn> = roles.iter().map(|role| (*role, part)).collect();
    give(crew, cast, &turns, at)?;
    gather(crew).map(|gathered| gathered.done)
}

/// Gives everyone who is present their parts of one pass.
fn give(crew: &mut dyn Crew, cast: Cast, turns: &[Turn], at: StepTime) -> Result<(), Failure> {
    let absent = if let Cast::Replayed(_, side) = cast { Some(side.role()) } else { None };
    let turns: Vec<Turn> = turns.iter().copied().filter(|turn| Some(turn.0) != absent).collect();
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
    Ok(())
}

/// The answers of all.
fn gather(crew: &mut dyn Crew) -> Result<Settled, Failure> {
    let mut settled = Settled { done: StepReport::unlimited(), others_dt: f64::INFINITY };
    for (process, reply) in crew.answers()? {
        let report = report(reply, &process)?;
        if process != "fluid" {
            settled.others_dt = settled.others_dt.min(report.admitted_dt);
        }
        settled.done.merge(report);
    }
    Ok(settled)
}

fn report(reply: Reply, process: &str) -> Result<StepReport, Failure> {
    match reply {
        Reply::Done(report) => Ok(report),
        other => {
            let what = format!("expected a step report, found {other:?}");
            Err(Failure::new(FailureClass::Process, process, "step", what))
        }
    }
}
