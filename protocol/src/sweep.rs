//! Leaves nothing behind: removes what a run put into shared memory and into its root folder.
//!
//! The launcher writes its process id and start time into `owner` in the root folder, each participant its own
//! into `member-<pid>`. Whoever finds an owner that no longer lives and no living member may remove the run: the
//! last participant to leave, or the next `tidewall` command. A process id alone would not do, the kernel uses it
//! again; nor may a run of another PID name space (a container that shares `/tmp`) be judged from here.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, SystemTime};

use crate::names::{RunId, RunNames};
use crate::shm::SHM_DIR;

const OWNER: &str = "owner";
const MEMBER: &str = "member-";

/// A root folder without owner is given this long: its launcher may be about to write one.
const OWNERLESS: Duration = Duration::from_secs(60);

/// A launcher is given this long to vanish after its participants were told that it is going.
const PARTING: Duration = Duration::from_millis(200);

/// A process that cannot be mistaken for a later one with the same id.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Identity {
    pid: u32,
    /// Clock ticks from boot to its start.
    start: u64,
    /// PID name space it lives in.
    pid_space: String,
}

impl Identity {
    fn own() -> io::Result<Self> {
        let pid = std::process::id();
        let start = start_time(pid).ok_or_else(|| io::Error::other("/proc does not show this process"))?;
        Ok(Self { pid, start, pid_space: pid_space()? })
    }

    fn read(path: &Path) -> Option<Self> {
        let text = fs::read_to_string(path).ok()?;
        let mut words = text.split_whitespace();
        let pid = words.next()?.parse().ok()?;
        let start = words.next()?.parse().ok()?;
        Some(Self { pid, start, pid_space: words.next()?.to_owned() })
    }

    /// Written aside and renamed, so that nobody reads half of it.
    fn write(&self, path: &Path) -> io::Result<()> {
        let aside = path.with_extension(format!("new-{}", self.pid));
        fs::write(&aside, format!("{} {} {}\n", self.pid, self.start, self.pid_space))?;
        fs::rename(aside, path)
    }

    /// Whether the process still runs; one of another name space counts as running.
    fn is_alive(&self) -> bool {
        let same_space = pid_space().is_ok_and(|space| space == self.pid_space);
        !same_space || start_time(self.pid) == Some(self.start)
    }
}

fn pid_space() -> io::Result<String> {
    Ok(fs::read_link("/proc/self/ns/pid")?.to_string_lossy().into_owned())
}

/// Start of a living process in clock ticks after boot; `None` for one that is gone or a zombie.
fn start_time(pid: u32) -> Option<u64> {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The name in brackets may hold blanks and brackets itself; the fields follow the last one.
    let mut fields = stat[stat.rfind(')')? + 1..].split_whitespace();
    let state = fields.next()?;
    if matches!(state, "Z" | "X") { None } else { fields.nth(18)?.parse().ok() }
}

/// Makes the root folder and writes this process into it as the run's owner.
///
/// # Errors
/// The folder exists or cannot be made, or `/proc` is missing.
pub fn claim(names: &RunNames) -> io::Result<()> {
    use std::os::unix::fs::DirBuilderExt;
    fs::DirBuilder::new().mode(0o700).create(names.root())?;
    Identity::own()?.write(&names.root().join(OWNER))
}

/// Whether the launcher that owns the run still lives.
pub fn owner_is_alive(root: &Path) -> bool {
    Identity::read(&root.join(OWNER)).is_some_and(|owner| owner.is_alive())
}

/// A participant's stay in a run. When the last one leaves a run without owner, it removes it.
#[derive(Debug)]
pub struct Member {
    names: RunNames,
}

impl Member {
    /// Enters this process in the run's root folder.
    ///
    /// # Errors
    /// The root folder cannot be written to.
    pub fn enter(names: &RunNames) -> io::Result<Self> {
        Identity::own()?.write(&member_file(names.root()))?;
        Ok(Self { names: names.clone() })
    }
}

impl Drop for Member {
    fn drop(&mut self) {
        leave(&self.names);
    }
}

/// Takes this process out of the run and removes the run if nobody is left.
pub(crate) fn leave(names: &RunNames) {
    // Already gone when the launcher has swept: nothing to do then.
    let _ = fs::remove_file(member_file(names.root()));
    if names.root().exists() && !owner_is_here(names.root()) && !has_living_member(names.root()) {
        remove_run(names);
    }
}

/// Whether the launcher lives on. A process that was asked to stop looks for a while: the kernel asks as soon as the
/// launcher's thread ends, which is a moment before the launcher is gone.
fn owner_is_here(root: &Path) -> bool {
    let start = Instant::now();
    while owner_is_alive(root) {
        if !crate::ipc::stop_flag().load(Ordering::Relaxed) || start.elapsed() > PARTING {
            return true;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    false
}

fn member_file(root: &Path) -> PathBuf {
    root.join(format!("{MEMBER}{}", std::process::id()))
}

fn has_living_member(root: &Path) -> bool {
    let is_living = |path: PathBuf| {
        let is_member = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(MEMBER));
        is_member && Identity::read(&path).is_some_and(|member| member.is_alive())
    };
    entries(root).any(is_living)
}

fn entries(folder: &Path) -> impl Iterator<Item = PathBuf> {
    fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path())
}

/// Removes everything of a run; gives what could not be removed. Shared memory first: as long as the root folder
/// stands, a later sweep finds the run again.
pub fn remove_run(names: &RunNames) -> Vec<PathBuf> {
    let begins =
        |path: &Path| path.file_name().is_some_and(|n| n.to_string_lossy().starts_with(names.prefix()));
    let shared = entries(Path::new(SHM_DIR)).filter(|path| begins(path));
    let is_left = |path: &PathBuf| fs::remove_file(path).is_err_and(|e| e.kind() != io::ErrorKind::NotFound);
    let mut left: Vec<PathBuf> = shared.filter(is_left).collect();
    if left.is_empty() {
        // Twice, as a process that is just leaving may remove files under the walk.
        let removed = fs::remove_dir_all(names.root()).or_else(|_| fs::remove_dir_all(names.root()));
        if removed.is_err_and(|error| error.kind() != io::ErrorKind::NotFound) {
            left.push(names.root().to_owned());
        }
    }
    left
}

/// Removes all runs under `base` whose launcher is gone and whose participants have ended; gives their ids.
pub fn sweep_abandoned(base: &Path) -> Vec<RunId> {
    let mut swept = Vec::new();
    for root in entries(base) {
        let Some(id) = RunId::of_root(&root) else { continue };
        let Ok(names) = RunNames::under(base, id) else { continue };
        if is_abandoned(&root) && remove_run(&names).is_empty() {
            swept.push(id);
        }
    }
    swept
}

fn is_abandoned(root: &Path) -> bool {
    let Ok(found) = fs::symlink_metadata(root) else { return false };
    let is_own = std::os::unix::fs::MetadataExt::uid(&found) == rustix::process::geteuid().as_raw();
    if !found.is_dir() || !is_own || has_living_member(root) {
        return false;
    }
    match Identity::read(&root.join(OWNER)) {
        Some(owner) => !owner.is_alive(),
        None => found
            .modified()
            .is_ok_and(|at| SystemTime::now().duration_since(at).is_ok_and(|age| age > OWNERLESS)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(base: &tempfile::TempDir) -> RunNames {
        RunNames::under(base.path(), RunId::random().unwrap()).unwrap()
    }

    /// An identity no living process has: this process, one tick earlier.
    fn dead() -> Identity {
        let own = Identity::own().unwrap();
        Identity { start: own.start - 1, ..own }
    }

    #[test]
    fn a_living_run_is_left_alone_and_a_dead_one_swept() {
        let base = tempfile::tempdir().unwrap();
        let (living, gone) = (names(&base), names(&base));
        claim(&living).unwrap();
        claim(&gone).unwrap();
        dead().write(&gone.root().join(OWNER)).unwrap();
        let shared = Path::new(SHM_DIR).join(format!("{}data", gone.prefix()));
        fs::write(&shared, b"left over").unwrap();
        fs::create_dir(gone.root().join("services")).unwrap();

        assert_eq!(sweep_abandoned(base.path()), [RunId::of_root(gone.root()).unwrap()]);
        assert!(living.root().exists() && !gone.root().exists() && !shared.exists());
    }

    #[test]
    fn a_run_with_a_living_member_is_not_swept() {
        let base = tempfile::tempdir().unwrap();
        let names = names(&base);
        claim(&names).unwrap();
        dead().write(&names.root().join(OWNER)).unwrap();
        let member = Member::enter(&names).unwrap();
        assert!(sweep_abandoned(base.path()).is_empty());
        drop(member);
        assert!(!names.root().exists(), "the last one out removes the run");
    }

    #[test]
    fn a_member_leaves_the_run_of_a_living_owner_alone() {
        let base = tempfile::tempdir().unwrap();
        let names = names(&base);
        claim(&names).unwrap();
        drop(Member::enter(&names).unwrap());
        assert!(names.root().exists());
        assert!(remove_run(&names).is_empty());
        assert!(!names.root().exists());
    }

    #[test]
    fn a_run_of_another_pid_space_and_a_foreign_folder_stay() {
        let base = tempfile::tempdir().unwrap();
        let names = names(&base);
        claim(&names).unwrap();
        Identity { pid_space: "pid:[1]".to_owned(), ..dead() }.write(&names.root().join(OWNER)).unwrap();
        fs::create_dir(base.path().join("tw-notes")).unwrap();
        assert!(sweep_abandoned(base.path()).is_empty());
        assert!(names.root().exists() && base.path().join("tw-notes").exists());
    }

    #[test]
    fn a_run_cannot_be_claimed_twice() {
        let base = tempfile::tempdir().unwrap();
        let names = names(&base);
        claim(&names).unwrap();
        assert_eq!(claim(&names).unwrap_err().kind(), io::ErrorKind::AlreadyExists);
    }
}
