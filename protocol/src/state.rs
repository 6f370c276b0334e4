//! The whole state of a run at the end of a step, in files: `state/<step>/<role>.bin` in the run folder, one of each
//! participant and, written last, one of the launcher. Without that one the others are worth nothing.
//!
//! A file is eight bytes of mark, the version of its form and the CRC-32 of the rest (`u32`, little-endian), then in
//! bincode the [`Stamp`] and what its owner keeps.

use std::path::{Path, PathBuf};

use bincode::config::standard;
use bincode::serde::{decode_from_slice, encode_to_vec};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::failure::{Failure, FailureClass};
use crate::series::unwritable;

const MARK: &[u8; 8] = b"TIDESTAT";
const VERSION: u32 = 1;
const HEAD: usize = MARK.len() + 8;

/// When a state is, and of what.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stamp {
    /// Coupling step it stands at the end of.
    pub step: u64,
    /// Simulated time, s.
    pub time: f64,
    /// Sizes of the scene, such as dimension and numbers of particles and nodes.
    pub sizes: Vec<(String, u64)>,
}

impl Stamp {
    /// The stamp of a step and the sizes that must be the same when the state is taken up.
    pub fn new(step: u64, time: f64, sizes: &[(&str, usize)]) -> Self {
        let sizes = sizes.iter().map(|(name, size)| ((*name).to_owned(), *size as u64)).collect();
        Self { step, time, sizes }
    }
}

/// The folder of all states of a run.
pub fn folder(run: &Path) -> PathBuf {
    run.join("state")
}

/// The file of one participant, by its role.
pub fn file(run: &Path, step: u64, role: &str) -> PathBuf {
    folder(run).join(step.to_string()).join(format!("{role}.bin"))
}

/// Writes a state into the run folder, whole or not at all.
///
/// # Errors
/// [`FailureClass::Resource`] when the disk is full.
pub fn write<T: Serialize>(run: &Path, role: &str, stamp: &Stamp, state: &T) -> Result<(), Failure> {
    let path = file(run, stamp.step, role);
    let content = encode_to_vec((stamp, state), standard()).expect("a state is plain numbers");
    let mut bytes = Vec::with_capacity(HEAD + content.len());
    bytes.extend_from_slice(MARK);
    bytes.extend_from_slice(&VERSION.to_le_bytes());
    bytes.extend_from_slice(&crc32fast::hash(&content).to_le_bytes());
    bytes.extend_from_slice(&content);
    let partial = path.with_extension("partial");
    std::fs::create_dir_all(path.parent().unwrap_or(run))
        .and_then(|()| std::fs::write(&partial, bytes))
        .and_then(|()| std::fs::rename(&partial, &path))
        .map_err(|error| unwritable(&path, &error))
}

/// Reads a state back that must be of this stamp.
///
/// # Errors
/// [`FailureClass::Case`]: the file is missing, damaged, of another version or of another scene.
pub fn read<T: DeserializeOwned>(run: &Path, role: &str, stamp: &Stamp) -> Result<T, Failure> {
    let path = file(run, stamp.step, role);
    let content = content(&path)?;
    let (found, rest) = decode::<Stamp>(&path, &content)?;
    let differs = |((name, expected), (_, found)): (&(String, u64), &(String, u64))| {
        (expected != found).then(|| format!("{name} expected {expected}, found {found}"))
    };
    let pairs = stamp.sizes.iter().zip(&found.sizes);
    let differences: Vec<_> = pairs.filter_map(differs).collect();
    if !differences.is_empty() || stamp.sizes.len() != found.sizes.len() {
        let what = format!("is of another scene: {}", differences.join(", "));
        return Err(refused(&path, &what)
            .with_hint("A state is taken up with the particles and the mesh it was kept with."));
    }
    match decode(&path, rest)? {
        (state, []) => Ok(state),
        _ => Err(refused(&path, "has bytes left over")),
    }
}

/// The stamp of a file that is whole.
///
/// # Errors
/// As [`read`].
pub fn stamp(path: &Path) -> Result<Stamp, Failure> {
    Ok(decode(path, &content(path)?)?.0)
}

/// What stands behind the head of a file.
fn content(path: &Path) -> Result<Vec<u8>, Failure> {
    let mut bytes =
        std::fs::read(path).map_err(|error| refused(path, &format!("cannot be read: {error}")))?;
    if bytes.len() < HEAD || &bytes[..MARK.len()] != MARK {
        return Err(refused(path, "is no state of a run"));
    }
    let word = |at: usize| u32::from_le_bytes(std::array::from_fn(|byte| bytes[at + byte]));
    let (version, checksum) = (word(MARK.len()), word(MARK.len() + 4));
    if version != VERSION {
        return Err(refused(path, &format!("has another form: version expected {VERSION}, found {version}")));
    }
    if crc32fast::hash(&bytes[HEAD..]) != checksum {
        return Err(refused(path, "is damaged: its checksum does not fit"));
    }
    bytes.drain(..HEAD);
    Ok(bytes)
}

/// The value at the start of the content, and what comes after it.
fn decode<'c, T: DeserializeOwned>(path: &Path, content: &'c [u8]) -> Result<(T, &'c [u8]), Failure> {
    match decode_from_slice(content, standard()) {
        Ok((value, read)) => Ok((value, &content[read..])),
        Err(error) => Err(refused(path, &format!("does not fit this program: {error}"))),
    }
}

fn refused(path: &Path, what: &str) -> Failure {
    let what = format!("the state {} {what}", path.display());
    Failure::new(FailureClass::Case, "files", "resume", what)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(folder: &Path) -> (Stamp, Vec<f64>) {
        let stamp = Stamp::new(7, 0.25, &[("dimension", 2), ("nodes", 3)]);
        let numbers = vec![0.1, -0.0, f64::INFINITY];
        write(folder, "solid", &stamp, &numbers).unwrap();
        (stamp, numbers)
    }

    #[test]
    fn a_state_comes_back_with_its_bits() {
        let run = tempfile::tempdir().unwrap();
        let (known, numbers) = kept(run.path());
        let found: Vec<f64> = read(run.path(), "solid", &known).unwrap();
        assert!(found.iter().zip(&numbers).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert_eq!(stamp(&file(run.path(), 7, "solid")), Ok(known));
    }

    #[test]
    fn what_is_no_longer_whole_is_refused_with_its_flaw() {
        let run = tempfile::tempdir().unwrap();
        let (stamp, _) = kept(run.path());
        let path = file(run.path(), 7, "solid");
        let whole = std::fs::read(&path).unwrap();
        let refusal = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            let refused = read::<Vec<f64>>(run.path(), "solid", &stamp).unwrap_err();
            assert_eq!(refused.class.exit_code(), 2);
            refused.what
        };
        let flipped = |at: usize| {
            let mut bytes = whole.clone();
            bytes[at] ^= 4;
            bytes
        };
        assert!(refusal(&flipped(whole.len() - 1)).contains("damaged"));
        assert!(refusal(&whole[..whole.len() - 3]).contains("damaged"));
        assert!(refusal(&flipped(0)).contains("no state of a run"));
        assert!(refusal(b"short").contains("no state of a run"));
        assert!(refusal(&flipped(8)).contains("version expected 1, found 5"));
        std::fs::remove_file(&path).unwrap();
        assert!(read::<Vec<f64>>(run.path(), "solid", &stamp).unwrap_err().what.contains("cannot be read"));
    }

    #[test]
    fn the_state_of_another_scene_is_refused_with_both_sizes() {
        let run = tempfile::tempdir().unwrap();
        kept(run.path());
        let other = Stamp::new(7, 0.25, &[("dimension", 2), ("nodes", 4)]);
        let refused = read::<Vec<f64>>(run.path(), "solid", &other).unwrap_err();
        assert!(refused.what.ends_with("is of another scene: nodes expected 4, found 3"), "{}", refused.what);
    }
}
