//! The time loop: start, steps, output, end, over any [`Crew`] (processes, or threads in tests).

use std::collections::BTreeMap;

use protocol::case::{Scheme, Shared, Side};
use protocol::control::{Account, Order, Ready, Reply, Start, StepReport, StepTime};
use protocol::failure::{Failure, FailureClass};
use protocol::phases::{PhaseClock, PhaseTime};

use crate::processes::{Call, Crew};
use crate::step::{Cast, step};
use crate::time_step::Clock;

/// Outputs a run has at least, so that `run.json` and the series never lag far behind.
const LEAST_OUTPUTS: f64 = 20.0;

/// How a run ended that did not fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The end of the time was reached.
    Completed,
    /// The user asked to stop; the step was finished.
    Interrupted,
}

/// Who looks on while the run goes: progress, `run.json`, the user's wish to stop.
pub trait Observer {
    /// The scene stands; counts by name.
    fn ready(&mut self, _counts: &BTreeMap<String, u64>) {}
    /// A step is done.
    fn stepped(&mut self, _at: StepTime, _done: &StepReport) {}
    /// An output is written; accounts by process, and the time of the loop itself: `start`, `step`, `output`.
    ///
    /// # Errors
    /// Its own files cannot be written.
    fn output(
        &mut self,
        _at: StepTime,
        _accounts: &[(String, Account)],
        _loop_phases: Vec<PhaseTime>,
    ) -> Result<(), Failure> {
        Ok(())
    }
    /// Whether the run shall end after this step.
    fn is_stopped(&self) -> bool {
        false
    }
}

/// The cast a scene needs.
pub fn cast(shared: &Shared) -> Cast {
    let scheme = match &shared.solid {
        // A rigid body does not respond: one pass will do.
        Some(solid) if solid.model == "rigid" => Scheme::default(),
        _ => shared.scheme,
    };
    match (&shared.fluid, &shared.solid, &shared.replay) {
        (Some(_), Some(_), Some(replay)) => Cast::Replayed(scheme, replay.side),
        (Some(_), Some(_), None) => Cast::Coupled(scheme),
        (Some(_), None, _) => Cast::FluidAlone,
        _ => Cast::SolidAlone,
    }
}

/// Processes of a cast, by role.
pub fn roles(cast: Cast) -> &'static [&'static str] {
    match cast {
        Cast::Coupled(_) => &["fluid", "coupler", "solid"],
        Cast::Replayed(_, Side::Fluid) => &["coupler", "solid"],
        Cast::Replayed(_, Side::Solid) => &["fluid", "coupler"],
        Cast::FluidAlone => &["fluid"],
        Cast::SolidAlone => &["solid"],
    }
}

/// Conducts a run from start to end.
///
/// # Errors
/// The first failure of any participant, or of the observer.
pub fn conduct(
    crew: &mut dyn Crew,
    shared: &Shared,
    start: Start,
    observer: &mut dyn Observer,
) -> Result<Ending, Failure> {
    let mut cast = cast(shared);
    let mut phases = PhaseClock::default();
    let ready = phases.run("start", || start_all(crew, cast, start))?;
    observer.ready(&ready.counts);
    let mut clock = Clock::new(&shared.time, ready.admitted_dt);
    let every = shared.output.fields_every.unwrap_or(shared.time.end / LEAST_OUTPUTS);
    let mut frame = 0;
    let mut at = StepTime { step: 0, time: 0.0, dt: 0.0 };
    let accounts = phases.run("output", || output(crew, cast, frame, at))?;
    observer.output(at, &accounts, phases.table())?;
    let (mut ending, mut shown_step) = (Ending::Completed, 0);
    while let Some(next) = clock.next_step() {
        at = next;
        let done = phases.run("step", || step(crew, cast, at))?;
        clock.admit(done.admitted_dt);
        if let Some(scheme) = done.next_scheme {
            cast = Cast::Coupled(scheme);
        }
        observer.stepped(at, &done);
        if let Some(verdict) = done.verdict {
            let what = format!("the run was stopped by the guard: {verdict}");
            return Err(Failure::new(FailureClass::Numerical, "coupler", "book", what)
                .at(at.step, at.time)
                .with_hint("Use [coupling] scheme = \"robin\", or on_guard = \"warn\" to look at it."));
        }
        if at.time >= every * f64::from(frame + 1) * (1.0 - 1e-9) {
            frame = (at.time / every * (1.0 + 1e-9)) as u32;
            let accounts = phases.run("output", || output(crew, cast, frame, at))?;
            observer.output(at, &accounts, phases.table())?;
            shown_step = at.step;
        }
        if observer.is_stopped() {
            ending = Ending::Interrupted;
            break;
        }
    }
    // The end is shown, also where it falls between two outputs.
    if shown_step != at.step {
        phases.run("output", || output(crew, cast, frame + 1, at))?;
    }
    let accounts = phases.run("output", || stop_all(crew, cast))?;
    observer.output(at, &accounts, phases.table())?;
    Ok(ending)
}

fn start_all(crew: &mut dyn Crew, cast: Cast, start: Start) -> Result<Ready, Failure> {
    for role in roles(cast) {
        crew.order(role, &Order::Start(start), Call::Now)?;
    }
    let mut all = Ready { admitted_dt: f64::INFINITY, ..Ready::default() };
    for (process, reply) in crew.answers()? {
        let Reply::Ready(ready) = reply else {
            return Err(unexpected(&process, "start"));
        };
        all.admitted_dt = all.admitted_dt.min(ready.admitted_dt);
        all.counts.extend(ready.counts);
    }
    Ok(all)
}

fn output(
    crew: &mut dyn Crew,
    cast: Cast,
    frame: u32,
    at: StepTime,
) -> Result<Vec<(String, Account)>, Failure> {
    for role in roles(cast) {
        crew.order(role, &Order::Output { frame, at }, Call::Now)?;
    }
    accounts(crew.answers()?)
}

fn stop_all(crew: &mut dyn Crew, cast: Cast) -> Result<Vec<(String, Account)>, Failure> {
    for role in roles(cast) {
        crew.order(role, &Order::Stop, Call::Now)?;
    }
    accounts(crew.answers()?)
}

fn accounts(replies: Vec<(String, Reply)>) -> Result<Vec<(String, Account)>, Failure> {
    let account = |(process, reply): (String, Reply)| match reply {
        Reply::Account(account) => Ok((process, account)),
        _ => Err(unexpected(&process, "output")),
    };
    replies.into_iter().map(account).collect()
}

fn unexpected(process: &str, phase: &str) -> Failure {
    Failure::new(FailureClass::Process, process, phase, "gave an answer that does not fit the order")
}
