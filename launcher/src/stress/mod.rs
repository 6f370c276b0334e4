//! `tidewall stress`: the stability suite. Every case says in its `[stress]` what it promises; here it is run, judged and
//! reported. See `docs/stress.md`.

pub mod promise;
mod table;
mod trial;
mod verdict;

use std::path::{Path, PathBuf};

use protocol::case::CaseFile;
use protocol::failure::{Failure, FailureClass};

use crate::folder;
use promise::Promise;
use table::Row;

/// Which cases, and how they are run.
#[derive(Debug)]
pub struct StressOptions {
    /// Names of cases; all if empty.
    pub names: Vec<String>,
    /// Only the short half.
    pub short: bool,
    /// Folder of the cases.
    pub cases: PathBuf,
    /// Folder of the report and the runs; the next free one under `runs/` if not given.
    pub out: Option<PathBuf>,
    /// Threads each solver computes with.
    pub threads: usize,
}

/// Runs the cases asked for, one after the other, with a line for each, and writes `stress.csv` and `stress.html`.
///
/// # Errors
/// A case that makes no promise, files that cannot be written, or a promise that was broken.
pub fn command(options: &StressOptions) -> Result<(), Failure> {
    let chosen = choose(options)?;
    let out = folder::make(options.out.as_deref(), "stress")?;
    let mut rows = Vec::new();
    for (name, case, promise) in chosen {
        let ended = trial::run(&case, &out.join(&name), options.threads, promise.time_limit)?;
        let row = Row {
            happened: verdict::happened(&ended),
            broken: verdict::broken(&promise, &ended),
            wall_s: ended.wall_s,
            cpu_s: ended.json.as_ref().map_or(0.0, |json| json.cpu_s),
            name,
            promise,
        };
        println!("{}", row.line());
        rows.push(row);
        folder::write(&out.join("stress.csv"), &table::csv(&rows))?;
        folder::write(&out.join("stress.html"), &table::html(&rows))?;
    }
    let wall: f64 = rows.iter().map(|row| row.wall_s).sum();
    let broken: Vec<&str> =
        rows.iter().filter(|row| !row.broken.is_empty()).map(|row| row.name.as_str()).collect();
    println!("{} of {} promises kept, {wall:.0} s", rows.len() - broken.len(), rows.len());
    println!("{}", out.join("stress.html").display());
    if broken.is_empty() {
        return Ok(());
    }
    let what = format!("{} of {} promises broken: {}", broken.len(), rows.len(), broken.join(", "));
    Err(Failure::new(FailureClass::Numerical, "tidewall", "stress", what))
}

/// The cases asked for, by name, each with its promise.
fn choose(options: &StressOptions) -> Result<Vec<(String, PathBuf, Promise)>, Failure> {
    let mut chosen = Vec::new();
    for path in cases(&options.cases)? {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if !options.names.is_empty() && !options.names.contains(&name) {
            continue;
        }
        let promise = promise_of(&path)?;
        // Whoever names a case wants it, short or not.
        if !options.short || promise.short || !options.names.is_empty() {
            chosen.push((name, path, promise));
        }
    }
    let is_unknown = |name: &&String| !chosen.iter().any(|(known, ..)| known == *name);
    match options.names.iter().find(is_unknown) {
        Some(name) => Err(refused(format!("there is no case \"{name}\" in {}", options.cases.display()), "")),
        None => Ok(chosen),
    }
}

fn cases(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let entries = std::fs::read_dir(folder).map_err(|error| {
        let hint = "Run it in the root of the project, or name the folder with --cases.";
        refused(format!("cannot read {}: {error}", folder.display()), hint)
    })?;
    let is_case = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "toml");
    let mut cases: Vec<_> = entries.flatten().map(|entry| entry.path()).filter(is_case).collect();
    cases.sort();
    Ok(cases)
}

fn promise_of(path: &Path) -> Result<Promise, Failure> {
    let shown = path.display();
    let case = CaseFile::load(path, &[])
        .map_err(|error| refused(format!("cannot read the case {shown}: {error}"), ""))?;
    let promise = Promise::read(&case);
    if let Some(mistake) = case.diagnostics().iter().find(|mistake| mistake.key.starts_with("stress")) {
        return Err(refused(format!("{shown}: {mistake}"), ""));
    }
    promise.ok_or_else(|| refused(format!("{shown} promises nothing"), "Give it a [stress] section."))
}

fn refused(what: String, hint: &str) -> Failure {
    Failure::new(FailureClass::Case, "tidewall", "stress", what).with_hint(hint)
}
