//! The runs of a study: each in a folder of its own, a finished one never repeated.

use std::path::{Path, PathBuf};

use protocol::failure::{Failure, FailureClass};
use protocol::series::unwritable;

use super::file::{ErrorMeasure, Setting, Study};
use crate::check::{CheckError, Checked, check};
use crate::run::{self, RunOptions};
use crate::run_json::{RunJson, Status};

/// One run: a setting, once.
pub(super) struct Trial<'a> {
    /// Its setting.
    pub(super) setting: &'a Setting,
    /// From 1.
    pub(super) repetition: usize,
    /// Its folder.
    pub(super) folder: PathBuf,
    /// What came of it, once it has been run.
    pub(super) json: Option<RunJson>,
}

impl Trial<'_> {
    /// One word for tables.
    pub(super) fn status(&self) -> &'static str {
        match self.json.as_ref().map(|json| json.status) {
            None => "not run",
            Some(Status::Completed) => "completed",
            Some(Status::Interrupted) => "interrupted",
            Some(Status::Failed | Status::Running) => "failed",
        }
    }

    /// Whether it reached its end.
    pub(super) fn is_completed(&self) -> bool {
        self.json.as_ref().is_some_and(|json| json.status == Status::Completed)
    }

    /// A figure of its `run.json`, if it reached its end.
    pub(super) fn figure(&self, value: impl Fn(&RunJson) -> f64) -> Option<f64> {
        self.json.as_ref().filter(|_| self.is_completed()).map(value)
    }

    /// Its error, without sign, in the unit of the gauge; the greatest of all references the measure fits.
    pub(super) fn error(&self, measure: &ErrorMeasure) -> Option<f64> {
        let json = self.json.as_ref().filter(|_| self.is_completed())?;
        let sizes = json.errors.iter().filter(|entry| measure.fits(entry)).map(|entry| entry.value.abs());
        sizes.filter(|size| size.is_finite()).reduce(f64::max)
    }
}

/// All trials of a study below `folder`, a whole round of the settings before the next repetition, so that a busy hour
/// of the machine does not fall on one setting.
pub(super) fn trials<'a>(study: &'a Study, folder: &Path) -> Vec<Trial<'a>> {
    let rounds = (1..=study.repetitions).flat_map(|round| study.settings.iter().map(move |s| (round, s)));
    let trial = |(repetition, setting): (usize, &'a Setting)| {
        let name = format!("{}-{repetition}", slug(&setting.label));
        Trial { setting, repetition, folder: folder.join(name), json: None }
    };
    rounds.map(trial).collect()
}

/// Checks every setting before anything starts.
///
/// # Errors
/// The first setting with mistakes, with its label.
pub(super) fn check_all(study: &Study) -> Result<Vec<Checked>, (String, CheckError)> {
    let checked = |setting: &Setting| {
        let options: Vec<_> = study.common.iter().chain(&setting.options).cloned().collect();
        check(setting.case.as_ref().unwrap_or(&study.case), &options)
            .map_err(|error| (setting.label.clone(), error))
    };
    study.settings.iter().map(checked).collect()
}

/// What an earlier start of the study left of this trial, if it reached its end with the same case and threads.
pub(super) fn finished(folder: &Path, checked: &Checked, threads: usize) -> Option<RunJson> {
    let json = RunJson::read(folder).ok()?;
    let text = std::fs::read_to_string(folder.join("case.lock.toml")).ok()?;
    let mut lock: toml::Table = toml::from_str(&text).ok()?;
    let mut wanted = checked.lock.clone();
    // The run keeps copies of the curves and names these.
    lock.remove("reference");
    wanted.remove("reference");
    (json.status == Status::Completed && json.threads == threads && lock == wanted).then_some(json)
}

/// Runs a trial, in place of what may be left of an earlier attempt. A numerical failure is no error here.
///
/// # Errors
/// Folders or resources; the user's interrupt.
pub(super) fn carry_out(folder: &Path, checked: &Checked, threads: usize) -> Result<RunJson, Failure> {
    if folder.join("case.lock.toml").exists() {
        std::fs::remove_dir_all(folder).map_err(|error| unwritable(folder, &error))?;
    }
    let outcome = run::run(checked, &RunOptions { out: Some(folder.to_owned()), threads, resumed: None })?;
    match outcome.failure {
        Some(failure) if matches!(failure.class, FailureClass::Interrupted | FailureClass::Resource) => {
            Err(failure)
        }
        Some(failure) => {
            eprintln!("  {failure}");
            Ok(outcome.json)
        }
        None => Ok(outcome.json),
    }
}

/// A label as a folder name.
fn slug(label: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || ".+_".contains(c) { c } else { '-' };
    let slug: String = label.chars().map(plain).collect();
    slug.split('-').filter(|part| !part.is_empty()).collect::<Vec<_>>().join("-")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_become_folder_names() {
        assert_eq!(slug("spacing 0.003, element hex8_eas9"), "spacing-0.003-element-hex8_eas9");
    }
}
