//! The pages themselves.

use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use super::energy;
use super::picture::{self, View};
use super::scene::Scene;
use super::svg::{Band, Line, Plot, escape};
use crate::compare::{Table, unit_of};
use crate::run_json::{Continued, RunJson, Status};
use protocol::phases::PhaseTime;

/// Instants a run is shown at.
const PICTURES: usize = 6;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;color:#1d2733;background:#fff;max-width:960px;margin:2em auto;padding:0 1em}\
h1{font-size:1.5em;margin-bottom:0}h2{font-size:1.15em;margin-top:2em;border-bottom:1px solid #d8dde3}\
table{border-collapse:collapse;font-size:13.5px;margin:.5em 0}td,th{padding:2px 12px 2px 0;text-align:left;vertical-align:top}\
td.n{text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums}.good{color:#1f7a43}.bad{color:#b3261e;font-weight:600}\
svg{width:100%;height:auto;font:11px system-ui,sans-serif;fill:#1d2733}svg .title{font-size:13px;font-weight:600}\
.grid{stroke:#e3e7ec;stroke-width:1;fill:none}.pictures{display:grid;grid-template-columns:1fr 1fr;gap:1em}figure{margin:0}img{max-width:100%;border:1px solid #e3e7ec}\
figcaption{font-size:13px;color:#55606c}";

/// A page around a body, with the style all pages share.
pub(crate) fn page(title: &str, body: &str) -> String {
    format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
         <title>{0}</title><style>{STYLE}</style></head><body>{body}</body></html>\n",
        escape(title)
    )
}

/// The page of one run.
pub(super) fn of_run(scene: &Scene) -> String {
    let json = &scene.json;
    let mut body = format!("<h1>{}</h1>", escape(&json.case));
    body += &head(json);
    body += &escalations(json);
    body += &errors(json);
    for (name, table) in scene.series.iter().filter(|series| series.0 != "interface") {
        body += &gauge_plots(scene, name, table);
    }
    body += &pictures(scene);
    body += &ledger(scene);
    body += &energy::balance(json);
    body += &phases(json);
    body += &left_out(json);
    body += &health(json);
    page(&json.case, &body)
}

/// One page comparing several runs: errors against cost, and every gauge they share.
pub(super) fn of_several(scenes: &[Scene]) -> String {
    let mut body = "<h1>Comparison</h1><h2>Error against run time</h2><table><tr><th>run</th><th>status</th>\
                    <th>wall s</th><th>CPU s</th><th>errors</th></tr>"
        .to_owned();
    for scene in scenes {
        let json = &scene.json;
        let errors: Vec<_> = json.errors.iter().map(error_words).collect();
        let _ = write!(
            body,
            "<tr><td>{}</td><td>{}</td><td class=\"n\">{:.1}</td><td class=\"n\">{:.1}</td><td>{}</td></tr>",
            escape(&scene.folder.display().to_string()),
            status(json),
            json.wall_s,
            json.cpu_s,
            errors.join("<br>")
        );
    }
    body += "</table>";
    let first = &scenes[0];
    for (name, table) in first.series.iter().filter(|series| series.0 != "interface") {
        for column in &table.names {
            let mut plot = reference_plot(first, name, column);
            for (index, scene) in scenes.iter().enumerate() {
                let series = scene.series.iter().find(|series| series.0 == *name);
                if let Some(points) = series.and_then(|series| series.1.column(column)) {
                    let run = scene
                        .folder
                        .file_name()
                        .map_or_else(String::new, |name| name.to_string_lossy().into_owned());
                    plot.lines.push(Line { name: run, points, colour: index, dashed: false });
                }
            }
            body += &plot.render();
        }
    }
    page("Tidewall: comparison", &body)
}

fn status(json: &RunJson) -> String {
    match json.status {
        Status::Completed => "<span class=\"good\">completed</span>".to_owned(),
        Status::Running => "running".to_owned(),
        Status::Interrupted => "<span class=\"bad\">interrupted by the user</span>".to_owned(),
        Status::Failed => "<span class=\"bad\">failed</span>".to_owned(),
    }
}

fn head(json: &RunJson) -> String {
    let counts: Vec<_> =
        json.counts.iter().map(|(name, count)| format!("{count} {}", name.replace('_', " "))).collect();
    let mut text = format!(
        "<p>{}-D, {}; t = {:.6} s in {} steps; {:.1} s of wall time, {:.1} s of CPU, {} threads a solver; Tidewall {}.<br>{}.</p>",
        json.dimension,
        status(json),
        json.simulated_s,
        json.steps,
        json.wall_s,
        json.cpu_s,
        json.threads,
        escape(&json.tidewall),
        escape(&counts.join(", "))
    );
    if let Some(Continued { run, step, time_s }) = &json.continued {
        let _ = write!(
            text,
            "<p>Continued from {} at t = {time_s:.6} s, step {step}; sums and extremes include that run's.</p>",
            escape(run)
        );
    }
    if let Some(failure) = &json.failure {
        let _ = write!(text, "<p class=\"bad\">{}</p>", escape(&failure.to_string()));
    }
    for verdict in &json.verdicts {
        let _ = write!(
            text,
            "<p class=\"bad\">Verdict: {}. The loads of this run are not to be trusted; see the interface ledger below.</p>",
            escape(verdict)
        );
    }
    text
}

/// What the guard of the coupling has changed; empty if nothing.
fn escalations(json: &RunJson) -> String {
    let count = |name: &str| json.health.get(name).copied().unwrap_or_default();
    let (robin, passes, steps) =
        (count("escalations_to_robin"), count("escalations_to_passes"), count("escalated_steps"));
    if robin + passes == 0.0 {
        return String::new();
    }
    format!(
        "<p class=\"bad\">The load became restless: the Robin wall took over {robin} times, passes over the step {passes} \
         times, for {steps} steps in all. When and why stands in log/coupler.jsonl.</p>"
    )
}

fn error_words(error: &crate::compare::ErrorEntry) -> String {
    let verdict = match error.passed {
        Some(true) => " <span class=\"good\">kept</span>",
        Some(false) => " <span class=\"bad\">missed</span>",
        None => "",
    };
    format!(
        "{} {}: {:.4e} {}{verdict}",
        escape(&error.gauge),
        escape(&error.norm),
        error.value,
        escape(&error.unit)
    )
}

fn errors(json: &RunJson) -> String {
    if json.errors.is_empty() {
        return String::new();
    }
    let mut text = "<h2>Errors</h2><table><tr><th>gauge</th><th>against</th><th>norm</th><th>error</th><th>measured</th>\
                    <th>expected</th><th>window</th><th>bounds</th><th></th></tr>"
        .to_owned();
    for error in &json.errors {
        let expected = error.expected.map_or(String::new(), |expected| format!("{expected:.5}"));
        let gate = error.gate.map_or(String::new(), |(low, high)| format!("{low} to {high}"));
        let verdict = match error.passed {
            Some(true) => "<span class=\"good\">kept</span>",
            Some(false) => "<span class=\"bad\">missed</span>",
            None => "",
        };
        let _ = write!(
            text,
            "<tr><td>{}.{}</td><td>{}</td><td>{}</td><td class=\"n\">{:.4e} {}</td><td class=\"n\">{:.5}</td>\
             <td class=\"n\">{expected}</td><td>{:.3} to {:.3} s</td><td>{gate}</td><td>{verdict}</td></tr>",
            escape(&error.gauge),
            escape(&error.column),
            escape(&error.reference),
            escape(&error.norm),
            error.value,
            escape(&error.unit),
            error.measured,
            error.from_s,
            error.to_s
        );
    }
    text + "</table>"
}

fn reference_plot(scene: &Scene, gauge: &str, column: &str) -> Plot {
    let (mut lines, mut bands) = (Vec::new(), Vec::new());
    for (index, curve) in scene.reference_curves(gauge, column).into_iter().enumerate() {
        if let Some((low, high)) = curve.band {
            bands.push(Band { name: "range".to_owned(), low, high });
        }
        lines.push(Line { name: curve.label, points: curve.middle, colour: 5 - index % 4, dashed: true });
    }
    let unit = unit_of(column);
    let y_label = if unit.is_empty() { column.to_owned() } else { format!("{column} ({unit})") };
    Plot { title: format!("{gauge}: {column}"), x_label: "time (s)".to_owned(), y_label, lines, bands }
}

fn gauge_plots(scene: &Scene, name: &str, table: &Table) -> String {
    let mut text = format!("<h2>{}</h2>", escape(name));
    for column in &table.names {
        let mut plot = reference_plot(scene, name, column);
        let points = table.column(column).unwrap_or_default();
        plot.lines.insert(0, Line { name: "Tidewall".to_owned(), points, colour: 0, dashed: false });
        text += &plot.render();
    }
    text
}

fn pictures(scene: &Scene) -> String {
    let fields = scene.folder.join("fields");
    let (water, solid) = (picture::frames(&fields, "fluid.pvd"), picture::frames(&fields, "solid.pvd"));
    let leading = if water.is_empty() { &solid } else { &water };
    let count = leading.len().min(PICTURES);
    let chosen: Vec<_> = (1..=count).map(|i| (i * leading.len()).div_ceil(count) - 1).collect();
    let read = |list: &[(f64, std::path::PathBuf)], index: usize| {
        list.get(index).and_then(|frame| picture::read(&frame.1)).unwrap_or_default()
    };
    let waters: Vec<_> = chosen.iter().map(|&index| read(&water, index)).collect();
    let solids: Vec<_> = chosen.iter().map(|&index| read(&solid, index)).collect();
    if chosen.is_empty() {
        return String::new();
    }
    let all: Vec<_> = if water.is_empty() { solids.clone() } else { waters.clone() };
    let view = View::new(&all, tank(scene, &all), particle_size(scene));
    let mut text = "<h2>Pictures</h2><div class=\"pictures\">".to_owned();
    for (index, &frame) in chosen.iter().enumerate() {
        let png = view.draw(Some(&waters[index]), Some(&solids[index]));
        let _ = write!(
            text,
            "<figure><img alt=\"t = {0:.3} s\" src=\"data:image/png;base64,{1}\"><figcaption>t = {0:.3} s; speed from 0 (dark) \
             to {2:.2} m/s (light)</figcaption></figure>",
            leading[frame].0,
            STANDARD.encode(png),
            view.fastest()
        );
    }
    text + "</div>"
}

fn tank(scene: &Scene, frames: &[protocol::vtk::Frame]) -> ([f32; 3], [f32; 3]) {
    let corner = |values: &[f64]| std::array::from_fn(|axis| values.get(axis).map_or(0.0, |&x| x as f32));
    if let Some(domain) = &scene.shared.domain {
        return (corner(&domain.region.min), corner(&domain.region.max));
    }
    let (mut least, mut greatest) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for point in frames.iter().flat_map(|frame| frame.points.chunks_exact(3)) {
        for axis in 0..3 {
            least[axis] = least[axis].min(point[axis]);
            greatest[axis] = greatest[axis].max(point[axis]);
        }
    }
    (least, greatest)
}

/// Size a particle is drawn with, m: from the water's volume at the start.
fn particle_size(scene: &Scene) -> f32 {
    let count = scene.json.counts.get("water_particles").copied().unwrap_or_default();
    let regions = scene.shared.fluid.as_ref().map(|fluid| fluid.regions.as_slice()).unwrap_or_default();
    let dimension = scene.json.dimension;
    let volume: f64 =
        regions.iter().map(|region| (0..dimension).map(|axis| region.length(axis)).product::<f64>()).sum();
    if count == 0 { 1e-3 } else { (volume / count as f64).powf(1.0 / dimension as f64) as f32 }
}

fn ledger(scene: &Scene) -> String {
    let Some((_, table)) = scene.series.iter().find(|series| series.0 == "interface") else {
        return String::new();
    };
    let plots: [(&str, &[(&str, &str)]); 5] = [
        (
            "Load on the structure along x",
            &[
                ("fx_n", "pair reaction"),
                ("marker_fx_n", "marker pressures"),
                ("solid_fx_n", "felt by the structure"),
            ],
        ),
        (
            "Moment about the origin",
            &[("mz_nm", "given by the water"), ("solid_mz_nm", "felt by the structure")],
        ),
        (
            "Impulse along x",
            &[("impulse_x_ns", "given by the water"), ("solid_impulse_x_ns", "taken by the structure")],
        ),
        (
            "Work over the interface",
            &[("work_fluid_j", "given by the water"), ("work_solid_j", "taken by the structure")],
        ),
        ("Load jump J over the last wet steps (above 1: unstable)", &[("load_jump", "J")]),
    ];
    let mut text = "<h2>Interface ledger</h2>".to_owned();
    for (title, columns) in plots {
        let line = |(index, (column, name)): (usize, &(&str, &str))| {
            let points = table.column(column)?;
            Some(Line { name: (*name).to_owned(), points, colour: index, dashed: index > 0 })
        };
        let lines: Vec<_> = columns.iter().enumerate().filter_map(line).collect();
        let y_label = columns.first().map_or(String::new(), |(column, _)| unit_of(column));
        let plot = Plot {
            title: title.to_owned(),
            x_label: "time (s)".to_owned(),
            y_label,
            lines,
            bands: Vec::new(),
        };
        text += &plot.render();
    }
    text
}

fn phases(json: &RunJson) -> String {
    let mut text = "<h2>Where the time went</h2>".to_owned();
    text += &phase_table("time loop of the launcher", &json.time_loop, json.wall_s);
    for process in &json.processes {
        let (name, megabytes) = (&process.name, process.peak_rss_bytes as f64 / 1e6);
        let title = format!("{name} ({:.1} s of CPU, {megabytes:.1} MB)", process.cpu_s);
        text += &phase_table(&title, &process.phases, json.wall_s);
    }
    text
}

fn phase_table(title: &str, phases: &[PhaseTime], wall_s: f64) -> String {
    let row = |phase: &PhaseTime| {
        let share = 100.0 * phase.wall_s / wall_s.max(1e-9);
        format!(
            "<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{:.3}</td><td class=\"n\">{share:.1} %</td></tr>",
            escape(&phase.name),
            phase.calls,
            phase.wall_s
        )
    };
    let rows: String = phases.iter().map(row).collect();
    let head = format!("<tr><th>{}</th><th>calls</th><th>wall s</th><th>share</th></tr>", escape(title));
    if rows.is_empty() { rows } else { format!("<table>{head}{rows}</table>") }
}

fn left_out(json: &RunJson) -> String {
    let rows: String = json
        .left_out
        .iter()
        .map(|entry| format!("<tr><td>{}</td><td>{}</td></tr>", escape(&entry.what), escape(&entry.why)))
        .collect();
    if rows.is_empty() { rows } else { format!("<h2>Left out</h2><table>{rows}</table>") }
}

fn health(json: &RunJson) -> String {
    let row = |(name, value): (&String, &f64)| {
        format!("<tr><td>{}</td><td class=\"n\">{value:.6e}</td></tr>", escape(name))
    };
    let rows: String = json.health.iter().map(row).collect();
    if rows.is_empty() { rows } else { format!("<h2>Health</h2><table>{rows}</table>") }
}
