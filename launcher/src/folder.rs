//! The run folder: made before anything starts, never shared by two runs.

use std::path::{Path, PathBuf};

use protocol::failure::{Failure, FailureClass};
use protocol::series::unwritable;

/// Makes the run folder: the given one, which must not hold a run already, or `runs/<case>-<n>` with the next free n.
///
/// # Errors
/// [`FailureClass::Resource`] when it cannot be made or is taken.
pub fn make(out: Option<&Path>, case: &str) -> Result<PathBuf, Failure> {
    match out {
        Some(folder) => {
            if folder.join("run.json").exists() || folder.join("case.lock.toml").exists() {
                let what = format!("{} holds a run already", folder.display());
                return Err(Failure::new(FailureClass::Resource, "tidewall", "folder", what)
                    .with_hint("Choose another folder with --out, or remove this one."));
            }
            std::fs::create_dir_all(folder).map_err(|error| cannot_make(folder, &error))?;
            claim(folder)?;
            Ok(folder.to_owned())
        }
        None => next_free(Path::new("runs"), case),
    }
}

fn next_free(parent: &Path, case: &str) -> Result<PathBuf, Failure> {
    std::fs::create_dir_all(parent).map_err(|error| cannot_make(parent, &error))?;
    for number in 1.. {
        let folder = parent.join(format!("{case}-{number}"));
        match std::fs::create_dir(&folder) {
            Ok(()) => {
                claim(&folder)?;
                return Ok(folder);
            }
            // Another run may take a number at the same time: the next one is tried.
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(cannot_make(&folder, &error)),
        }
    }
    unreachable!("there is always a next number")
}

/// The lock file of the case is made first, and only by one of two runs that want the same folder.
fn claim(folder: &Path) -> Result<(), Failure> {
    let path = folder.join("case.lock.toml");
    std::fs::File::create_new(&path).map(drop).map_err(|error| unwritable(&path, &error))
}

fn cannot_make(folder: &Path, error: &std::io::Error) -> Failure {
    let what = format!("cannot make the run folder {}: {error}", folder.display());
    Failure::new(FailureClass::Resource, "tidewall", "folder", what)
        .with_hint("Choose another folder with --out.")
}

/// Copies the reference curves a resolved case names into `reference/` and names the copies instead, so that the
/// report can be made again wherever the case has gone.
///
/// # Errors
/// [`FailureClass::Resource`].
pub fn keep_curves(lock: &mut toml::Table, folder: &Path) -> Result<(), Failure> {
    let Some(toml::Value::Array(references)) = lock.get_mut("reference") else { return Ok(()) };
    for (index, reference) in references.iter_mut().enumerate() {
        let Some(toml::Value::String(curve)) = reference.get_mut("curve") else { continue };
        let name = Path::new(&curve).file_name().unwrap_or_default().to_string_lossy().into_owned();
        let kept = format!("reference/{index}-{name}");
        std::fs::create_dir_all(folder.join("reference"))
            .and_then(|()| std::fs::copy(&curve, folder.join(&kept)))
            .map_err(|error| unwritable(&folder.join(&kept), &error))?;
        *curve = kept;
    }
    Ok(())
}

/// Writes a file whole or not at all.
///
/// # Errors
/// [`FailureClass::Resource`].
pub fn write(path: &Path, text: &str) -> Result<(), Failure> {
    let partial = path.with_extension("partial");
    std::fs::write(&partial, text)
        .and_then(|()| std::fs::rename(&partial, path))
        .map_err(|error| unwritable(path, &error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_given_to_one_run_only() {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("here");
        assert_eq!(make(Some(&folder), "x").unwrap(), folder);
        let refused = make(Some(&folder), "x").unwrap_err();
        assert_eq!(refused.class, FailureClass::Resource);
        assert!(refused.what.contains("holds a run already"));
    }

    #[test]
    fn numbers_count_up() {
        let parent = tempfile::tempdir().unwrap();
        assert_eq!(next_free(parent.path(), "x").unwrap(), parent.path().join("x-1"));
        assert_eq!(next_free(parent.path(), "x").unwrap(), parent.path().join("x-2"));
    }

    #[test]
    fn curves_stay_with_the_run() {
        let parent = tempfile::tempdir().unwrap();
        let curve = parent.path().join("c.csv");
        std::fs::write(&curve, "time_s,x\n").unwrap();
        let text = format!("[[reference]]\ncurve = \"{}\"\n[[reference]]\nvalue = 1.0\n", curve.display());
        let mut lock: toml::Table = toml::from_str(&text).unwrap();
        keep_curves(&mut lock, parent.path()).unwrap();
        assert_eq!(lock["reference"][0]["curve"].as_str(), Some("reference/0-c.csv"));
        assert_eq!(std::fs::read_to_string(parent.path().join("reference/0-c.csv")).unwrap(), "time_s,x\n");
    }

    #[test]
    fn a_file_in_the_way_is_named() {
        let parent = tempfile::tempdir().unwrap();
        let file = parent.path().join("file");
        std::fs::write(&file, "").unwrap();
        let refused = make(Some(&file.join("run")), "x").unwrap_err();
        assert!(refused.what.contains("cannot make the run folder"), "{refused}");
        assert_eq!(refused.class.exit_code(), 5);
    }
}
