//! The launcher's orders and the participants' answers: the control channel, encoded with bincode.
//!
//! The launcher gives each participant its parts of a step together, maybe before it has answered the last step, and gets
//! one answer for each; data never travels here.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::case::Scheme;
use crate::failure::Failure;
use crate::link::LinkError;
use crate::phases::PhaseTime;

/// One coupling step in time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StepTime {
    /// Number of the step, from 1.
    pub step: u64,
    /// Simulated time at its end, s.
    pub time: f64,
    /// Its length, s.
    pub dt: f64,
}

/// What the launcher tells a participant to do.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Order {
    /// Open the data links, shake hands, make the scene; answered by [`Reply::Ready`].
    Start(Start),
    /// The participant's parts of one coupling step, in this turn; answered by one [`Reply::Done`]. Between participants
    /// the data they wait for keeps the turn.
    Step {
        /// The step.
        at: StepTime,
        /// What to do in it.
        parts: Vec<Part>,
    },
    /// Write fields and flush the series; answered by [`Reply::Account`].
    Output {
        /// Number of the frame, from 0.
        frame: u32,
        /// The step and time it shows.
        at: StepTime,
    },
    /// Finish: write what is open, answer [`Reply::Account`], end.
    Stop,
}

/// One part of a coupling step, done by one participant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Part {
    /// Coupler: predict the interface motion and send it to the fluid.
    Predict,
    /// Coupler: send the fluid a better guess of the motion over the same step.
    Correct,
    /// Fluid, solid: keep the state at the start of the step.
    Save,
    /// Fluid, solid: go back to the state kept.
    Restore,
    /// Fluid, solid: take what the coupler sends, advance one coupling step, answer with the result.
    Advance,
    /// Coupler: take the fluid's load and map it.
    TakeLoad,
    /// Coupler: send the solid the load taken last.
    SendLoad,
    /// Coupler: take the solid's motion; its report says whether the step needs another pass.
    TakeMotion,
    /// Coupler: book the step in the ledger.
    Book,
    /// Fluid, solid: write the gauges of the step, which stands.
    Record,
    /// All: write the whole state at the end of the step to [`crate::state`]. Only programs get it, and the next, that
    /// have said in their check report that they keep states.
    Keep,
    /// All: take the state of the step from there and go on from it.
    TakeUp,
}

/// What both ends of a data link expect, from the plan made before the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Start {
    /// Interface nodes of the solid's surface; `None` in a scene without coupling.
    pub surface_nodes: Option<u64>,
    /// Nodes of the dummy mesh, or points the fluid offers.
    pub fluid_nodes: Option<u64>,
}

/// What a participant answers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Reply {
    /// First word of a participant on the control channel.
    Hello {
        /// Its name.
        process: String,
        /// Its process id.
        pid: u32,
    },
    /// The scene stands.
    Ready(Ready),
    /// The step, or part of a step, is done.
    Done(StepReport),
    /// Output is written, or the run is finished.
    Account(Account),
    /// It cannot go on.
    Failed(Failure),
}

/// A participant's scene, once made.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Ready {
    /// Counts for `run.json`: `water_particles`, `wall_particles`, `solid_nodes`, `solid_elements`, `markers`, ...
    pub counts: BTreeMap<String, u64>,
    /// Largest time step it admits first, s; infinite if it has no limit.
    pub admitted_dt: f64,
}

/// What a participant says after each step.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StepReport {
    /// Largest time step it admits next, s; infinite if it has no limit.
    pub admitted_dt: f64,
    /// Sub-steps it took.
    pub substeps: u32,
    /// Value shown in the progress line (first column of its first gauge), where it has one.
    pub shown: Option<(String, f64)>,
    /// Whether the two sides do not agree yet, so that the step needs another pass.
    pub is_open: bool,
    /// Coupler: the scheme of the steps after the next, where the guard changes it, as the next may be ordered already; with
    /// the report of the first step that of the next.
    pub next_scheme: Option<Scheme>,
    /// Verdict that ends the run now, although the numbers are finite (a guard set to stop).
    pub verdict: Option<String>,
}

impl StepReport {
    /// The report of a part that sets no limit.
    pub fn unlimited() -> Self {
        Self { admitted_dt: f64::INFINITY, ..Self::default() }
    }

    /// Takes in another report of the same step: the smallest time step, the most sub-steps, the first value, scheme
    /// and verdict.
    pub fn merge(&mut self, other: Self) {
        self.admitted_dt = self.admitted_dt.min(other.admitted_dt);
        self.substeps = self.substeps.max(other.substeps);
        self.is_open |= other.is_open;
        self.shown = self.shown.take().or(other.shown);
        self.next_scheme = self.next_scheme.or(other.next_scheme);
        self.verdict = self.verdict.take().or(other.verdict);
    }
}

/// What a participant has done so far.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Account {
    /// Time per phase.
    pub phases: Vec<PhaseTime>,
    /// CPU time of the process, s.
    pub cpu_s: f64,
    /// Largest resident memory, bytes.
    pub peak_rss_bytes: u64,
    /// Its part of the health table in `run.json`; keys and formulas in `docs/run-json.md`.
    pub health: BTreeMap<String, f64>,
    /// Verdicts on the run, such as `unstable_coupling`.
    pub verdicts: Vec<String>,
}

/// The bytes of an order or reply.
pub fn encode<T: Serialize>(message: &T) -> Vec<u8> {
    bincode::serde::encode_to_vec(message, bincode::config::standard())
        .expect("orders and replies hold nothing that cannot be encoded")
}

/// Reads an order or reply back.
///
/// # Errors
/// [`LinkError::Garbled`] when the bytes are none.
pub fn decode<T: DeserializeOwned>(bytes: &[u8], peer: &str) -> Result<T, LinkError> {
    match bincode::serde::decode_from_slice(bytes, bincode::config::standard()) {
        Ok((message, read)) if read == bytes.len() => Ok(message),
        Ok(_) => Err(LinkError::Garbled { peer: peer.to_owned(), what: "bytes left over".to_owned() }),
        Err(error) => Err(LinkError::Garbled { peer: peer.to_owned(), what: error.to_string() }),
    }
}
