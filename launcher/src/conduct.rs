//! The time loop: start, steps, output, end, over any [`Crew`] (processes, or threads in tests).

use std::collections::BTreeMap;
use std::time::Instant;

use protocol::case::{Scheme, Shared, Side};
use protocol::control::{Account, Order, Part, Ready, Reply, Start, StepReport, StepTime};
use protocol::failure::{Failure, FailureClass};
use protocol::phases::{PhaseClock, PhaseTime};

use crate::processes::{Call, Crew};
use crate::step::{Cast, Ordered, all, order, pace, settle};
use crate::time_step::{Clock, Moment};

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
    /// All participants have kept their state at this moment, where the case asks for it.
    ///
    /// # Errors
    /// Its own files cannot be written.
    fn kept(&mut self, _at: Moment) -> Result<(), Failure> {
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
    go_on(crew, shared, (start, None), observer)
}

/// The same from a moment whose state lies in the run folder.
///
/// # Errors
/// As [`conduct`]; also a state that does not fit the scene.
pub fn resume(
    crew: &mut dyn Crew,
    shared: &Shared,
    (start, from): (Start, Moment),
    observer: &mut dyn Observer,
) -> Result<Ending, Failure> {
    go_on(crew, shared, (start, Some(from)), observer)
}

fn go_on(
    crew: &mut dyn Crew,
    shared: &Shared,
    (start, from): (Start, Option<Moment>),
    observer: &mut dyn Observer,
) -> Result<Ending, Failure> {
    let mut cast = cast(shared);
    let mut phases = PhaseClock::default();
    let (ready, others_dt) = phases.run("start", || start_all(crew, cast, start))?;
    observer.ready(&ready.counts);
    let (mut clock, mut next_scheme) = (Clock::new(&shared.time, ready.admitted_dt), None);
    if let Some(moment) = from {
        let part = (roles(cast), Part::TakeUp);
        let taken = phases.run("start", || all(crew, cast, part, moment.step_time()))?;
        clock = Clock::at(&shared.time, moment);
        if let Some(scheme) = taken.next_scheme {
            (cast, next_scheme) = (Cast::Coupled(scheme), moment.next_scheme);
        }
    }
    let every = shared.output.fields_every.unwrap_or(shared.time.end / LEAST_OUTPUTS);
    let keeps_state = shared.output.state;
    let (frame, shown_step) = (frame_of(clock.now().time, every), 0);
    let mut time_loop = TimeLoop {
        crew,
        observer,
        cast,
        next_scheme,
        clock,
        phases,
        every,
        frame,
        shown_step,
        others_dt,
        keeps_state,
    };
    let (ending, at) = time_loop.run()?;
    time_loop.stop(at)?;
    Ok(ending)
}

/// The loop over the steps, and what it knows from one to the next.
struct TimeLoop<'a> {
    crew: &'a mut dyn Crew,
    observer: &'a mut dyn Observer,
    /// Who takes part in the next step to be ordered.
    cast: Cast,
    /// The scheme of the steps after that one, where the guard changes it.
    next_scheme: Option<Scheme>,
    clock: Clock,
    phases: PhaseClock,
    /// Time between two outputs, s.
    every: f64,
    frame: u32,
    /// The step of the last output.
    shown_step: u64,
    /// What all but the water admit for a step, s.
    others_dt: f64,
    keeps_state: bool,
}

impl TimeLoop<'_> {
    /// All steps; the last one, and why it was.
    fn run(&mut self) -> Result<(Ending, StepTime), Failure> {
        let mut at = self.clock.now().step_time();
        self.output(at)?;
        let mut begun = Instant::now();
        let mut ordered = self.order_next()?;
        self.cast = self.next_scheme.map_or(self.cast, Cast::Coupled);
        while let Some(step) = ordered {
            at = step.at;
            let (done, next) = self.take(step)?;
            self.phases.add("step", begun.elapsed().as_secs_f64());
            self.observer.stepped(at, &done);
            self.next_scheme = done.next_scheme;
            if let Some(verdict) = done.verdict {
                return Err(stopped(&verdict, at));
            }
            if next.is_none() && self.is_output_due(at) {
                self.frame = frame_of(at.time, self.every);
                self.output(at)?;
                self.keep()?;
            }
            if next.is_none() && self.observer.is_stopped() {
                return Ok((Ending::Interrupted, at));
            }
            begun = Instant::now();
            // A guard that changes the scheme does so before it knows whether the next step is ordered already: the
            // change holds for the one after that, so that nothing depends on who was faster. Beyond the first step
            // nothing is ordered ahead.
            let cast = self.next_scheme.map_or(self.cast, Cast::Coupled);
            if at.step == 1 {
                self.cast = cast;
            }
            ordered = if next.is_some() { next } else { self.order_next()? };
            self.cast = cast;
        }
        Ok((Ending::Completed, at))
    }

    /// One step to its end, with the next one ordered while it lasts, where nothing stands between the two.
    fn take(&mut self, step: Ordered) -> Result<(StepReport, Option<Ordered>), Failure> {
        let looks_ahead = step.at.step > 1
            && self.others_dt.is_infinite()
            && !self.is_output_due(step.at)
            && !self.observer.is_stopped();
        let mut next = None;
        let paced = if looks_ahead { pace(self.crew, step)? } else { None };
        if let Some(water) = &paced {
            self.clock.admit(water.admitted_dt);
            next = self.order_next()?;
        }
        let settled = settle(self.crew, step, paced)?;
        self.others_dt = settled.others_dt;
        if next.is_none() {
            self.clock.admit(settled.done.admitted_dt);
        }
        Ok((settled.done, next))
    }

    fn order_next(&mut self) -> Result<Option<Ordered>, Failure> {
        self.clock.next_step().map(|at| order(self.crew, self.cast, at)).transpose()
    }

    fn is_output_due(&self, at: StepTime) -> bool {
        at.time >= self.every * f64::from(self.frame + 1) * (1.0 - 1e-9)
    }

    fn output(&mut self, at: StepTime) -> Result<(), Failure> {
        let Self { crew, cast, frame, phases, .. } = self;
        let accounts = phases.run("output", || output(*crew, *cast, *frame, at))?;
        self.shown_step = at.step;
        self.observer.output(at, &accounts, self.phases.table())
    }

    /// Has all of them keep their state, where the case asks for it; the launcher's own comes last.
    fn keep(&mut self) -> Result<(), Failure> {
        if !self.keeps_state {
            return Ok(());
        }
        let Self { crew, cast, phases, .. } = self;
        let mut now = self.clock.now();
        now.next_scheme = self.next_scheme;
        phases.run("keep", || all(*crew, *cast, (roles(*cast), Part::Keep), now.step_time()))?;
        self.observer.kept(now)
    }

    /// The end is shown, also where it falls between two outputs.
    fn stop(&mut self, at: StepTime) -> Result<(), Failure> {
        if self.shown_step != at.step {
            let Self { crew, cast, frame, phases, .. } = self;
            phases.run("output", || output(*crew, *cast, *frame + 1, at))?;
            self.keep()?;
        }
        let Self { crew, cast, phases, .. } = self;
        let accounts = phases.run("output", || stop_all(*crew, *cast))?;
        self.observer.output(at, &accounts, self.phases.table())
    }
}

/// Number of the output a time belongs to.
fn frame_of(time: f64, every: f64) -> u32 {
    (time / every * (1.0 + 1e-9)) as u32
}

fn stopped(verdict: &str, at: StepTime) -> Failure {
    let what = format!("the run was stopped by the guard: {verdict}");
    Failure::new(FailureClass::Numerical, "coupler", "book", what)
        .at(at.step, at.time)
        .with_hint("Use [coupling] scheme = \"robin\", or on_guard = \"warn\" to look at it.")
}

/// The scene once it stands, and what all but the water admit for a step, s.
fn start_all(crew: &mut dyn Crew, cast: Cast, start: Start) -> Result<(Ready, f64), Failure> {
    for role in roles(cast) {
        crew.order(role, &Order::Start(start), Call::Now)?;
    }
    let mut all = Ready { admitted_dt: f64::INFINITY, ..Ready::default() };
    let mut others_dt = f64::INFINITY;
    for (process, reply) in crew.answers()? {
        let Reply::Ready(ready) = reply else {
            return Err(unexpected(&process, "start"));
        };
        all.admitted_dt = all.admitted_dt.min(ready.admitted_dt);
        all.counts.extend(ready.counts);
        if process != "fluid" {
            others_dt = others_dt.min(ready.admitted_dt);
        }
    }
    Ok((all, others_dt))
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
