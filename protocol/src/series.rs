//! Series of the run folder: `series/<name>.csv`, first column `time_s`, written as the run goes.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::failure::{Failure, FailureClass};

/// One CSV file being written.
#[derive(Debug)]
pub struct Series {
    path: PathBuf,
    file: BufWriter<File>,
    columns: usize,
    every: f64,
    next: f64,
}

impl Series {
    /// Starts `folder/series/<name>.csv` with columns `time_s` and `columns`; rows closer than `every` seconds are
    /// left out (0: every row is written).
    ///
    /// # Errors
    /// [`FailureClass::Resource`] when the file cannot be written.
    pub fn create(folder: &Path, name: &str, columns: &[&str], every: f64) -> Result<Self, Failure> {
        let path = folder.join("series").join(format!("{name}.csv"));
        let start = || -> std::io::Result<BufWriter<File>> {
            std::fs::create_dir_all(folder.join("series"))?;
            let mut file = BufWriter::new(File::create(&path)?);
            writeln!(file, "time_s,{}", columns.join(","))?;
            Ok(file)
        };
        let file = start().map_err(|error| unwritable(&path, &error))?;
        Ok(Self { path, file, columns: columns.len(), every, next: f64::NEG_INFINITY })
    }

    /// Writes one row; numbers are written so that they are read back bit-identical.
    ///
    /// # Errors
    /// [`FailureClass::Resource`] when the disk is full, [`FailureClass::Numerical`] for a value that is not finite.
    pub fn row(&mut self, time: f64, values: &[f64]) -> Result<(), Failure> {
        debug_assert_eq!(values.len(), self.columns, "a row has one value per column");
        if time < self.next {
            return Ok(());
        }
        self.next = time + self.every * (1.0 - 1e-9);
        if let Some(bad) = values.iter().position(|value| !value.is_finite()) {
            let what = format!("column {} of {} is not finite", bad + 1, self.path.display());
            return Err(Failure::new(FailureClass::Numerical, "series", "output", what));
        }
        let mut write = || -> std::io::Result<()> {
            write!(self.file, "{time:?}")?;
            for value in values {
                write!(self.file, ",{value:?}")?;
            }
            writeln!(self.file)
        };
        write().map_err(|error| unwritable(&self.path, &error))
    }

    /// Time before which no row is due, s.
    pub fn due(&self) -> f64 {
        self.next
    }

    /// Writes no row before a time, s: where a series goes on that another run began.
    pub fn wait_until(&mut self, due: f64) {
        self.next = due;
    }

    /// Brings everything written so far to the disk.
    ///
    /// # Errors
    /// [`FailureClass::Resource`] when the disk is full.
    pub fn flush(&mut self) -> Result<(), Failure> {
        self.file.flush().map_err(|error| unwritable(&self.path, &error))
    }
}

/// The failure of a file that cannot be written.
pub fn unwritable(path: &Path, error: &std::io::Error) -> Failure {
    let what = format!("cannot write {}: {error}", path.display());
    Failure::new(FailureClass::Resource, "files", "output", what)
        .with_hint("Free some space or choose another folder with --out.")
}
