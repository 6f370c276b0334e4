//! The death of the parent: a second `tidewall` starts the program and ends at once, without a word to it.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use protocol::failure::{Failure, FailureClass};
use protocol::names::{ROOT_BASE, RunId, RunNames};
use protocol::sweep;
use rustix::process::{Pid, Signal, kill_process};

use super::Bench;

/// From the death of the parent to the end of the program.
const MOURNING: Duration = Duration::from_secs(3);
const PAUSE: Duration = Duration::from_millis(20);

/// What the program does wrong when it is orphaned.
pub(super) fn fault(bench: &Bench) -> Result<Option<String>, Failure> {
    let own = std::env::current_exe().map_err(|error| broken(format!("does not find itself: {error}")))?;
    let mut parent = Command::new(own);
    parent.arg("conform").arg(bench.program()).args(["--role", bench.role.name()]);
    let parent = parent.arg("--orphan").arg(&bench.folder).output();
    let parent = parent.map_err(|error| broken(format!("cannot start itself: {error}")))?;
    let pid = String::from_utf8_lossy(&parent.stdout).trim().parse().ok().and_then(Pid::from_raw);
    let Some(pid) = pid else {
        return Ok(Some(String::from_utf8_lossy(&parent.stderr).trim().to_owned()));
    };
    let start = Instant::now();
    while is_alive(pid) && start.elapsed() < MOURNING {
        std::thread::sleep(PAUSE);
    }
    let survives = is_alive(pid);
    if survives {
        // It may end between the two calls.
        let _ = kill_process(pid, Signal::KILL);
    }
    sweep::sweep_abandoned(Path::new(ROOT_BASE));
    Ok(survives.then(|| format!("still runs {} s later", MOURNING.as_secs())))
}

/// The part of the second `tidewall`: starts the program, says its process id, and is gone.
///
/// # Errors
/// The program does not come up.
pub fn leave_orphan(role: &'static str, program: PathBuf, folder: &Path) -> Result<(), Failure> {
    let id = RunId::random().map_err(|error| broken(format!("cannot draw a run id: {error}")))?;
    let crew = super::start(&RunNames::of(id), role, program, folder)?;
    crew.pids().iter().for_each(|(_, pid)| println!("{pid}"));
    // Without the farewell of the destructors.
    std::process::exit(0)
}

/// Whether a process runs; one that has ended may wait for whoever is to reap it.
fn is_alive(pid: Pid) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", pid.as_raw_nonzero())).unwrap_or_default();
    let state = stat.rsplit(')').next().and_then(|fields| fields.split_whitespace().next());
    state.is_some_and(|state| state != "Z" && state != "X")
}

fn broken(what: String) -> Failure {
    Failure::new(FailureClass::Resource, "tidewall", "conform", what)
}
