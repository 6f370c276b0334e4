//! What a study says: medians per setting, the front, the orders, the cheapest settings; as CSV and as a page of text.

use std::fmt::Write as _;

use super::file::{ErrorMeasure, Setting, Study};
use super::fit;
use super::runs::Trial;
use crate::run_json::RunJson;

/// One setting over its repetitions.
pub(super) struct Point<'a> {
    /// Its label.
    pub(super) label: &'a str,
    /// Its series.
    pub(super) series: &'a str,
    /// Its size.
    pub(super) size: Option<f64>,
    /// Median of the error.
    pub(super) error: f64,
    /// Median of the wall time, s.
    pub(super) wall_s: f64,
    /// Median of the CPU time of all processes, s.
    pub(super) core_s: f64,
}

/// The settings that have an error of this measure.
pub(super) fn points<'a>(study: &'a Study, trials: &[Trial<'_>], measure: &ErrorMeasure) -> Vec<Point<'a>> {
    let point = |setting: &'a Setting| {
        Some(Point {
            label: &setting.label,
            series: &setting.series,
            size: setting.size,
            error: middle(trials, setting, |trial| trial.error(measure))?,
            wall_s: middle(trials, setting, |trial| trial.figure(|json| json.wall_s))?,
            core_s: middle(trials, setting, |trial| trial.figure(|json| json.cpu_s))?,
        })
    };
    study.settings.iter().filter_map(point).collect()
}

/// The observed order of every series with sizes.
pub(super) fn orders(points: &[Point<'_>]) -> Vec<(String, f64)> {
    let mut names: Vec<&str> = points.iter().map(|point| point.series).collect();
    names.sort_unstable();
    names.dedup();
    let order = |name: &&str| {
        let own = points.iter().filter(|point| point.series == *name);
        let sized: Vec<_> = own.filter_map(|point| Some((point.size?, point.error))).collect();
        Some(((*name).to_owned(), fit::order(&sized)?))
    };
    names.iter().filter_map(order).collect()
}

/// `study.csv`: one row a run.
pub(super) fn csv(study: &Study, trials: &[Trial<'_>]) -> String {
    let mut text = String::from("setting,series,size,repetition,status");
    for measure in &study.errors {
        let _ = write!(text, ",{}", measure.name());
    }
    text.push_str(",wall_s,core_s,steps,water_particles,solid_nodes,peak_rss_bytes,verdicts\n");
    for trial in trials {
        let setting = trial.setting;
        let size = setting.size.map_or(String::new(), |size| size.to_string());
        let (label, series) = (quoted(&setting.label), quoted(&setting.series));
        let _ = write!(text, "{label},{series},{size},{},{}", trial.repetition, trial.status());
        for measure in &study.errors {
            let error = trial.error(measure).map_or(String::new(), |error| format!("{error:.6e}"));
            let _ = write!(text, ",{error}");
        }
        match &trial.json {
            Some(json) => {
                let count = |name| json.counts.get(name).copied().unwrap_or(0);
                let (water, nodes) = (count("water_particles"), count("solid_nodes"));
                let verdicts = quoted(&json.verdicts.join(" "));
                let (wall, core, steps) = (json.wall_s, json.cpu_s, json.steps);
                let peak = json.peak_rss_bytes();
                let _ = writeln!(text, ",{wall:.3},{core:.3},{steps},{water},{nodes},{peak:.0},{verdicts}");
            }
            None => text.push_str(",,,,,,,\n"),
        }
    }
    text
}

/// A field of a CSV file.
fn quoted(text: &str) -> String {
    if text.contains([',', '"']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

/// `study.md`: the table, the fronts, the orders and the cheapest settings, in words.
pub(super) fn page(study: &Study, trials: &[Trial<'_>], machine: &str) -> String {
    let mut text = format!("# {}\n\nCase `{}`", study.name, study.case.display());
    let _ = writeln!(text, "; {machine}; medians of {} run(s) a setting.\n", study.repetitions);
    table(&mut text, study, trials);
    for measure in &study.errors {
        say(&mut text, study, measure, &points(study, trials, measure));
    }
    for trial in trials {
        let verdicts = trial.json.as_ref().map_or(&[][..], |json| &json.verdicts);
        if !verdicts.is_empty() {
            let _ = writeln!(text, "\n`{}`: verdict {}.", trial.setting.label, verdicts.join(", "));
        }
    }
    for trial in trials.iter().filter(|trial| !trial.is_completed()) {
        let failure = trial.json.as_ref().and_then(|json| json.failure.as_ref());
        let why = failure.map_or(String::new(), |failure| format!(": {failure}"));
        let (label, repetition) = (&trial.setting.label, trial.repetition);
        let _ = writeln!(text, "\n`{label}`, run {repetition}: {}{why}.", trial.status());
    }
    text
}

/// One row a setting: what it cost, against the first one, and its errors.
fn table(text: &mut String, study: &Study, trials: &[Trial<'_>]) {
    text.push_str("| setting | wall time | CPU time | of the first | steps | CPU a step | memory |");
    for measure in &study.errors {
        let _ = write!(text, " {} |", measure.name());
    }
    text.push_str(&format!("\n|---|---|---|---|---|---|---|{}\n", "---|".repeat(study.errors.len())));
    let figures = |setting: &Setting| {
        let of = |value: fn(&RunJson) -> f64| middle(trials, setting, |trial| trial.figure(value));
        Some([of(|j| j.wall_s)?, of(|j| j.cpu_s)?, of(|j| j.steps as f64)?, of(RunJson::peak_rss_bytes)?])
    };
    let first = study.settings.first().and_then(figures).map(|figures| figures[1]);
    for setting in &study.settings {
        let Some([wall_s, core_s, steps, bytes]) = figures(setting) else { continue };
        let share = first.map_or(f64::NAN, |first| 100.0 * core_s / first);
        let (a_step, megabytes) = (1e3 * core_s / steps.max(1.0), bytes / 1e6);
        let _ = write!(
            text,
            "| {} | {} s | {} s | {share:.0} % | {steps:.0} | {a_step:.2} ms | {megabytes:.0} MB |",
            setting.label,
            digits(wall_s),
            digits(core_s)
        );
        for measure in &study.errors {
            let error = middle(trials, setting, |trial| trial.error(measure));
            let _ = write!(text, " {} |", error.map_or(String::new(), |error| format!("{error:.3e}")));
        }
        text.push('\n');
    }
}

/// What one error measure says.
fn say(text: &mut String, study: &Study, measure: &ErrorMeasure, points: &[Point<'_>]) {
    let costs: Vec<_> = points.iter().map(|point| (point.core_s, point.error)).collect();
    let front: Vec<_> = points
        .iter()
        .zip(fit::front(&costs))
        .filter(|(_, is_front)| *is_front)
        .map(|(p, _)| p.label)
        .collect();
    let _ = writeln!(text, "\n{}: on the front of error and CPU time: {}.", measure.name(), front.join("; "));
    for (series, order) in orders(points) {
        let of = if series.is_empty() { String::new() } else { format!(" of {series}") };
        let _ = writeln!(text, "Observed order{of} in {}: {order:.2}.", study.along);
    }
    for &wanted in &measure.wanted {
        let _ = match fit::cheapest(&costs, wanted).map(|index| &points[index]) {
            Some(best) => writeln!(
                text,
                "Cheapest for an error of {wanted:.1e}: {} ({} s of CPU, error {:.2e}).",
                best.label,
                digits(best.core_s),
                best.error
            ),
            None => writeln!(text, "No setting has an error of at most {wanted:.1e}."),
        };
    }
}

/// Seconds with a tenth, small ones with three digits.
fn digits(seconds: f64) -> String {
    if seconds < 1.0 { format!("{seconds:.3}") } else { format!("{seconds:.1}") }
}

/// Median over the repetitions of a setting.
fn middle(trials: &[Trial<'_>], setting: &Setting, value: impl Fn(&Trial<'_>) -> Option<f64>) -> Option<f64> {
    let own = trials.iter().filter(|trial| trial.setting == setting);
    fit::median(own.filter_map(value).collect())
}
