//! A run of `tidewall` from start to end, in a folder of its own.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use launcher::run_json::RunJson;
use rustix::process::{Pid, Signal, kill_process};

use crate::programs;
use crate::traces::{self, Participant, Traces};

/// A condition that does not come true for this long never will.
const LONGEST: Duration = Duration::from_secs(120);

/// A folder with a case in it and the runs of that case.
pub struct Stage {
    folder: tempfile::TempDir,
}

impl Stage {
    /// A new folder with this case.
    pub fn new(case: &str) -> Self {
        let stage = Self { folder: tempfile::tempdir().expect("a temporary folder can be made") };
        fs::write(stage.case(), case).expect("the temporary folder can be written");
        stage
    }

    /// The case file.
    pub fn case(&self) -> PathBuf {
        self.folder.path().join("case.toml")
    }

    /// The run folder of this name, whether it is there or not.
    pub fn out(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Starts `tidewall run` of the case into the run folder of this name.
    pub fn start(&self, out: &str, arguments: &[&str]) -> Running {
        self.start_with(out, arguments, &[])
    }

    /// The same with variables added to the environment, which the participants inherit.
    pub fn start_with(&self, out: &str, arguments: &[&str], environment: &[(&str, &str)]) -> Running {
        let mut command = Command::new(programs::program("tidewall"));
        command.arg("run").arg(self.case()).arg("--out").arg(self.out(out)).args(arguments);
        command.envs(environment.iter().copied());
        Running::start(command, self.out(out))
    }

    /// `tidewall resume` of the run of one name into the run folder of another, from start to end.
    pub fn resume(&self, from: &str, out: &str, arguments: &[&str]) -> Finished {
        let mut command = Command::new(programs::program("tidewall"));
        command.arg("resume").arg(self.out(from)).arg("--out").arg(self.out(out)).args(arguments);
        Running::start(command, self.out(out)).end()
    }

    /// `tidewall run` of the case from start to end.
    pub fn run(&self, out: &str, arguments: &[&str]) -> Finished {
        self.start(out, arguments).end()
    }
}

/// `tidewall` while it runs. Dropping it kills it.
pub struct Running {
    child: Child,
    out: PathBuf,
    seen: Vec<Participant>,
}

impl Running {
    fn start(mut command: Command, out: PathBuf) -> Self {
        let words = |kind: &str| out.with_extension(kind);
        let file = |kind: &str| fs::File::create(words(kind)).expect("the stage can be written");
        command.stdin(Stdio::null()).stdout(file("stdout")).stderr(file("stderr"));
        let child = command.spawn().expect("tidewall is built");
        Self { child, out, seen: Vec::new() }
    }

    /// Its process id.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// The participants seen so far.
    pub fn seen(&self) -> &[Participant] {
        &self.seen
    }

    /// Takes note of the participants that are there now.
    pub fn look(&mut self) {
        for found in traces::participants(self.pid()) {
            if !self.seen.contains(&found) {
                self.seen.push(found);
            }
        }
    }

    /// Waits for the participant with this program and gives its process id.
    pub fn participant(&mut self, program: &str) -> u32 {
        let find = |running: &mut Self| {
            running.look();
            running.seen.iter().find(|found| found.program == program).map(|found| found.pid)
        };
        self.wait_for(program, find)
    }

    /// Waits until `run.json` shows at least this simulated time, s; it is written at each output.
    pub fn wait_until_simulated(&mut self, time: f64) -> RunJson {
        let condition = format!("run.json at {time} s");
        self.wait_for(&condition, |running| {
            running.look();
            RunJson::read(&running.out).ok().filter(|json| json.simulated_s >= time)
        })
    }

    /// Waits until `find` finds something; fails when the run ends before or the wait is far too long.
    pub fn wait_for<T>(&mut self, what: &str, mut find: impl FnMut(&mut Self) -> Option<T>) -> T {
        let start = Instant::now();
        loop {
            if let Some(found) = find(self) {
                return found;
            }
            if let Ok(Some(end)) = self.child.try_wait() {
                panic!("the run ended ({end}) before {what}: {}", self.words("stderr"));
            }
            assert!(start.elapsed() < LONGEST, "{what} has not come: {}", self.words("stderr"));
            pause();
        }
    }

    /// Sends a signal to the launcher.
    pub fn signal(&self, signal: Signal) {
        send(self.pid(), signal);
    }

    /// Holds the launcher, and with it the run: no order is given until it goes on.
    pub fn hold(&self) {
        self.signal(Signal::STOP);
        until("the launcher stops", || traces::is_stopped(self.pid()));
    }

    /// Lets the launcher go on.
    pub fn go_on(&self) {
        self.signal(Signal::CONT);
    }

    /// Waits for the end of the launcher.
    pub fn end(mut self) -> Finished {
        let start = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().expect("a child can be waited for") {
                break status;
            }
            assert!(start.elapsed() < LONGEST, "the run does not end: {}", self.words("stderr"));
            self.look();
            pause();
        };
        let (stdout, stderr) = (self.words("stdout"), self.words("stderr"));
        let seen = std::mem::take(&mut self.seen);
        Finished { status, stdout, stderr, out: self.out.clone(), seen }
    }

    fn words(&self, kind: &str) -> String {
        fs::read_to_string(self.out.with_extension(kind)).unwrap_or_default()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // Fails for one that has ended, as it should have.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// `tidewall` after its end.
#[derive(Debug)]
pub struct Finished {
    /// How it ended.
    pub status: ExitStatus,
    /// What it printed.
    pub stdout: String,
    /// What it complained about.
    pub stderr: String,
    /// Its run folder.
    pub out: PathBuf,
    /// The participants seen while it ran.
    pub seen: Vec<Participant>,
}

impl Finished {
    /// Fails unless it ended with this exit code.
    pub fn expect_code(self, code: i32) -> Self {
        assert_eq!(self.status.code(), Some(code), "{}\n{}", self.stdout, self.stderr);
        self
    }

    /// `run.json`.
    pub fn json(&self) -> RunJson {
        RunJson::read(&self.out).expect("every run that was started leaves run.json")
    }

    /// The programs seen, in alphabetical order.
    pub fn programs(&self) -> Vec<&str> {
        let mut programs: Vec<_> = self.seen.iter().map(|found| found.program.as_str()).collect();
        programs.sort_unstable();
        programs
    }

    /// Fails if a participant, a file in shared memory or a socket folder of the run is left.
    pub fn expect_no_trace(self) -> Self {
        assert!(!self.seen.is_empty(), "nobody was seen, so nothing is proved: {}", self.stderr);
        let alive: Vec<_> = self.seen.iter().filter(|found| traces::is_alive(found.pid)).collect();
        assert!(alive.is_empty(), "left alive: {alive:?}");
        let left: Vec<_> = self.seen.iter().flat_map(|found| Traces::of(found).left()).collect();
        assert!(left.is_empty(), "left behind: {left:?}");
        self
    }

    /// The series, by file name.
    pub fn series(&self) -> BTreeMap<String, String> {
        series(&self.out)
    }
}

/// The series of a run folder, by file name.
pub fn series(run: &Path) -> BTreeMap<String, String> {
    let files = fs::read_dir(run.join("series")).into_iter().flatten().flatten().map(|entry| entry.path());
    let read = |path: PathBuf| {
        let name = path.file_name().expect("a listed file has a name").to_string_lossy().into_owned();
        (name, fs::read_to_string(&path).expect("a series is text"))
    };
    files.map(read).collect()
}

/// Fails unless both runs have the same series with the same bytes, and at least one row of each.
pub fn assert_same_series(found: &BTreeMap<String, String>, expected: &BTreeMap<String, String>) {
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (name, expected) in expected {
        assert!(expected.lines().count() > 2, "{name} is empty: {expected}");
        let pair = found[name].lines().zip(expected.lines()).enumerate();
        let different = pair.filter(|(_, (found, expected))| found != expected).map(|(line, _)| line).next();
        assert!(found[name] == *expected, "{name} differs, first in line {different:?}");
    }
}

/// Sends a signal to a process.
pub fn send(pid: u32, signal: Signal) {
    let pid = Pid::from_raw(pid.cast_signed()).expect("a process id is not zero");
    kill_process(pid, signal).expect("the process is there");
}

/// Waits until a condition holds.
pub fn until(what: &str, condition: impl Fn() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < LONGEST, "{what}: never");
        pause();
    }
}

fn pause() {
    std::thread::sleep(Duration::from_millis(1));
}
