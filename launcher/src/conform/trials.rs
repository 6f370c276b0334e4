//! What is tried, one run of the program each.

use std::time::{Duration, Instant};

use protocol::control::{Order, Part, Ready, Reply, Start, StepTime};
use protocol::failure::{Failure, FailureClass};
use protocol::interface::{Contract, Surface};
use protocol::link::{Item, LinkError};
use protocol::names::{RunId, RunNames};

use super::coupler::Line;
use super::{Bench, Finding, TIMEOUT};
use crate::processes::{Call, Crew, Processes};

/// Steps of the plain run.
const STEPS: u64 = 10;
/// The step that is passed over twice.
const REPEATED: u64 = 5;
/// The step that is answered after the next one is ordered.
const AHEAD: u64 = 8;
/// From the call-off to the end of the process.
const CALL_OFF: Duration = Duration::from_secs(2);

/// What both ends of a trial are told.
struct Trial<'b> {
    bench: &'b Bench,
    names: RunNames,
    contract: Contract,
}

pub(super) fn all(bench: &Bench) -> Result<Vec<Finding>, Failure> {
    let mut findings = plain_run(&Trial::new(bench)?);
    // A program that does not come up fails all the rest for the same reason.
    if findings[0].fault.is_some() {
        return Ok(findings);
    }
    findings.push(another_contract(Trial::new(bench)?));
    findings.push(another_step(&Trial::new(bench)?));
    findings.push(called_off(&Trial::new(bench)?));
    Ok(findings)
}

impl<'b> Trial<'b> {
    fn new(bench: &'b Bench) -> Result<Self, Failure> {
        let refuse = |what: String| Failure::new(FailureClass::Resource, "tidewall", "conform", what);
        let id = RunId::random().map_err(|error| refuse(format!("cannot draw a run id: {error}")))?;
        let shared = &bench.checked.shared;
        let lock = std::fs::read(bench.folder.join("case.lock.toml"));
        let lock = lock.map_err(|error| refuse(format!("cannot read the case back: {error}")))?;
        let contract = Contract {
            dimension: shared.header.dimension,
            node_count: bench.checked.figure("surface_nodes").unwrap_or_default() as usize,
            end_time: shared.time.end,
            scene: u8::checksum(&lock),
        };
        Ok(Self { bench, names: RunNames::of(id), contract })
    }

    fn at(&self, step: u64) -> StepTime {
        let dt = self.bench.checked.shared.time.max_dt;
        StepTime { step, time: dt * step as f64, dt }
    }

    fn start(&self) -> Result<Processes, Failure> {
        let mut crew = self.bench.start(&self.names)?;
        let nodes = Some(self.contract.node_count as u64);
        crew.order("solid", &Order::Start(Start { surface_nodes: nodes, fluid_nodes: nodes }), Call::Now)?;
        Ok(crew)
    }

    /// Runs both ends: the launcher's here, on the thread that starts the program, the coupler's on another.
    fn play<T: Send>(
        &self,
        launcher: impl FnOnce(Processes) -> Result<(), Failure>,
        coupler: impl FnOnce(&Self) -> Result<T, LinkError> + Send,
    ) -> (Result<(), Failure>, Result<T, LinkError>)
    where
        Self: Sync,
    {
        std::thread::scope(|scope| {
            let other = match self.start() {
                Ok(crew) => {
                    let other = scope.spawn(|| coupler(self));
                    let done = launcher(crew);
                    return (done, other.join().expect("the coupler's end reports errors"));
                }
                Err(failure) => failure,
            };
            (Err(other), Err(LinkError::Aborted))
        })
    }
}

fn finding(what: &'static str, fault: Option<String>) -> Finding {
    Finding { what, fault }
}

fn fault_of<T>(result: &Result<T, impl ToString>) -> Option<String> {
    result.as_ref().err().map(ToString::to_string)
}

/// What the coupler's end has seen of a plain run.
struct Seen {
    surface: Surface,
    first_motion_is_finite: bool,
    differs_after_restore: bool,
}

fn plain_run(trial: &Trial<'_>) -> Vec<Finding> {
    let (mut ready, mut account, mut refusal) = (None, None, None);
    let launcher = |mut crew: Processes| {
        ready = Some(expect_ready(crew.answer("solid")?)?);
        for step in 1..=STEPS {
            let passes: &[&[Part]] = match step {
                REPEATED => &[&[Part::Save, Part::Advance], &[Part::Restore, Part::Advance, Part::Record]],
                _ => &[&[Part::Advance, Part::Record]],
            };
            for parts in passes {
                let order = Order::Step { at: trial.at(step), parts: parts.to_vec() };
                crew.order("solid", &order, Call::Now)?;
                let owed = match step {
                    AHEAD => 0,
                    _ if step == AHEAD + 1 => 2,
                    _ => 1,
                };
                for _ in 0..owed {
                    let reply = crew.answer("solid")?;
                    if !matches!(&reply, Reply::Done(done) if done.admitted_dt > 0.0) {
                        refusal.get_or_insert(format!("step {step} was answered by {reply:?}"));
                    }
                }
            }
        }
        crew.ask("solid", &Order::Output { frame: 1, at: trial.at(STEPS) })?;
        account = Some(crew.ask("solid", &Order::Stop)?);
        crew.finish()
    };
    let coupler = |trial: &Trial<'_>| {
        let mut line = Line::open(&trial.names, &trial.contract)?;
        let mut seen = Seen {
            surface: line.surface.clone(),
            first_motion_is_finite: true,
            differs_after_restore: false,
        };
        seen.first_motion_is_finite = line.motion.iter().all(|value| value.is_finite());
        for step in 1..=STEPS {
            line.exchange(trial.at(step), 0.01)?;
            if step == REPEATED {
                let before = line.motion.clone();
                line.exchange(trial.at(step), 0.01)?;
                seen.differs_after_restore = before != line.motion;
            }
        }
        Ok(seen)
    };
    let (run, seen) = trial.play(launcher, coupler);
    let hands = finding("says hello, shakes hands, gives its surface and its motion", fault_of(&seen));
    if hands.fault.is_some() {
        return vec![hands];
    }
    let mut findings = vec![
        hands,
        finding("is ready, with the time step it admits", fault_of(&run).filter(|_| ready.is_none())),
    ];
    if let Ok(seen) = &seen {
        findings
            .push(finding("has the surface it has planned", surface_fault(&seen.surface, &trial.contract)));
        let again = "another motion came after the same load";
        findings.push(finding(
            "repeats a step from the state kept, bit for bit",
            seen.differs_after_restore.then(|| again.to_owned()),
        ));
    }
    findings.push(finding("answers every step with a report", refusal.or(fault_of(&run))));
    let is_account = matches!(&account, Some(Reply::Account(_)));
    let missing = || format!("the answer was {account:?}");
    findings.push(finding("gives an account when it is told to stop, and ends", (!is_account).then(missing)));
    findings
}

fn expect_ready(reply: Reply) -> Result<Ready, Failure> {
    match reply {
        Reply::Ready(ready) if ready.admitted_dt > 0.0 => Ok(ready),
        other => {
            let what = format!("expected to be ready with a positive time step, found {other:?}");
            Err(Failure::new(FailureClass::Process, "solid", "start", what))
        }
    }
}

fn surface_fault(surface: &Surface, contract: &Contract) -> Option<String> {
    let nodes = surface.node_count();
    let facets = &surface.facets;
    let faults = [
        (nodes != contract.node_count, format!("{nodes} nodes, {} were planned", contract.node_count)),
        (facets.is_empty(), "no facet".to_owned()),
        (facets.nodes.iter().any(|&node| node >= nodes), "a facet names a node that is none".to_owned()),
        (surface.areal_mass.len() != nodes, "not one areal mass per node".to_owned()),
        (surface.areal_mass.iter().any(|mass| *mass < 0.0), "a negative areal mass".to_owned()),
    ];
    faults.into_iter().find(|(is_fault, _)| *is_fault).map(|(_, what)| what)
}

/// A coupler made for another interface must be refused.
fn another_contract(mut trial: Trial<'_>) -> Finding {
    trial.contract.end_time *= 2.0;
    let (run, line) = trial.play(
        |mut crew| match crew.answer("solid") {
            Ok(reply) => {
                let what = format!("accepted: {reply:?}");
                Err(Failure::new(FailureClass::Bug, "solid", "start", what))
            }
            Err(failure) if failure.class == FailureClass::Case => Ok(()),
            Err(failure) => Err(failure),
        },
        |trial| Line::open(&trial.names, &trial.contract).map(drop),
    );
    let accepted = matches!(line, Ok(())).then(|| "the coupler's end was accepted".to_owned());
    finding("refuses a contract that differs from its own, exit 2", fault_of(&run).or(accepted))
}

/// A message of another step must end the run, not be taken for the one expected.
fn another_step(trial: &Trial<'_>) -> Finding {
    let (run, _) = trial.play(
        |mut crew| {
            expect_ready(crew.answer("solid")?)?;
            let order = Order::Step { at: trial.at(1), parts: vec![Part::Advance] };
            match crew.ask("solid", &order) {
                Ok(reply) => {
                    let what = format!("took it: {reply:?}");
                    Err(Failure::new(FailureClass::Bug, "solid", "advance", what))
                }
                // Its words say what it expected and found, in its answer or as the last it printed.
                Err(failure) if failure.to_string().contains("found 7") => Ok(()),
                Err(failure) => Err(failure),
            }
        },
        |trial| Line::open(&trial.names, &trial.contract)?.give_load(trial.at(7), 0.01),
    );
    finding("refuses the message of another step, saying so", fault_of(&run))
}

/// A run that is called off while it waits for data must end by itself.
fn called_off(trial: &Trial<'_>) -> Finding {
    let mut took = TIMEOUT;
    let (run, _) = trial.play(
        |mut crew| {
            expect_ready(crew.answer("solid")?)?;
            crew.order("solid", &Order::Step { at: trial.at(1), parts: vec![Part::Advance] }, Call::Now)?;
            let start = Instant::now();
            crew.call_off();
            took = start.elapsed();
            Ok(())
        },
        |trial| Line::open(&trial.names, &trial.contract).map(drop),
    );
    let late = (took > CALL_OFF).then(|| format!("took {:.1} s", took.as_secs_f64()));
    let forced = (took > Duration::from_millis(900)).then(|| "had to be ended by a signal".to_owned());
    finding("ends by itself when the run is called off", fault_of(&run).or(late).or(forced))
}
