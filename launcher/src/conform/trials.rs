//! What is tried, one run of the program each, the same for every role.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use protocol::control::{Order, Part, Ready, Reply, Start, StepTime};
use protocol::failure::{Failure, FailureClass};
use protocol::interface::{Contract, Response};
use protocol::ipc::IpcTransport;
use protocol::link::{Item, Link, LinkError, Transport};
use protocol::names::{RunId, RunNames};

use super::forger::{FORGERIES, Forger, Forgery};
use super::line::{Line, Role, Terms};
use super::{Bench, Finding, SILENCE, TIMEOUT, orphan};
use crate::processes::{Call, Crew, Processes};

/// Steps of the plain run.
const STEPS: u64 = 10;
/// The step that is passed over twice.
const REPEATED: u64 = 5;
/// The step that is answered after the next one is ordered.
const AHEAD: u64 = 8;
/// Between two looks at what the other end has done.
const PAUSE: Duration = Duration::from_millis(5);
/// From the call-off to the end of the process.
const CALL_OFF: Duration = Duration::from_secs(2);
/// Of a program that is to give up a silent peer, from its first wait to its last word.
const GIVING_UP: Duration = Duration::from_secs(5);

/// What both ends of a trial are told.
struct Trial<'b> {
    bench: &'b Bench,
    names: RunNames,
    contract: Contract,
    response: Response,
}

pub(super) fn all(bench: &Bench) -> Result<Vec<Finding>, Failure> {
    let mut findings = plain_run(&Trial::new(bench)?);
    // A program that does not come up fails all the rest for the same reason.
    if findings[0].fault.is_some() {
        return Ok(findings);
    }
    if bench.role != Role::Solid {
        let responses = [Response::Given, Response::Prescribed];
        let trials = responses.map(|response| Trial::new(bench).map(|trial| Trial { response, ..trial }));
        findings.push(other_responses(trials)?);
    }
    findings.push(another_contract(Trial::new(bench)?));
    for forgery in &FORGERIES {
        findings.push(forged_message(&Trial::new(bench)?, forgery));
    }
    findings.push(called_off(&Trial::new(bench)?));
    findings.push(silent_coupler(&Trial::new(bench)?));
    let what = "ends when its parent dies";
    findings.push(Finding { what, fault: orphan::fault(bench)? });
    Ok(findings)
}

impl<'b> Trial<'b> {
    fn new(bench: &'b Bench) -> Result<Self, Failure> {
        let refuse = |what: String| Failure::new(FailureClass::Resource, "tidewall", "conform", what);
        let id = RunId::random().map_err(|error| refuse(format!("cannot draw a run id: {error}")))?;
        let shared = &bench.checked.shared;
        let lock = std::fs::read(bench.lock());
        let lock = lock.map_err(|error| refuse(format!("cannot read the case back: {error}")))?;
        let contract = Contract {
            dimension: shared.header.dimension,
            node_count: bench.node_count,
            end_time: shared.time.end,
            scene: u8::checksum(&lock),
        };
        Ok(Self { bench, names: RunNames::of(id), contract, response: Response::Robin })
    }

    fn at(&self, step: u64) -> StepTime {
        let dt = self.bench.checked.shared.time.max_dt;
        StepTime { step, time: dt * step as f64, dt }
    }

    fn process(&self) -> &'static str {
        self.bench.role.name()
    }

    fn terms(&self) -> Terms<'_> {
        let outline = self.bench.checked.shared.solid.as_ref().expect("a coupled scene has a solid");
        let Self { contract, response, .. } = *self;
        Terms { role: self.bench.role, contract, outline, response }
    }

    fn connect(&self) -> Result<Box<dyn Link<f64>>, LinkError> {
        let mut transport = IpcTransport::new(&self.names, "coupler", TIMEOUT)?;
        transport.connect(self.process(), self.terms().capacity())
    }

    /// The coupler's end as it should be.
    fn line(&self) -> Result<Box<dyn Line>, LinkError> {
        self.terms().shake_hands(self.connect()?)
    }

    fn start(&self) -> Result<Processes, Failure> {
        let mut crew = self.bench.start(&self.names)?;
        let nodes = Some(self.contract.node_count as u64);
        let start = Order::Start(Start { surface_nodes: nodes, fluid_nodes: nodes });
        crew.order(self.process(), &start, Call::Now)?;
        Ok(crew)
    }

    /// The answer to the order of one step.
    fn ask(&self, crew: &mut Processes, step: u64) -> Result<Reply, Failure> {
        crew.ask(self.process(), &Order::Step { at: self.at(step), parts: vec![Part::Advance] })
    }

    fn expect_ready(&self, crew: &mut Processes) -> Result<Ready, Failure> {
        match crew.answer(self.process())? {
            Reply::Ready(ready) if ready.admitted_dt > 0.0 => Ok(ready),
            other => {
                let what = format!("expected to be ready with a positive time step, found {other:?}");
                Err(Failure::new(FailureClass::Process, self.process(), "start", what))
            }
        }
    }

    /// Takes the failure that is to come; a reply instead is a fault.
    fn expect_refusal(&self, answer: Result<Reply, Failure>) -> Result<Failure, Failure> {
        match answer {
            Err(failure) => Ok(failure),
            Ok(reply) => {
                let what = format!("took it: {reply:?}");
                Err(Failure::new(FailureClass::Bug, self.process(), "advance", what))
            }
        }
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
    offer_fault: Option<String>,
    /// Why the exchange ended before its time.
    exchange: Result<(), LinkError>,
    differs_after_restore: bool,
}

fn plain_run(trial: &Trial<'_>) -> Vec<Finding> {
    let (mut ready, mut account, mut refusal) = (None, None, None);
    let (role, process) = (trial.bench.role, trial.process());
    let launcher = |mut crew: Processes| {
        ready = Some(trial.expect_ready(&mut crew)?);
        for step in 1..=STEPS {
            let passes: &[&[Part]] = match step {
                REPEATED => &[&[Part::Save, Part::Advance], &[Part::Restore, Part::Advance, Part::Record]],
                _ => &[&[Part::Advance, Part::Record]],
            };
            for parts in passes {
                let order = Order::Step { at: trial.at(step), parts: parts.to_vec() };
                crew.order(process, &order, Call::Now)?;
                let owed = match step {
                    AHEAD => 0,
                    _ if step == AHEAD + 1 => 2,
                    _ => 1,
                };
                for _ in 0..owed {
                    let reply = crew.answer(process)?;
                    if !matches!(&reply, Reply::Done(done) if done.admitted_dt > 0.0) {
                        refusal.get_or_insert(format!("step {step} was answered by {reply:?}"));
                    }
                }
            }
        }
        crew.ask(process, &Order::Output { frame: 1, at: trial.at(STEPS) })?;
        account = Some(crew.ask(process, &Order::Stop)?);
        crew.finish()
    };
    let (run, seen) = trial.play(launcher, watch_plain_run);
    let called_off = matches!(seen, Err(LinkError::Aborted));
    let hands = finding(role.handshake(), if called_off { fault_of(&run) } else { fault_of(&seen) });
    if hands.fault.is_some() {
        return vec![hands];
    }
    let mut findings = vec![
        hands,
        finding("is ready, with the time step it admits", fault_of(&run).filter(|_| ready.is_none())),
    ];
    if let Ok(seen) = seen {
        findings.extend(role.offer().map(|what| finding(what, seen.offer_fault)));
        let what = "answers every message with as many values as it must, all finite";
        findings.push(finding(what, fault_of(&seen.exchange)));
        let again = "another answer came to the same message";
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

fn watch_plain_run(trial: &Trial<'_>) -> Result<Seen, LinkError> {
    let mut line = trial.line()?;
    let mut seen = Seen { offer_fault: line.fault(), exchange: Ok(()), differs_after_restore: false };
    seen.exchange = (1..=STEPS).try_for_each(|step| {
        line.exchange(trial.at(step))?;
        if step == REPEATED {
            let before = bits(line.answer());
            line.exchange(trial.at(step))?;
            seen.differs_after_restore = before != bits(line.answer());
        }
        Ok(())
    });
    Ok(seen)
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// A fluid must take every kind of motion.
fn other_responses<'b>(trials: [Result<Trial<'b>, Failure>; 2]) -> Result<Finding, Failure> {
    let what = "takes a motion as given, and one that is known beforehand";
    for trial in trials {
        let trial = trial?;
        let (run, line) = trial.play(
            |mut crew| {
                trial.expect_ready(&mut crew)?;
                (1..=STEPS / 2).try_for_each(|step| trial.ask(&mut crew, step).map(drop))
            },
            |trial| {
                let mut line = trial.line()?;
                (1..=STEPS / 2).try_for_each(|step| line.exchange(trial.at(step)))
            },
        );
        let fault = fault_of(&run).or(fault_of(&line));
        if let Some(fault) = fault {
            return Ok(finding(what, Some(format!("{:?}: {fault}", trial.response))));
        }
    }
    Ok(finding(what, None))
}

/// A coupler made for another interface must be refused.
fn another_contract(mut trial: Trial<'_>) -> Finding {
    trial.contract.end_time *= 2.0;
    let (run, line) = trial.play(
        |mut crew| match trial.expect_ready(&mut crew) {
            Ok(reply) => {
                let what = format!("accepted: {reply:?}");
                Err(Failure::new(FailureClass::Bug, trial.process(), "start", what))
            }
            Err(failure) if failure.class == FailureClass::Case => Ok(()),
            Err(failure) => Err(failure),
        },
        |trial| trial.line().map(drop),
    );
    let accepted = matches!(line, Ok(())).then(|| "the coupler's end was accepted".to_owned());
    finding("refuses a contract that differs from its own, exit 2", fault_of(&run).or(accepted))
}

/// A bad message must end the run, not be taken for the one expected.
fn forged_message(trial: &Trial<'_>, forgery: &Forgery) -> Finding {
    let is_sent = AtomicBool::new(false);
    let refused = |crew: &mut Processes| {
        trial.expect_ready(crew)?;
        // The program reads it when it is ordered to, whatever is done to it meanwhile.
        let start = Instant::now();
        while !is_sent.load(Ordering::Relaxed) && start.elapsed() < TIMEOUT {
            std::thread::sleep(PAUSE);
        }
        let start = Instant::now();
        let refusal = trial.expect_refusal(trial.ask(crew, 1))?;
        // Its words say what it expected and found, in its answer or as the last it printed.
        let is_said = refusal.to_string().contains(forgery.words);
        if is_said && start.elapsed() < TIMEOUT { Ok(()) } else { Err(refusal) }
    };
    let is_over = AtomicBool::new(false);
    let (run, line) = trial.play(
        |mut crew| {
            let done = refused(&mut crew);
            is_over.store(true, Ordering::Relaxed);
            done
        },
        |trial| {
            let link = Box::new(Forger { link: trial.connect()?, names: &trial.names, forgery });
            let mut line = trial.terms().shake_hands(link)?;
            line.give(trial.at(1))?;
            is_sent.store(true, Ordering::Relaxed);
            // What is sent goes with its sender.
            while !is_over.load(Ordering::Relaxed) {
                std::thread::sleep(PAUSE);
            }
            Ok(())
        },
    );
    finding(forgery.what, fault_of(&run).or(fault_of(&line)))
}

/// A run that is called off while it waits for data must end by itself.
fn called_off(trial: &Trial<'_>) -> Finding {
    let mut took = TIMEOUT;
    let (run, _) = trial.play(
        |mut crew| {
            trial.expect_ready(&mut crew)?;
            let order = Order::Step { at: trial.at(1), parts: vec![Part::Advance] };
            crew.order(trial.process(), &order, Call::Now)?;
            let start = Instant::now();
            crew.call_off();
            took = start.elapsed();
            Ok(())
        },
        |trial| trial.line().map(drop),
    );
    let late = (took > CALL_OFF).then(|| format!("took {:.1} s", took.as_secs_f64()));
    let forced = (took > Duration::from_millis(900)).then(|| "had to be ended by a signal".to_owned());
    finding("ends by itself when the run is called off", fault_of(&run).or(late).or(forced))
}

/// A coupler that falls silent, or is gone, must be given up.
fn silent_coupler(trial: &Trial<'_>) -> Finding {
    let (run, _) = trial.play(
        |mut crew| {
            trial.expect_ready(&mut crew)?;
            let start = Instant::now();
            let refusal = trial.expect_refusal(trial.ask(&mut crew, 1))?;
            if start.elapsed() < SILENCE + GIVING_UP { Ok(()) } else { Err(refusal) }
        },
        |trial| trial.line().map(drop),
    );
    finding("gives up a coupler that is silent for longer than --silence", fault_of(&run))
}
