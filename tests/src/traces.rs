//! What a run leaves: children in `/proc`, files in `/dev/shm`, a folder in `/tmp`.

use std::fs;
use std::path::{Path, PathBuf};

/// A participant of a run, as `/proc` shows it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Participant {
    /// Name of its program.
    pub program: String,
    /// Its process id.
    pub pid: u32,
    /// Prefix of the run's names in shared memory.
    pub prefix: String,
    /// Folder of the run's sockets.
    pub root: PathBuf,
}

/// The participants that the launcher with this process id has started and that have not ended.
pub fn participants(launcher: u32) -> Vec<Participant> {
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    let pids = processes.filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
    pids.filter(|&pid| parent(pid) == Some(launcher)).filter_map(participant).collect()
}

/// Whether the process lives; a zombie does not.
pub fn is_alive(pid: u32) -> bool {
    state(pid).is_some_and(|state| !matches!(state, 'Z' | 'X'))
}

/// Whether the process is stopped.
pub fn is_stopped(pid: u32) -> bool {
    state(pid).is_some_and(|state| state == 'T')
}

fn state(pid: u32) -> Option<char> {
    stat(pid)?.split_whitespace().next()?.chars().next()
}

fn parent(pid: u32) -> Option<u32> {
    stat(pid)?.split_whitespace().nth(1)?.parse().ok()
}

/// The fields of `/proc/<pid>/stat` after the name, which may hold blanks.
fn stat(pid: u32) -> Option<String> {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    stat.rsplit_once(')').map(|(_, rest)| rest.to_owned())
}

fn participant(pid: u32) -> Option<Participant> {
    let line = fs::read(format!("/proc/{pid}/cmdline")).ok()?;
    let words: Vec<_> = line.split(|&byte| byte == 0).map(|word| String::from_utf8_lossy(word)).collect();
    let after = |flag: &str| words.iter().position(|word| word == flag).and_then(|at| words.get(at + 1));
    let program = Path::new(&*words[0]).file_name()?.to_str()?.to_owned();
    let (prefix, root) = (after("--prefix")?.to_string(), PathBuf::from(&**after("--root")?));
    Some(Participant { program, pid, prefix, root })
}

/// The names of a run that outlive its processes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Traces {
    prefix: String,
    root: PathBuf,
}

impl Traces {
    /// Those of the run a participant belongs to.
    pub fn of(participant: &Participant) -> Self {
        Self { prefix: participant.prefix.clone(), root: participant.root.clone() }
    }

    /// Files in shared memory, and the folder of the sockets if it stands.
    pub fn left(&self) -> Vec<PathBuf> {
        let shared = fs::read_dir("/dev/shm").into_iter().flatten().flatten().map(|entry| entry.path());
        let begins = |path: &PathBuf| {
            path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(&self.prefix))
        };
        let root = Some(self.root.clone()).filter(|root| root.exists());
        shared.filter(begins).chain(root).collect()
    }
}
