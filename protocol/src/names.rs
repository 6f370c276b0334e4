//! The names of one run: what keeps two runs on one machine apart, and what a sweep may remove.
//!
//! Everything a run leaves in shared memory begins with its prefix, every socket and lock file lies in its root
//! folder; both carry the same random run id. The launcher draws it and passes both names to its children
//! (`--prefix`, `--root`).

use std::fmt;
use std::path::{Path, PathBuf};

/// Name of the launcher as a peer.
pub const LAUNCHER: &str = "launcher";

/// Folder the roots of runs lie in. Not `$TMPDIR`: a sweep must find the runs of an earlier environment, and the
/// path of a Unix socket is short.
pub const ROOT_BASE: &str = "/tmp";

/// Longest root path, characters; with 80 the sockets of iceoryx2 could not be made (limit of `sockaddr_un`: 108).
pub const MAX_ROOT_LEN: usize = 50;

/// What all prefixes and root folders begin with.
const MARK: &str = "tw-";

/// 64 random bits that name one run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct RunId(u64);

impl RunId {
    /// Draws an id from the kernel's random source.
    ///
    /// # Errors
    /// The reading of `/dev/urandom` failed.
    pub fn random() -> std::io::Result<Self> {
        let mut bytes = [0; 8];
        std::io::Read::read_exact(&mut std::fs::File::open("/dev/urandom")?, &mut bytes)?;
        Ok(Self(u64::from_le_bytes(bytes)))
    }

    /// The id in the name of a root folder, `None` for a folder that is none.
    pub fn of_root(root: &Path) -> Option<Self> {
        let digits = root.file_name()?.to_str()?.strip_prefix(MARK)?;
        let is_id =
            digits.len() == 16 && digits.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
        if is_id { u64::from_str_radix(digits, 16).ok().map(Self) } else { None }
    }
}

impl fmt::Display for RunId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

/// Prefix and root folder of one run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunNames {
    prefix: String,
    root: PathBuf,
}

/// A prefix or root path that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NameError {
    /// The root path would make socket paths too long.
    #[error("the channel folder {} has {found} characters, {MAX_ROOT_LEN} are possible", root.display())]
    RootTooLong {
        /// The folder.
        root: PathBuf,
        /// Its length, characters.
        found: usize,
    },
    /// The root path is not absolute, or not plain text.
    #[error("the channel folder {} is not an absolute path", .0.display())]
    RootNotAbsolute(PathBuf),
    /// The prefix is empty or holds a character other than letters, digits, `-` and `_`.
    #[error("the channel prefix `{0}` is not made of letters, digits, `-` and `_`")]
    Prefix(String),
}

impl RunNames {
    /// The names of run `id`, with its root under [`ROOT_BASE`].
    pub fn of(id: RunId) -> Self {
        Self { prefix: format!("{MARK}{id}-"), root: Path::new(ROOT_BASE).join(format!("{MARK}{id}")) }
    }

    /// The names of run `id`, with its root under another folder.
    ///
    /// # Errors
    /// [`NameError`] when the folder's path is too long or not absolute.
    pub fn under(base: &Path, id: RunId) -> Result<Self, NameError> {
        Self::new(&format!("{MARK}{id}-"), &base.join(format!("{MARK}{id}")))
    }

    /// Names as passed on a command line.
    ///
    /// # Errors
    /// [`NameError`] for names no channel can have.
    pub fn new(prefix: &str, root: &Path) -> Result<Self, NameError> {
        let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_';
        if prefix.is_empty() || !prefix.bytes().all(is_plain) {
            return Err(NameError::Prefix(prefix.to_owned()));
        }
        let found = root.as_os_str().len();
        if found > MAX_ROOT_LEN {
            return Err(NameError::RootTooLong { root: root.to_owned(), found });
        }
        if !root.is_absolute() || root.to_str().is_none() {
            return Err(NameError::RootNotAbsolute(root.to_owned()));
        }
        Ok(Self { prefix: prefix.to_owned(), root: root.to_owned() })
    }

    /// What every name of this run in shared memory begins with.
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// The folder of this run's sockets and lock files.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The arguments that pass the names to a child.
    pub fn arguments(&self) -> [String; 4] {
        let root = self.root.to_str().expect("root paths that are not plain text are refused");
        ["--prefix".to_owned(), self.prefix.clone(), "--root".to_owned(), root.to_owned()]
    }
}

/// Name of the service that carries messages from one process to another.
pub(crate) fn channel(from: &str, to: &str) -> String {
    format!("{from}-to-{to}")
}

/// Name of the event service a process is woken by.
pub(crate) fn inbox(process: &str) -> String {
    format!("wake-{process}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_root_folder_gives_its_run_id_back() {
        let id = RunId(0x0123_4567_89ab_cdef);
        let names = RunNames::of(id);
        assert_eq!(names.root(), Path::new("/tmp/tw-0123456789abcdef"));
        assert_eq!(names.prefix(), "tw-0123456789abcdef-");
        assert_eq!(RunId::of_root(names.root()), Some(id));
        for foreign in ["/tmp/tw-", "/tmp/tw-0123", "/tmp/tw-0123456789ABCDEF", "/tmp/other", "/"] {
            assert_eq!(RunId::of_root(Path::new(foreign)), None, "{foreign}");
        }
    }

    #[test]
    fn two_runs_have_different_names() {
        let (one, two) = (RunId::random().unwrap(), RunId::random().unwrap());
        assert_ne!(one, two);
        assert_ne!(RunNames::of(one).prefix(), RunNames::of(two).prefix());
    }

    #[test]
    fn names_survive_the_command_line() {
        let names = RunNames::of(RunId(7));
        let [_, prefix, _, root] = names.arguments();
        assert_eq!(RunNames::new(&prefix, Path::new(&root)).unwrap(), names);
    }

    #[test]
    fn unusable_names_are_refused() {
        let long = format!("/{}", "a".repeat(MAX_ROOT_LEN));
        let refused = RunNames::new("tw-", Path::new(&long));
        assert!(matches!(refused, Err(NameError::RootTooLong { found: 51, .. })));
        assert!(matches!(RunNames::new("tw-", Path::new("here")), Err(NameError::RootNotAbsolute(_))));
        assert!(matches!(RunNames::new("../x", Path::new("/tmp/x")), Err(NameError::Prefix(_))));
    }
}
