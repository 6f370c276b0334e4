//! One mistake in a case file: where, what, what is allowed, and what to do.

use serde::{Deserialize, Serialize};

/// Where a mistake stands.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Place {
    /// In the file, byte range and line (from 1).
    File {
        /// First byte.
        start: usize,
        /// One past the last byte.
        end: usize,
        /// Line, from 1.
        line: usize,
    },
    /// In the case this one is based on.
    Base {
        /// As the case names it.
        file: String,
        /// Line, from 1.
        line: usize,
    },
    /// In a `--set` option, given whole.
    Option(String),
    /// In the scene as a whole.
    Scene,
}

/// One mistake.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Diagnostic {
    /// Where.
    pub place: Place,
    /// The key, with its path, such as `fluid.spacing`.
    pub key: String,
    /// What is wrong, with the offending value.
    pub message: String,
    /// What is allowed; empty if it does not apply.
    pub allowed: String,
    /// What to do; empty if the range says it all.
    pub hint: String,
}

impl std::fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.place {
            Place::File { line, .. } => write!(f, "line {line}: ")?,
            Place::Base { file, line } => write!(f, "{file}, line {line}: ")?,
            Place::Option(text) => write!(f, "--set {text}: ")?,
            Place::Scene => {}
        }
        write!(f, "{}: {}", self.key, self.message)?;
        if !self.allowed.is_empty() {
            write!(f, " (allowed: {})", self.allowed)?;
        }
        if !self.hint.is_empty() {
            write!(f, ". {}", self.hint)?;
        }
        Ok(())
    }
}
