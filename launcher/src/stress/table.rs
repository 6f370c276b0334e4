//! The suite's table: on the terminal, as CSV, and as a self-contained page.

use std::fmt::Write as _;

use super::promise::{Expect, Promise};
use crate::report::{escape, page};

/// One case after its run.
pub(super) struct Row {
    /// Its file's name.
    pub(super) name: String,
    /// What it promised.
    pub(super) promise: Promise,
    /// What happened.
    pub(super) happened: String,
    /// What broke the promise; empty when it was kept.
    pub(super) broken: Vec<String>,
    /// Wall time, s.
    pub(super) wall_s: f64,
    /// CPU time of all processes, s.
    pub(super) cpu_s: f64,
}

impl Row {
    fn verdict(&self) -> &'static str {
        if self.broken.is_empty() { "kept" } else { "BROKEN" }
    }

    fn promised(&self) -> String {
        match &self.promise.expect {
            Expect::Stable(_) => "stable".to_owned(),
            Expect::Stopped { exit_code, .. } => format!("stopped ({exit_code})"),
        }
    }

    /// For the terminal.
    pub(super) fn line(&self) -> String {
        let (verdict, promised) = (self.verdict(), self.promised());
        let mut line = format!(
            "{:<28} {promised:<12} {verdict:<6} {:>7.1} s  {}",
            self.name, self.wall_s, self.happened
        );
        for reason in &self.broken {
            let _ = write!(line, "\n{:>42} {reason}", "");
        }
        line
    }
}

/// `stress.csv`.
pub(super) fn csv(rows: &[Row]) -> String {
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\"").replace('\n', " "));
    let mut text = "name,promised,verdict,wall_s,cpu_s,happened,broken\n".to_owned();
    for row in rows {
        let (promised, verdict) = (row.promised(), row.verdict());
        let (happened, broken) = (quoted(&row.happened), quoted(&row.broken.join("; ")));
        let Row { name, wall_s, cpu_s, .. } = row;
        let _ = writeln!(text, "{name},{promised},{verdict},{wall_s:.2},{cpu_s:.2},{happened},{broken}");
    }
    text
}

/// `stress.html`.
pub(super) fn html(rows: &[Row]) -> String {
    let kept = rows.iter().filter(|row| row.broken.is_empty()).count();
    let mut body = format!(
        "<h1>Stability suite</h1><p>{kept} of {} promises kept.</p><table><tr><th>case</th><th>what makes it hard</th>\
         <th>promised</th><th></th><th>what happened</th><th>wall s</th><th>CPU s</th></tr>",
        rows.len()
    );
    for row in rows {
        let class = if row.broken.is_empty() { "good" } else { "bad" };
        let reasons: String = row.broken.iter().map(|reason| format!("<br>{}", escape(reason))).collect();
        let _ = write!(
            body,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td class=\"{class}\">{}</td><td>{}<span class=\"bad\">{reasons}</span></td>\
             <td class=\"n\">{:.1}</td><td class=\"n\">{:.1}</td></tr>",
            escape(&row.name),
            escape(&row.promise.about),
            row.promised(),
            row.verdict(),
            escape(&row.happened),
            row.wall_s,
            row.cpu_s
        );
    }
    page("Tidewall: stability suite", &(body + "</table>"))
}
