//! `tidewall study`: one case under several settings; error against run time, order of convergence, cheapest setting.

mod file;
mod fit;
mod map;
mod picture;
mod runs;
mod summary;

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::Instant;

use protocol::case::CaseFile;
use protocol::failure::{Failure, FailureClass};
use protocol::series::unwritable;

use crate::check::{CheckError, Checked};
use crate::{diagnostics, folder};
use file::Study;
pub use file::{SECTIONS, keys};
use runs::Trial;

/// Options of one study.
#[derive(Debug, Clone)]
pub struct StudyOptions {
    /// The study file.
    pub file: PathBuf,
    /// Where its runs and results go; `runs/study-<name>` if not given.
    pub out: Option<PathBuf>,
    /// Threads each solver computes with.
    pub threads: usize,
}

/// Runs a study, or what is left of it, and writes `study.csv`, `study.md`, `study.svg` and, where it is asked for, `map.svg`
/// after every run.
///
/// # Errors
/// Mistakes in the study or in any setting, before anything starts; resources; the user's interrupt; at the end, a
/// numerical failure if a run had one (the others are done and written).
pub fn command(options: &StudyOptions) -> Result<(), Failure> {
    let study = read(&options.file)?;
    let checked = runs::check_all(&study).map_err(|(label, error)| {
        eprintln!("setting \"{label}\":");
        tell(error)
    })?;
    let out = options.out.clone().unwrap_or_else(|| Path::new("runs").join(format!("study-{}", study.name)));
    std::fs::create_dir_all(&out).map_err(|error| unwritable(&out, &error))?;
    let mut trials = runs::trials(&study, &out);
    let result = run_all(&study, &checked, &mut trials, options.threads, &out);
    write(&study, &trials, options.threads, &out)?;
    result?;
    print!("{}", summary::page(&study, &trials, &machine(options.threads)));
    println!("\n{}", out.display());
    let failed = trials.iter().filter(|trial| trial.status() == "failed").count();
    match failed {
        0 => Ok(()),
        _ => {
            let what = format!("{failed} of {} runs failed; the others are done", trials.len());
            Err(Failure::new(FailureClass::Numerical, "tidewall", "study", what))
        }
    }
}

fn read(path: &Path) -> Result<Study, Failure> {
    let file = CaseFile::load(path, &[]).map_err(|error| {
        let what = format!("cannot read the study {}: {error}", path.display());
        Failure::new(FailureClass::Case, "tidewall", "study", what)
    })?;
    let study = Study::read(&file);
    let diagnostics = file.diagnostics();
    if diagnostics.is_empty() {
        return Ok(study);
    }
    Err(tell(CheckError::Mistakes { case: Box::new(file), diagnostics }))
}

/// Mistakes are printed here, with the lines they stand in.
fn tell(error: CheckError) -> Failure {
    match error {
        CheckError::Mistakes { case, diagnostics } => {
            eprint!("{}", diagnostics::render(&case, &diagnostics, std::io::stderr().is_terminal()));
            Failure::new(FailureClass::Case, "tidewall", "study", String::new())
        }
        CheckError::Failed(failure) => failure,
    }
}

fn run_all(
    study: &Study,
    checked: &[Checked],
    trials: &mut [Trial<'_>],
    threads: usize,
    out: &Path,
) -> Result<(), Failure> {
    let start = Instant::now();
    let count = trials.len();
    for index in 0..count {
        // Trials go round the settings in their order.
        let checked = &checked[index % checked.len()];
        let heading = format!("run {} of {count}: {}", index + 1, trials[index].setting.label);
        trials[index].json = runs::finished(&trials[index].folder, checked, threads);
        if trials[index].json.is_some() {
            eprintln!("{heading}: done before");
            continue;
        }
        if start.elapsed().as_secs_f64() > study.budget_s {
            eprintln!("{heading}: left out, the budget of {} s is spent", study.budget_s);
            continue;
        }
        eprintln!("{heading}");
        let json = runs::carry_out(&trials[index].folder, checked, threads)?;
        eprintln!("  {:.1} s of wall time, {:.1} s of CPU", json.wall_s, json.cpu_s);
        trials[index].json = Some(json);
        write(study, trials, threads, out)?;
    }
    Ok(())
}

fn write(study: &Study, trials: &[Trial<'_>], threads: usize, out: &Path) -> Result<(), Failure> {
    folder::write(&out.join("study.csv"), &summary::csv(study, trials))?;
    folder::write(&out.join("study.md"), &summary::page(study, trials, &machine(threads)))?;
    if let Some(plan) = &study.map {
        folder::write(&out.join("map.svg"), &map::map(plan, trials))?;
    }
    match study.errors.is_empty() {
        true => Ok(()),
        false => folder::write(&out.join("study.svg"), &picture::picture(study, trials)),
    }
}

/// The machine in words.
fn machine(threads: usize) -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let model = model.map_or("unknown processor", |(_, model)| model.trim());
    format!("{cores} cores ({model}), {threads} thread(s) a solver")
}
