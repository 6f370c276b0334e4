//! One case of the suite, run as a user would run it: by `tidewall run` in a process of its own, with a bound on its time.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use protocol::failure::{Failure, FailureClass};
use protocol::series::unwritable;

use crate::compare::Table;
use crate::run_json::RunJson;

/// How often the end is looked for.
const LOOK_EVERY: Duration = Duration::from_millis(5);

/// How a case ended.
#[derive(Debug)]
pub(super) struct Ended {
    /// Exit code; `None` if it had to be killed, or was.
    pub(super) exit_code: Option<i32>,
    /// What it complained about.
    pub(super) message: String,
    /// `run.json`, where there is one.
    pub(super) json: Option<RunJson>,
    /// Series with a value that is not finite, or that cannot be read.
    pub(super) broken_series: Vec<String>,
    /// Wall time, s.
    pub(super) wall_s: f64,
}

/// Runs a case into a folder; kills it after `time_limit` s.
///
/// # Errors
/// The folder cannot be written or the program not started.
pub(super) fn run(case: &Path, folder: &Path, threads: usize, time_limit: f64) -> Result<Ended, Failure> {
    let words = folder.with_extension("stderr");
    let stderr = File::create(&words).map_err(|error| unwritable(&words, &error))?;
    let mut command = Command::new(std::env::current_exe().unwrap_or_else(|_| PathBuf::from("tidewall")));
    command.arg("run").arg(case).arg("--out").arg(folder).args(["--threads", &threads.to_string()]);
    let start = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(stderr)
        .spawn()
        .map_err(|error| Failure::new(FailureClass::Resource, "tidewall", "stress", error.to_string()))?;
    let limit = Duration::from_secs_f64(time_limit);
    let status: Option<ExitStatus> = loop {
        match child.try_wait() {
            Ok(Some(status)) => break Some(status),
            // Its own children end by themselves when it is gone.
            _ if start.elapsed() > limit => {
                let _ = child.kill();
                let _ = child.wait();
                break None;
            }
            _ => std::thread::sleep(LOOK_EVERY),
        }
    };
    Ok(Ended {
        exit_code: status.and_then(|status| status.code()),
        message: fs::read_to_string(&words).unwrap_or_default(),
        json: RunJson::read(folder).ok(),
        broken_series: broken_series(folder),
        wall_s: start.elapsed().as_secs_f64(),
    })
}

fn broken_series(folder: &Path) -> Vec<String> {
    let files = fs::read_dir(folder.join("series")).into_iter().flatten().flatten();
    let is_whole = |table: &Table| table.rows.iter().flatten().all(|value| value.is_finite());
    let mut broken: Vec<String> = files
        .filter(|file| !Table::read(&file.path()).is_ok_and(|table| is_whole(&table)))
        .map(|file| file.file_name().to_string_lossy().into_owned())
        .collect();
    broken.sort();
    broken
}
