//! Compares the series of a run with the references of its case.

use std::path::{Path, PathBuf};

use protocol::case::{Norm, Reference, Shared, Target};
use serde::{Deserialize, Serialize};

use crate::measures::{at, crossing, decay_rate, frequency, time_mean};
use crate::running_mean::{noise, running_mean};

/// A series or a curve: columns by name over time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// Names of the columns after the first, which is the time in s.
    pub names: Vec<String>,
    /// Rows: time, then the values.
    pub rows: Vec<Vec<f64>>,
}

/// One row of `errors` in `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ErrorEntry {
    /// Gauge compared.
    pub gauge: String,
    /// Its column.
    pub column: String,
    /// What it is compared with.
    pub reference: String,
    /// Norm.
    pub norm: String,
    /// The error (for `share_inside` the share), in `unit`.
    pub value: f64,
    /// Unit of `value`; empty for shares and relative errors.
    pub unit: String,
    /// Window actually compared, s.
    pub from_s: f64,
    /// Window actually compared, s.
    pub to_s: f64,
    /// The measured value: peak, time of crossing, share, mean, last value, or the error itself.
    pub measured: f64,
    /// The expected value, where it is one number.
    pub expected: Option<f64>,
    /// Bounds of the case, if it gives some.
    pub gate: Option<(f64, f64)>,
    /// Whether the bounds are kept.
    pub passed: Option<bool>,
}

impl Table {
    /// Reads a CSV file with comment lines (`#`), a line of names and rows of numbers.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn read(path: &Path) -> Result<Self, String> {
        let text = std::fs::read_to_string(path)
            .map_err(|error| format!("cannot read {}: {error}", path.display()))?;
        let mut lines = text.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty());
        let names = lines.next().ok_or_else(|| format!("{} is empty", path.display()))?;
        let names: Vec<String> = names.split(',').skip(1).map(|name| name.trim().to_owned()).collect();
        let mut rows = Vec::new();
        for line in lines {
            let row: Result<Vec<f64>, _> = line.split(',').map(|value| value.trim().parse()).collect();
            match row {
                Ok(row) if row.len() == names.len() + 1 => rows.push(row),
                _ => return Err(format!("{}: the row \"{line}\" does not fit its columns", path.display())),
            }
        }
        Ok(Self { names, rows })
    }

    /// Rows (time, value) of one column.
    pub fn column(&self, name: &str) -> Option<Vec<(f64, f64)>> {
        let index = self.names.iter().position(|known| known == name)?;
        Some(self.rows.iter().map(|row| (row[0], row[index + 1])).collect())
    }
}

/// Reads columns of a curve; `None`s are passed over.
///
/// # Errors
/// What is wrong with the file, in words.
pub fn load_curve(path: &Path, columns: &[Option<&str>]) -> Result<Vec<Vec<(f64, f64)>>, String> {
    let table = Table::read(path)?;
    let missing =
        |name: &str| format!("{} has no column {name}, but {}", path.display(), table.names.join(", "));
    columns.iter().flatten().map(|name| table.column(name).ok_or_else(|| missing(name))).collect()
}

/// The errors of a run so far, which began at `begin` s; a reference whose window the run has not reached is left out. Of
/// a window that began before the run the rest is compared, without bounds: they are for the whole.
pub fn errors(folder: &Path, shared: &Shared, case: &Path, begin: f64) -> Vec<ErrorEntry> {
    let error = |reference: &Reference| match reference.from < begin {
        true => error_of(folder, &rest(reference, begin), case),
        false => error_of(folder, reference, case),
    };
    shared.references.iter().filter_map(error).collect()
}

/// A reference from a time on, at the same instants.
fn rest(reference: &Reference, begin: f64) -> Reference {
    let grid = |every: f64| reference.from + ((begin - reference.from) / every - 1e-6).ceil() * every;
    let from = if reference.every > 0.0 { grid(reference.every) } else { begin };
    Reference { from, gate: None, ..reference.clone() }
}

/// Where a curve lies: beside the case file.
pub fn curve_path(case: &Path, file: &str) -> PathBuf {
    case.parent().unwrap_or(Path::new(".")).join(file)
}

fn error_of(folder: &Path, reference: &Reference, case: &Path) -> Option<ErrorEntry> {
    let series = Table::read(&folder.join("series").join(format!("{}.csv", reference.gauge))).ok()?;
    let mut series = series.column(&reference.column)?;
    if let Some(length) = reference.running_mean.filter(|_| reference.norm != Norm::Noise) {
        series = running_mean(&series, length);
    }
    let last = series.last()?.0;
    let window: Vec<_> =
        series.iter().copied().filter(|row| reference.from <= row.0 && row.0 <= reference.to).collect();
    let mut instants = instants(reference, &window, last)?;
    let (value, measured, expected) = match &reference.target {
        Target::Value(expected) => against_value(reference, &series, &window, &instants, *expected)?,
        Target::Curve { file, column, band } => {
            let columns = [Some(column), band.as_ref().map(|b| &b.0), band.as_ref().map(|b| &b.1)];
            let curves = load_curve(&curve_path(case, file), &columns.map(|c| c.map(String::as_str))).ok()?;
            if reference.at_curve {
                let times = curves[0].iter().map(|row| row.0);
                instants = times.filter(|&t| reference.from <= t && t <= reference.to.min(last)).collect();
                series = instants.iter().map(|&time| (time, at(&series, time))).collect();
            }
            against_curve(reference, &series, &instants, &curves)?
        }
    };
    let relative = reference.relative && expected.is_some_and(|expected| expected != 0.0);
    let value = if relative { value / expected.unwrap_or(1.0).abs() } else { value };
    let gated = if relative || matches!(reference.norm, Norm::Rms | Norm::MaxAbs) { value } else { measured };
    let unit = if relative || reference.norm == Norm::ShareInside {
        String::new()
    } else if let Some(unit) = reference.norm.own_unit() {
        unit.to_owned()
    } else {
        unit_of(&reference.column)
    };
    Some(ErrorEntry {
        gauge: reference.gauge.clone(),
        column: reference.column.clone(),
        reference: reference.label.clone(),
        norm: reference.norm.name().to_owned(),
        value,
        unit,
        from_s: *instants.first()?,
        to_s: *instants.last()?,
        measured,
        expected,
        gate: reference.gate,
        passed: reference.gate.map(|(low, high)| low <= gated && gated <= high),
    })
}

/// The instants compared; `None` if the run has not reached the start of the window, or not all of a fixed grid.
fn instants(reference: &Reference, window: &[(f64, f64)], last: f64) -> Option<Vec<f64>> {
    if reference.every > 0.0 {
        let count =
            ((reference.to.min(last * (1.0 + 1e-9)) - reference.from) / reference.every + 1e-6).floor();
        let instants: Vec<_> =
            (0..=count.max(0.0) as usize).map(|i| reference.from + i as f64 * reference.every).collect();
        return (reference.from <= last && count >= 0.0).then_some(instants);
    }
    let times: Vec<_> = window.iter().map(|row| row.0).collect();
    (!times.is_empty()).then_some(times)
}

fn against_value(
    reference: &Reference,
    series: &[(f64, f64)],
    window: &[(f64, f64)],
    instants: &[f64],
    expected: f64,
) -> Option<(f64, f64, Option<f64>)> {
    let measured = match reference.norm {
        Norm::Peak => window.iter().map(|row| row.1).fold(f64::NEG_INFINITY, f64::max),
        Norm::Crossing => crossing(window, reference.level?)?,
        Norm::Mean => time_mean(window),
        Norm::Final => window.last()?.1,
        Norm::Frequency => frequency(window, reference.level.unwrap_or_else(|| time_mean(window)))?,
        Norm::Decay => decay_rate(window)?,
        Norm::Noise => noise(series, reference.running_mean?, (reference.from, reference.to))?,
        Norm::MaxAbs => {
            let greatest = window.iter().map(|row| (row.1 - expected).abs()).fold(0.0, f64::max);
            return Some((greatest, greatest, Some(expected)));
        }
        Norm::Rms | Norm::ShareInside => {
            let square = |&time: &f64| (at(series, time) - expected).powi(2);
            let rms = (instants.iter().map(square).sum::<f64>() / instants.len() as f64).sqrt();
            return Some((rms, rms, Some(expected)));
        }
    };
    Some((measured - expected, measured, Some(expected)))
}

fn against_curve(
    reference: &Reference,
    series: &[(f64, f64)],
    instants: &[f64],
    curves: &[Vec<(f64, f64)>],
) -> Option<(f64, f64, Option<f64>)> {
    let curve = &curves[0];
    match reference.norm {
        Norm::ShareInside => {
            let (low, high) = (curves.get(1)?, curves.get(2)?);
            let inside = |&&time: &&f64| {
                let value = at(series, time);
                at(low, time) - reference.margin <= value && value <= at(high, time) + reference.margin
            };
            let share = instants.iter().filter(inside).count() as f64 / instants.len() as f64;
            Some((share, share, None))
        }
        Norm::MaxAbs => {
            let error = |&time: &f64| (at(series, time) - at(curve, time)).abs();
            let greatest = instants.iter().map(error).fold(0.0, f64::max);
            Some((greatest, greatest, None))
        }
        Norm::Rms => {
            let square = |&time: &f64| (at(series, time) - at(curve, time)).powi(2);
            let rms = (instants.iter().map(square).sum::<f64>() / instants.len() as f64).sqrt();
            Some((rms, rms, None))
        }
        // One number each: that of the curve, taken in the same way.
        Norm::Peak
        | Norm::Crossing
        | Norm::Mean
        | Norm::Final
        | Norm::Frequency
        | Norm::Decay
        | Norm::Noise => {
            let (from, to) = (instants.first()?, instants.last()?);
            let inside = |row: &&(f64, f64)| *from <= row.0 && row.0 <= *to;
            let expected_rows: Vec<_> = curve.iter().filter(inside).copied().collect();
            let rows: Vec<_> = series.iter().filter(inside).copied().collect();
            let probe = Reference { target: Target::Value(0.0), ..reference.clone() };
            let expected = against_value(&probe, curve, &expected_rows, instants, 0.0)?.1;
            against_value(&probe, series, &rows, instants, expected)
        }
    }
}

/// The unit at the end of a column's name: `ux_m` is in m.
pub fn unit_of(column: &str) -> String {
    let unit = column.rsplit_once('_').map_or("", |(_, unit)| unit);
    match unit {
        "m" | "n" | "s" => if unit == "n" { "N" } else { unit }.to_owned(),
        "pa" => "Pa".to_owned(),
        "j" => "J".to_owned(),
        "nm" => "N m".to_owned(),
        "ns" => "N s".to_owned(),
        "nms" => "N m s".to_owned(),
        "m3" => "m3".to_owned(),
        "hz" => "Hz".to_owned(),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reference(norm: Norm, target: Target) -> Reference {
        Reference {
            gauge: "g".to_owned(),
            column: "ux_m".to_owned(),
            label: "theory".to_owned(),
            norm,
            target,
            level: Some(0.5),
            running_mean: None,
            margin: 0.1,
            from: 0.0,
            to: 1.0,
            every: 0.25,
            at_curve: false,
            relative: false,
            gate: Some((0.0, 0.3)),
        }
    }

    fn entry(norm: Norm, target: Target) -> ErrorEntry {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("series")).unwrap();
        // x = t, to 1 s.
        let rows: String = (0..=10).map(|i| format!("{0},{0}\n", f64::from(i) / 10.0)).collect();
        std::fs::write(folder.path().join("series/g.csv"), format!("time_s,ux_m\n{rows}")).unwrap();
        std::fs::write(
            folder.path().join("c.csv"),
            "# source\ntime_s,mid,low,high\n0,0.2,-1,0.4\n1,1.2,-1,0.4\n",
        )
        .unwrap();
        error_of(folder.path(), &reference(norm, target), &folder.path().join("case.toml")).unwrap()
    }

    fn curve() -> Target {
        let band = Some(("low".to_owned(), "high".to_owned()));
        Target::Curve { file: "c.csv".to_owned(), column: "mid".to_owned(), band }
    }

    #[test]
    fn every_norm_measures_what_it_says() {
        assert!((entry(Norm::Rms, curve()).value - 0.2).abs() < 1e-12);
        assert!((entry(Norm::MaxAbs, curve()).value - 0.2).abs() < 1e-12);
        // Inside up to 0.4 + 0.1: the instants 0, 0.25, 0.5 of five.
        assert!((entry(Norm::ShareInside, curve()).value - 0.6).abs() < 1e-12);
        assert!((entry(Norm::Peak, Target::Value(0.9)).value - 0.1).abs() < 1e-12);
        assert!((entry(Norm::Crossing, Target::Value(0.4)).value - 0.1).abs() < 1e-12);
        assert!((entry(Norm::Mean, Target::Value(0.5)).value).abs() < 1e-12);
        assert!((entry(Norm::Final, Target::Value(2.0)).value + 1.0).abs() < 1e-12);
        assert!((entry(Norm::Final, curve()).value + 0.2).abs() < 1e-12);
    }

    #[test]
    fn the_rows_of_a_curve_can_be_the_instants() {
        let wanted = Reference { at_curve: true, to: 2.0, ..reference(Norm::Mean, curve()) };
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("series")).unwrap();
        std::fs::write(folder.path().join("series/g.csv"), "time_s,ux_m\n0,0\n0.4,0.4\n1,1\n").unwrap();
        std::fs::write(folder.path().join("c.csv"), "time_s,mid,low,high\n0.5,0.3,0,0\n1,1.0,0,0\n2,9,0,0\n")
            .unwrap();
        let found = error_of(folder.path(), &wanted, &folder.path().join("case.toml")).unwrap();
        // 0.5 against 0.3 and 1 against 1, the trapezoidal mean; the third row lies beyond the run.
        assert!((found.value - 0.1).abs() < 1e-12 && (found.from_s, found.to_s) == (0.5, 1.0), "{found:?}");
    }

    #[test]
    fn a_running_mean_takes_the_place_of_the_series() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("series")).unwrap();
        let rows: String = (0..=100).map(|i| format!("{},{}\n", f64::from(i) / 100.0, i % 2)).collect();
        std::fs::write(folder.path().join("series/g.csv"), format!("time_s,p_pa\n{rows}")).unwrap();
        let found = |norm| {
            let wanted = Reference {
                column: "p_pa".to_owned(),
                running_mean: Some(0.1),
                from: 0.1,
                to: 0.9,
                ..reference(norm, Target::Value(0.0))
            };
            error_of(folder.path(), &wanted, &folder.path().join("case.toml")).unwrap()
        };
        // 10 or 11 rows of 0 and 1 in turn: the mean is 0.45 to 0.55, and what departs from it is 0.45 to 0.55.
        assert!((found(Norm::Peak).measured - 0.5).abs() < 0.06);
        let noise = found(Norm::Noise);
        assert!((noise.measured - 1.0).abs() < 0.11 && noise.unit.is_empty(), "{noise:?}");
    }

    #[test]
    fn a_gate_is_judged() {
        let rms = entry(Norm::Rms, curve());
        assert_eq!((rms.passed, rms.unit.as_str(), rms.from_s, rms.to_s), (Some(true), "m", 0.0, 1.0));
        assert_eq!(entry(Norm::Peak, Target::Value(0.9)).passed, Some(false));
    }
}
