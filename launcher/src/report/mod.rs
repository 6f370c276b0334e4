//! `report.html`: one self-contained page for a run, or one comparing several.

mod energy;
mod page;
mod picture;
mod scene;
mod svg;

use std::path::{Path, PathBuf};

use protocol::failure::{Failure, FailureClass};

use crate::folder;

pub(crate) use page::page;
pub(crate) use svg::escape;

/// Writes `report.html` of a run; gives its path.
///
/// # Errors
/// The run cannot be read or the page not written.
pub fn write(run: &Path) -> Result<PathBuf, Failure> {
    let scene = scene::load(run).map_err(refused)?;
    let path = run.join("report.html");
    folder::write(&path, &page::of_run(&scene))?;
    Ok(path)
}

/// `tidewall report RUN...`: the page of one run, or `compare.html` in the first folder for several.
///
/// # Errors
/// A run cannot be read or the page not written.
pub fn command(runs: &[PathBuf]) -> Result<PathBuf, Failure> {
    match runs {
        [] => Err(refused("no run folder given".to_owned())),
        [run] => write(run),
        [first, ..] => {
            let scenes: Result<Vec<_>, _> = runs.iter().map(|run| scene::load(run)).collect();
            let path = first.join("compare.html");
            folder::write(&path, &page::of_several(&scenes.map_err(refused)?))?;
            Ok(path)
        }
    }
}

fn refused(what: String) -> Failure {
    Failure::new(FailureClass::Resource, "tidewall", "report", what)
}
