//! What every participant (fluid, solid, coupler, stub) shares: the trait, the loop over orders, the main program.
//!
//! A participant is a program that answers `--check CASE` with a [`CheckReport`] and obeys orders on its control link
//! until [`Order::Stop`]. `solid-rigid` is the shortest example.

use std::panic::AssertUnwindSafe;
use std::path::PathBuf;
use std::time::Instant;

use crate::case::{CaseFile, CheckReport};
use crate::control::{Account, Order, Part, Ready, Reply, Start, StepReport, StepTime, decode, encode};
use crate::failure::{Failure, FailureClass};
use crate::header::{Header, Kind};
use crate::link::{Expect, Link, LinkError, Transport};
pub use crate::program::main;

/// One side of a coupled run. A participant implements the orders its role gets; the others are refused.
pub trait Participant {
    /// Opens the data links, shakes hands, makes the scene.
    ///
    /// # Errors
    /// Whatever keeps the run from starting.
    fn start(&mut self, start: &Start, transport: &mut dyn Transport) -> Result<Ready, Failure>;

    /// Does one part of a coupling step; see [`Part`] for what each means and whose it is.
    ///
    /// # Errors
    /// Whatever ends the run; [`not_my_part`] for a part of another role.
    fn part(&mut self, part: Part, at: StepTime) -> Result<StepReport, Failure>;

    /// Writes fields and flushes the series; called once more at the end with the last step.
    ///
    /// # Errors
    /// Files that cannot be written.
    fn output(&mut self, frame: u32, at: StepTime) -> Result<(), Failure>;

    /// Phases, health and verdicts so far; CPU time and memory are filled in by the caller.
    fn account(&self) -> Account;
}

/// The failure of a participant that got a part it does not play.
pub fn not_my_part(part: Part) -> Failure {
    Failure::new(
        FailureClass::Bug,
        "participant",
        "step",
        format!("{part:?} is not a part of this participant"),
    )
}

/// Where and how a participant runs.
#[derive(Debug, Clone)]
pub struct Context {
    /// The run folder.
    pub folder: PathBuf,
    /// Threads it may use.
    pub threads: usize,
    /// CRC-32 of the resolved case, for the [`crate::interface::Contract`].
    pub scene: u32,
}

/// A participant as a program.
#[derive(Clone, Copy)]
pub struct Program {
    /// Name of the executable and of the process in every message.
    pub name: &'static str,
    /// Its place in the run: `fluid`, `solid` or `coupler`; the name its peers know it by.
    pub role: &'static str,
    /// One line for `--help`.
    pub about: &'static str,
    /// Checks the program's part of a case.
    pub check: fn(&CaseFile) -> CheckReport,
    /// Makes the participant from a case that passed the check.
    pub build: Build,
}

/// Makes a participant from a case that passed the check.
pub type Build = fn(&CaseFile, &Context) -> Result<Box<dyn Participant>, Failure>;

/// A participant that could not be made: it says why when it is told to start.
pub(crate) struct Stillborn(pub(crate) Failure);

impl Participant for Stillborn {
    fn start(&mut self, _: &Start, _: &mut dyn Transport) -> Result<Ready, Failure> {
        Err(self.0.clone())
    }

    fn part(&mut self, _: Part, _: StepTime) -> Result<StepReport, Failure> {
        Err(self.0.clone())
    }

    fn output(&mut self, _: u32, _: StepTime) -> Result<(), Failure> {
        Err(self.0.clone())
    }

    fn account(&self) -> Account {
        Account::default()
    }
}

/// Obeys the launcher's orders until it says stop. A failure is reported to the launcher and returned.
///
/// # Errors
/// The participant's own failure, or the loss of the launcher.
pub fn serve(
    name: &str,
    participant: &mut dyn Participant,
    transport: &mut dyn Transport,
) -> Result<(), Failure> {
    let lost = |error: LinkError| error.into_failure(name, 0, 0.0, "control");
    let mut control = transport.control().map_err(lost)?;
    reply(&mut *control, 0, &Reply::Hello { process: name.to_owned(), pid: std::process::id() })
        .map_err(lost)?;
    let mut waited_s = 0.0;
    for sequence in 1.. {
        let start = Instant::now();
        let order = receive_order(&mut *control, sequence).map_err(lost)?;
        waited_s += start.elapsed().as_secs_f64();
        let last = order == Order::Stop;
        let result = std::panic::catch_unwind(AssertUnwindSafe(|| {
            obey(participant, &order, transport, (sequence, waited_s))
        }));
        let result = result
            .unwrap_or_else(|panic| Err(Failure::new(FailureClass::Bug, name, "any", panic_text(&*panic))));
        match result {
            Ok(answer) => reply(&mut *control, sequence, &answer).map_err(lost)?,
            Err(failure) => {
                let failure = Failure { process: name.to_owned(), ..failure };
                let _ = reply(&mut *control, sequence, &Reply::Failed(failure.clone()));
                return Err(failure);
            }
        }
        if last {
            break;
        }
    }
    Ok(())
}

fn obey(
    participant: &mut dyn Participant,
    order: &Order,
    transport: &mut dyn Transport,
    (calls, waited_s): (u64, f64),
) -> Result<Reply, Failure> {
    Ok(match order {
        Order::Start(start) => Reply::Ready(participant.start(start, transport)?),
        Order::Step { at, parts } => {
            let mut done = StepReport::unlimited();
            for part in parts {
                done.merge(participant.part(*part, *at)?);
            }
            Reply::Done(done)
        }
        Order::Output { frame, at } => {
            participant.output(*frame, *at)?;
            Reply::Account(full_account(participant, calls, waited_s))
        }
        Order::Stop => Reply::Account(full_account(participant, calls, waited_s)),
    })
}

fn full_account(participant: &dyn Participant, calls: u64, waited_s: f64) -> Account {
    let mut account = participant.account();
    account.phases.push(crate::phases::PhaseTime { name: "wait".to_owned(), calls, wall_s: waited_s });
    account.cpu_s = crate::usage::cpu_seconds();
    account.peak_rss_bytes = crate::usage::peak_rss_bytes();
    account
}

fn reply(control: &mut dyn Link<u8>, sequence: u64, reply: &Reply) -> Result<(), LinkError> {
    let bytes = encode(reply);
    let header = Header::new(Kind::Reply, sequence, 0.0, 0.0);
    control.send(header, bytes.len(), &mut |target| target.copy_from_slice(&bytes))
}

fn receive_order(control: &mut dyn Link<u8>, sequence: u64) -> Result<Order, LinkError> {
    let mut order = None;
    let peer = control.peer().to_owned();
    let expect = Expect { kind: Kind::Order, step: sequence, count: None };
    // An order may be long in coming while the others compute; if the launcher dies, so does this process.
    while let Err(error) = control.receive(expect, &mut |_, bytes| order = Some(decode(bytes, &peer))) {
        if !matches!(error, LinkError::PeerSilent { .. }) {
            return Err(error);
        }
    }
    order.expect("a message that was received was read")
}

fn panic_text(panic: &(dyn std::any::Any + Send)) -> String {
    let text =
        panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    format!("bug: {}", text.unwrap_or("panic without a message"))
}
