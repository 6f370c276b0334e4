//! `run.json`: how a run stands, written at the start, at each output and at the end, also after a failure.

use std::collections::BTreeMap;
use std::path::Path;

use protocol::case::LeftOut;
use protocol::control::Account;
use protocol::failure::Failure;
use protocol::phases::PhaseTime;
use serde::{Deserialize, Serialize};

use crate::compare::ErrorEntry;
use crate::folder;
use crate::resume::Resumption;

/// Where a run stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Under way (or its launcher was killed).
    Running,
    /// The end of the time was reached.
    Completed,
    /// It could not go on.
    Failed,
    /// The user stopped it.
    Interrupted,
}

/// The run whose state another one goes on from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Continued {
    /// Its folder.
    pub run: String,
    /// Coupling steps it had done.
    pub step: u64,
    /// Time of the state, s.
    pub time_s: f64,
}

impl From<&Resumption> for Continued {
    fn from(resumed: &Resumption) -> Self {
        let run = resumed.run.canonicalize().unwrap_or_else(|_| resumed.run.clone());
        Self { run: run.display().to_string(), step: resumed.moment.step, time_s: resumed.moment.time }
    }
}

/// One process of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ProcessEntry {
    /// Its name.
    pub name: String,
    /// Wall time since the launcher started it, s.
    pub wall_s: f64,
    /// CPU time of all its threads, s.
    pub cpu_s: f64,
    /// Largest resident memory, bytes.
    pub peak_rss_bytes: u64,
    /// Time per phase; waiting for orders is the phase `wait`.
    pub phases: Vec<PhaseTime>,
}

/// The whole file; every `health` key is defined in `docs/run-json.md`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunJson {
    /// Name of the case.
    pub case: String,
    /// The case file it was made from.
    pub case_file: String,
    /// Version of Tidewall.
    pub tidewall: String,
    /// Where it stands.
    pub status: Status,
    /// Exit code; 0 while it runs.
    pub exit_code: u8,
    /// 2 or 3.
    pub dimension: usize,
    /// Counts by name.
    pub counts: BTreeMap<String, u64>,
    /// What it has gone on from, if it did not begin at time 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub continued: Option<Continued>,
    /// Coupling steps done, those before the state it has gone on from included.
    pub steps: u64,
    /// Simulated time, s.
    pub simulated_s: f64,
    /// Wall time, s.
    pub wall_s: f64,
    /// CPU time of all processes, s.
    pub cpu_s: f64,
    /// Threads each solver computes with.
    pub threads: usize,
    /// The launcher's time loop: `start`, `step`, `output`.
    #[serde(default)]
    pub time_loop: Vec<PhaseTime>,
    /// The processes.
    pub processes: Vec<ProcessEntry>,
    /// What the scene did not need.
    pub left_out: Vec<LeftOut>,
    /// Comparisons with the references of the case.
    pub errors: Vec<ErrorEntry>,
    /// Health by name.
    pub health: BTreeMap<String, f64>,
    /// Verdicts, such as `unstable_coupling`.
    pub verdicts: Vec<String>,
    /// The first cause, if it failed.
    pub failure: Option<Failure>,
}

impl RunJson {
    /// Takes the accounts of all participants, by display name.
    pub fn take_accounts(&mut self, wall_s: f64, accounts: impl Iterator<Item = (String, Account)>) {
        self.verdicts.clear();
        for (name, account) in accounts {
            self.health.extend(account.health);
            for verdict in account.verdicts {
                if !self.verdicts.contains(&verdict) {
                    self.verdicts.push(verdict);
                }
            }
            let entry = ProcessEntry {
                name,
                wall_s,
                cpu_s: account.cpu_s,
                peak_rss_bytes: account.peak_rss_bytes,
                phases: account.phases,
            };
            match self.processes.iter_mut().find(|known| known.name == entry.name) {
                Some(known) => *known = entry,
                None => self.processes.push(entry),
            }
        }
        self.cpu_s = self.processes.iter().map(|process| process.cpu_s).sum();
    }

    /// Largest resident memory of all processes together, bytes.
    pub fn peak_rss_bytes(&self) -> f64 {
        self.processes.iter().map(|process| process.peak_rss_bytes as f64).sum()
    }

    /// Writes it into the run folder, whole or not at all.
    ///
    /// # Errors
    /// The disk is full or the folder gone.
    pub fn write(&self, folder: &Path) -> Result<(), Failure> {
        let text = serde_json::to_string_pretty(self).expect("run.json holds nothing JSON cannot");
        folder::write(&folder.join("run.json"), &text)
    }

    /// Reads it back.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn read(folder: &Path) -> Result<Self, String> {
        let path = folder.join("run.json");
        let text = std::fs::read_to_string(&path)
            .map_err(|error| format!("cannot read {}: {error}", path.display()))?;
        serde_json::from_str(&text).map_err(|error| format!("{} is no run.json: {error}", path.display()))
    }
}
