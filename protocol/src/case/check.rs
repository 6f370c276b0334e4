//! What a program says about a case before anything starts: `PROGRAM --check CASE` prints it as JSON.

use serde::{Deserialize, Serialize};

use super::diagnostic::Diagnostic;
use super::file::CaseFile;
use super::key::KeyDoc;

/// Something the scene does not need, and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOut {
    /// What is not started, allocated or run.
    pub what: String,
    /// Why.
    pub why: String,
}

impl LeftOut {
    /// One entry.
    pub fn new(what: &str, why: &str) -> Self {
        Self { what: what.to_owned(), why: why.to_owned() }
    }
}

/// One line of the plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanFigure {
    /// Machine name, such as `water_particles`, `memory_bytes`, `dt_limit_s`, `interface_nodes`.
    pub name: String,
    /// The number.
    pub value: f64,
    /// Words for people; empty if name and number say it all.
    pub remark: String,
}

impl PlanFigure {
    /// One line.
    pub fn new(name: &str, value: f64, remark: impl Into<String>) -> Self {
        Self { name: name.to_owned(), value, remark: remark.into() }
    }
}

/// A program's answer to `--check`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct CheckReport {
    /// The program.
    pub program: String,
    /// Version of the protocol it speaks.
    pub protocol_version: u32,
    /// All mistakes in the sections it reads.
    pub diagnostics: Vec<Diagnostic>,
    /// The values it read, defaults filled in.
    pub resolved: toml::Table,
    /// The keys it knows.
    pub keys: Vec<KeyDoc>,
    /// Its part of the plan.
    pub plan: Vec<PlanFigure>,
    /// What the scene does not need of it.
    pub left_out: Vec<LeftOut>,
    /// Whether it can write its whole state and take it up again.
    #[serde(default)]
    pub keeps_state: bool,
}

impl CheckReport {
    /// The report on a case after all sections are read.
    pub fn new(program: &str, case: &CaseFile, plan: Vec<PlanFigure>, left_out: Vec<LeftOut>) -> Self {
        Self {
            program: program.to_owned(),
            protocol_version: crate::PROTOCOL_VERSION,
            diagnostics: case.diagnostics(),
            resolved: case.resolved(),
            keys: case.keys(),
            plan,
            left_out,
            keeps_state: false,
        }
    }

    /// The same report of a program that can write its whole state and take it up again.
    pub fn with_state(self) -> Self {
        Self { keeps_state: true, ..self }
    }

    /// A figure of the plan.
    pub fn figure(&self, name: &str) -> Option<f64> {
        self.plan.iter().find(|figure| figure.name == name).map(|figure| figure.value)
    }
}
