//! One participant as a process: its start, its end, and what the system says about it.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};

use protocol::failure::{Failure, FailureClass};
use protocol::names::RunNames;
use rustix::process::{Pid, Signal, kill_process_group};

use super::control::Task;

/// How to start one participant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProcessSpec {
    /// Its name on the channels.
    pub name: String,
    /// The executable.
    pub program: PathBuf,
    /// Its arguments; the names of the run are added.
    pub arguments: Vec<OsString>,
    /// Variables added to the environment.
    pub environment: Vec<(OsString, OsString)>,
}

/// Fields of `/proc/<pid>/stat`, counted from the state (proc(5): 3 is the state, 14 and 15 the CPU times).
const USER_TICKS: usize = 14 - 3;
const SYSTEM_TICKS: usize = 15 - 3;

/// A started participant.
pub(super) struct Child {
    pub(super) name: String,
    process: std::process::Child,
    words: PathBuf,
    end: Option<ExitStatus>,
}

impl Child {
    /// Starts the participant in a process group of its own, so that Ctrl-C reaches the launcher alone. What it
    /// prints goes to `<log>/<name>.stderr`. To be called on the main thread: the kernel ends the child with the
    /// thread that started it.
    pub(super) fn spawn(spec: &ProcessSpec, names: &RunNames, log: &Path) -> io::Result<Self> {
        let words = log.join(format!("{}.stderr", spec.name));
        let file = File::create(&words)?;
        let mut command = Command::new(&spec.program);
        command.args(&spec.arguments).args(names.arguments()).envs(spec.environment.iter().cloned());
        command.stdin(Stdio::null()).stdout(file.try_clone()?).stderr(file).process_group(0);
        Ok(Self { name: spec.name.clone(), process: command.spawn()?, words, end: None })
    }

    pub(super) fn pid(&self) -> u32 {
        self.process.id()
    }

    /// How it ended, as soon as it has.
    pub(super) fn end(&mut self) -> Option<ExitStatus> {
        if self.end.is_none() {
            // Fails only for a child that was reaped elsewhere, which nobody does.
            self.end = self.process.try_wait().expect("a child can be waited for");
        }
        self.end
    }

    /// Whether it was stopped from outside (SIGSTOP, a debugger).
    pub(super) fn is_stopped(&self) -> bool {
        self.stat().first().is_some_and(|state| state == "T" || state == "t")
    }

    /// CPU time it has used, in ticks of the kernel's clock (a hundredth of a second).
    pub(super) fn cpu_ticks(&self) -> u64 {
        let stat = self.stat();
        let ticks = |field: usize| stat.get(field).and_then(|word| word.parse::<u64>().ok()).unwrap_or(0);
        ticks(USER_TICKS) + ticks(SYSTEM_TICKS)
    }

    /// The fields of `/proc/<pid>/stat` behind the program's name; none of a process that is gone.
    fn stat(&self) -> Vec<String> {
        let stat = fs::read_to_string(format!("/proc/{}/stat", self.pid())).unwrap_or_default();
        let fields = stat.rsplit(')').next().unwrap_or_default();
        fields.split_whitespace().map(str::to_owned).collect()
    }

    /// Signals the process and what it has started; nothing for one that has ended.
    pub(super) fn signal(&mut self, signal: Signal) {
        if self.end().is_none()
            && let Some(pid) = Pid::from_raw(self.pid().cast_signed())
        {
            // The group may be gone between the two calls.
            let _ = kill_process_group(pid, signal);
        }
    }

    /// Waits for its end, however long that takes: after SIGKILL.
    pub(super) fn reap(&mut self) {
        if self.end.is_none() {
            self.end = self.process.wait().ok();
        }
    }

    /// The failure of a process that ended when it should not have.
    pub(super) fn death(&self, end: ExitStatus, task: &Task) -> Failure {
        let failure = Failure::new(FailureClass::Process, &self.name, task.phase, describe(end));
        let mut hint = end.signal().map_or("", usual_cause).to_owned();
        if let Some(last) = self.last_words() {
            let space = if hint.is_empty() { "" } else { " " };
            hint.push_str(&format!("{space}Its last words (in {}): {last}", self.words.display()));
        }
        failure.at(task.step, task.time_s).with_hint(hint)
    }

    /// The failure of a process that was stopped from outside.
    pub(super) fn stop(&self, task: &Task) -> Failure {
        let what = format!("was stopped from outside (process {})", self.pid());
        let failure = Failure::new(FailureClass::Process, &self.name, task.phase, what);
        failure.at(task.step, task.time_s).with_hint("A stop signal or a debugger holds it.")
    }

    /// The failure of a process that computes while the others wait for it.
    pub(super) fn overrun(&self, task: &Task) -> Failure {
        let what = "is still computing while the others have waited for longer than the limit";
        let failure = Failure::new(FailureClass::Process, &self.name, task.phase, what);
        failure.at(task.step, task.time_s).with_hint("If its steps are so long, raise time.silence_limit.")
    }

    /// Last line it printed.
    fn last_words(&self) -> Option<String> {
        let text = String::from_utf8_lossy(&fs::read(&self.words).ok()?).into_owned();
        text.lines().rev().map(str::trim).find(|line| !line.is_empty()).map(str::to_owned)
    }

    /// Removes the file of its words if there were none.
    pub(super) fn tidy(&self) {
        if fs::metadata(&self.words).is_ok_and(|found| found.len() == 0) {
            // An empty file that stays does no harm.
            let _ = fs::remove_file(&self.words);
        }
    }
}

/// How a process ended, as a predicate.
pub(super) fn describe(end: ExitStatus) -> String {
    match (end.signal(), end.code()) {
        (Some(signal), _) => format!("was killed by signal {signal}{}", signal_name(signal)),
        (None, Some(0)) => "ended before it was told to".to_owned(),
        (None, Some(code)) => format!("ended with exit code {code}"),
        (None, None) => "ended".to_owned(),
    }
}

fn signal_name(signal: i32) -> &'static str {
    match signal {
        4 => " (SIGILL)",
        6 => " (SIGABRT)",
        7 => " (SIGBUS)",
        9 => " (SIGKILL)",
        11 => " (SIGSEGV)",
        15 => " (SIGTERM)",
        _ => "",
    }
}

fn usual_cause(signal: i32) -> &'static str {
    match signal {
        7 => "The usual cause is a full /dev/shm.",
        9 => "The usual causes are a lack of memory and a kill by hand.",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_end_is_told_in_words() {
        assert_eq!(describe(ExitStatus::from_raw(9)), "was killed by signal 9 (SIGKILL)");
        assert_eq!(describe(ExitStatus::from_raw(3 << 8)), "ended with exit code 3");
        assert_eq!(describe(ExitStatus::from_raw(0)), "ended before it was told to");
    }
}
