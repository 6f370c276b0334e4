//! `tidewall resume`: a new run that goes on from the state another one has kept.
//!
//! The state is copied into the new run folder, where the participants look for it. Of the case everything may change
//! that leaves particles and mesh as they are; what may not is found before anything starts.

use std::path::{Path, PathBuf};

use protocol::failure::{Failure, FailureClass};
use protocol::series::unwritable;
use protocol::state::{self, Stamp};

use crate::check::Checked;
use crate::time_step::Moment;

/// The launcher's own file of a state, written last.
const ROLE: &str = "time_loop";

/// Keys of the case that make particles and mesh, and what the state is the state of. A section or a key.
const FIXED: [&str; 28] = [
    "case.dimension",
    "domain",
    "obstacle",
    "fluid.program",
    "fluid.density",
    "fluid.spacing",
    "fluid.region",
    "fluid.flow",
    "fluid.carve",
    "fluid.jitter",
    "fluid.weakly_compressible",
    "solid.model",
    "solid.program",
    "solid.mesh",
    "solid.min",
    "solid.max",
    "solid.elements",
    "solid.element",
    "solid.wet",
    "solid.density",
    "solid.young_modulus",
    "solid.poisson_ratio",
    "solid.material",
    "solid.hardening",
    "solid.kinematics",
    "solid.plane",
    "coupling.fluid_side",
    "coupling.dummy_elements",
];

/// The state of a run to go on from.
#[derive(Debug, Clone, PartialEq)]
pub struct Resumption {
    /// The run it is of.
    pub run: PathBuf,
    /// When it is.
    pub moment: Moment,
}

impl Resumption {
    /// The last whole state of a run.
    ///
    /// # Errors
    /// [`FailureClass::Case`]: there is none, or its file is damaged.
    pub fn find(run: &Path) -> Result<Self, Failure> {
        let steps = std::fs::read_dir(state::folder(run)).into_iter().flatten().flatten();
        let steps = steps.filter_map(|entry| entry.file_name().to_string_lossy().parse().ok());
        let whole = |step: &u64| state::file(run, *step, ROLE).exists();
        let Some(step) = steps.filter(whole).max() else {
            let what = format!("{} holds no state to go on from", run.display());
            return Err(refused(what).with_hint("Runs keep one with --set output.state=true."));
        };
        let stamp = Stamp::new(step, 0.0, &[]);
        Ok(Self { run: run.to_owned(), moment: state::read(run, ROLE, &stamp)? })
    }

    /// Refuses what the state does not fit: files that are not whole, programs that keep none, another scene, an end that
    /// is reached already.
    ///
    /// # Errors
    /// [`FailureClass::Case`].
    pub fn check(&self, checked: &Checked) -> Result<(), Failure> {
        let Moment { step, time, .. } = self.moment;
        for program in &checked.programs {
            let path = state::file(&self.run, step, program.role);
            let stamp = state::stamp(&path)?;
            if stamp.step != step || stamp.time.to_bits() != time.to_bits() {
                let what = format!(
                    "{} is of step {}, t = {} s; the launcher's of step {step}, t = {time} s",
                    path.display(),
                    stamp.step,
                    stamp.time
                );
                return Err(refused(what));
            }
        }
        let end = checked.shared.time.end;
        if time >= end * (1.0 - 1e-9) {
            let what = format!("{} has reached t = {time} s, and the end is {end} s", self.run.display());
            return Err(refused(what).with_hint("Give a later end with --until."));
        }
        self.check_scene(&checked.lock)
    }

    fn check_scene(&self, lock: &toml::Table) -> Result<(), Failure> {
        let path = lock_of(&self.run);
        let text = std::fs::read_to_string(&path)
            .map_err(|error| refused(format!("cannot read {}: {error}", path.display())))?;
        let kept: toml::Table = toml::from_str(&text)
            .map_err(|error| refused(format!("{} is no case: {}", path.display(), error.message())))?;
        let differences: Vec<_> = FIXED.iter().filter_map(|key| difference(key, &kept, lock)).collect();
        if differences.is_empty() {
            return Ok(());
        }
        let what =
            format!("the state of {} is of another scene: {}", self.run.display(), differences.join("; "));
        Err(refused(what).with_hint("Only what leaves particles and mesh as they are may change."))
    }

    /// Copies the state into the folder of the new run.
    ///
    /// # Errors
    /// [`FailureClass::Resource`] when the disk is full.
    pub fn copy_into(&self, folder: &Path, roles: impl Iterator<Item = &'static str>) -> Result<(), Failure> {
        for role in roles.chain([ROLE]) {
            let [from, to] = [&self.run, folder].map(|run| state::file(run, self.moment.step, role));
            std::fs::create_dir_all(to.parent().unwrap_or(folder))
                .and_then(|()| std::fs::copy(&from, &to))
                .map_err(|error| unwritable(&to, &error))?;
        }
        Ok(())
    }
}

/// Completes the state of a moment in a run folder; those before it are no longer needed.
///
/// # Errors
/// [`FailureClass::Resource`] when the disk is full.
pub fn complete(run: &Path, moment: Moment) -> Result<(), Failure> {
    let stamp = Stamp::new(moment.step, moment.time, &[]);
    state::write(run, ROLE, &stamp, &moment)?;
    let entries = std::fs::read_dir(state::folder(run)).into_iter().flatten().flatten();
    let is_older = |path: &PathBuf| path.file_name().is_none_or(|name| *name != *moment.step.to_string());
    for older in entries.map(|entry| entry.path()).filter(is_older) {
        std::fs::remove_dir_all(&older).map_err(|error| unwritable(&older, &error))?;
    }
    Ok(())
}

/// The case a run is resumed with, unless another one is given.
pub fn lock_of(run: &Path) -> PathBuf {
    run.join("case.lock.toml")
}

/// Where a key of two cases differs, in words.
fn difference(key: &str, kept: &toml::Table, new: &toml::Table) -> Option<String> {
    let value = |table: &toml::Table| match key.split_once('.') {
        Some((section, key)) => table.get(section)?.get(key).cloned(),
        None => table.get(key).cloned(),
    };
    let [kept, new] = [kept, new].map(value);
    let shown = |value: &Option<toml::Value>| match value {
        Some(toml::Value::Table(_)) => "a section".to_owned(),
        Some(value) => value.to_string(),
        None => "absent".to_owned(),
    };
    (kept != new).then(|| format!("{key} expected {}, found {}", shown(&kept), shown(&new)))
}

fn refused(what: String) -> Failure {
    Failure::new(FailureClass::Case, "tidewall", "resume", what)
}
