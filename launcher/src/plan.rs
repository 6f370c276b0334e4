//! The plan printed before a run: processes, counts, needs, limits, and what is left out.

use std::fmt::Write as _;

use crate::check::Checked;

/// The plan as text.
pub fn describe(checked: &Checked) -> String {
    let header = &checked.shared.header;
    let mut text = format!("{} ({}-D), {}\n", header.name, header.dimension, checked.case.display());
    let names: Vec<_> = checked.programs.iter().map(|program| program.name.as_str()).collect();
    let _ = writeln!(text, "  processes    tidewall, {}", names.join(", "));
    let time = &checked.shared.time;
    let pinned = if time.pinned { ", every step" } else { " at most" };
    let _ = writeln!(text, "  time         to {} s, coupling step {:e} s{pinned}", time.end, time.max_dt);
    for report in &checked.reports {
        let mut heading = report.program.as_str();
        for figure in &report.plan {
            let shown = number(&figure.name, figure.value);
            let _ = writeln!(text, "  {heading:<12} {:<24} {shown:<12} {}", figure.name, figure.remark);
            heading = "";
        }
    }
    let mut heading = "left out";
    for entry in &checked.left_out {
        let _ = writeln!(text, "  {heading:<12} {}: {}", entry.what, entry.why);
        heading = "";
    }
    text
}

fn number(name: &str, value: f64) -> String {
    if name.ends_with("_bytes") {
        return format!("{:.1} MB", value / 1e6);
    }
    match value.abs() {
        size if value.fract() == 0.0 && size < 1e12 => format!("{value}"),
        size if (0.01..1e4).contains(&size) => format!("{value:.4}"),
        _ => format!("{value:.4e}"),
    }
}
