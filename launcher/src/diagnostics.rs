//! Mistakes in a case, shown with the lines they stand in.

use ariadne::{CharSet, Config, IndexType, Label, Report, ReportKind, Source};
use protocol::case::{CaseFile, Diagnostic, Place};

/// All diagnostics of a case, ready to print.
pub fn render(case: &CaseFile, diagnostics: &[Diagnostic], colour: bool) -> String {
    let name = case.path().display().to_string();
    let mut out = Vec::new();
    let config =
        Config::default().with_color(colour).with_char_set(CharSet::Unicode).with_index_type(IndexType::Byte);
    for diagnostic in diagnostics {
        let Place::File { start, end, .. } = diagnostic.place else {
            out.extend(format!("Error: {diagnostic}\n").into_bytes());
            continue;
        };
        let span = (name.as_str(), start..end.max(start + 1).min(case.text().len().max(1)));
        let message = format!("{}: {}", diagnostic.key, diagnostic.message);
        let mut label = Label::new(span.clone());
        if !diagnostic.allowed.is_empty() {
            label = label.with_message(format!("allowed: {}", diagnostic.allowed));
        }
        let mut report = Report::build(ReportKind::Error, span)
            .with_config(config)
            .with_message(message)
            .with_label(label);
        if !diagnostic.hint.is_empty() {
            report = report.with_help(&diagnostic.hint);
        }
        // Writing to memory cannot fail.
        let _ = report.finish().write((name.as_str(), Source::from(case.text())), &mut out);
    }
    let count = diagnostics.len();
    out.extend(
        format!("{count} mistake{} in {name}; nothing was started.\n", if count == 1 { "" } else { "s" })
            .into_bytes(),
    );
    String::from_utf8_lossy(&out).into_owned()
}
