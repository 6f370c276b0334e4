//! `map.svg`: where a scene holds over two swept keys. A cell a setting, with a figure of its run's health and, in words and
//! colour, the verdicts on it.

use std::fmt::Write as _;

use super::runs::Trial;
use crate::report::escape;

const WIDTH: f64 = 118.0;
const HEIGHT: f64 = 46.0;
const LEFT: f64 = 96.0;
const TOP: f64 = 40.0;
const BOTTOM: f64 = 76.0;
const STYLE: &str = "text{font:11px system-ui,sans-serif;fill:#1d2733;text-anchor:middle}.figure{font-size:13px}.title{font-weight:600}";

/// How a run ended, in the colours of the map and the words of its key.
const ENDS: [(&str, &str); 4] = [
    ("#d6e6f2", "no verdict"),
    ("#f6d9a8", "a verdict"),
    ("#e08a76", "did not reach its end"),
    ("#ffffff", "not run"),
];

/// What the map shows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Map {
    /// The figure of the health in each cell.
    pub(super) figure: String,
    /// The key across and its values.
    pub(super) across: (String, Vec<String>),
    /// The key upwards and its values.
    pub(super) upwards: (String, Vec<String>),
}

/// The whole picture, of the first run of each setting.
pub(super) fn map(map: &Map, trials: &[Trial<'_>]) -> String {
    let ((across, columns), (upwards, rows)) = (&map.across, &map.upwards);
    let (wide, high) = (columns.len() as f64 * WIDTH, rows.len() as f64 * HEIGHT);
    let (width, height) = ((LEFT + wide + 20.0).max(LEFT + 4.0 * 150.0), TOP + high + BOTTOM);
    let title = escape(&format!("{} over {across} and {upwards}", map.figure));
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{title}\"><title>{title}</title><style>{STYLE}</style><rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>"
    );
    text(&mut svg, (LEFT + 0.5 * wide, 22.0), "title", &title);
    for (row, up) in rows.iter().enumerate() {
        let y = TOP + high - (row + 1) as f64 * HEIGHT;
        text(&mut svg, (LEFT - 24.0, y + 0.5 * HEIGHT + 4.0), "", up);
        for (column, right) in columns.iter().enumerate() {
            let options = [format!("{across}={right}"), format!("{upwards}={up}")];
            let is_it = |trial: &&Trial<'_>| options.iter().all(|one| trial.setting.options.contains(one));
            if let Some(trial) = trials.iter().find(is_it) {
                cell(&mut svg, (LEFT + column as f64 * WIDTH, y), trial, &map.figure);
            }
        }
    }
    for (column, right) in columns.iter().enumerate() {
        text(&mut svg, (LEFT + (column as f64 + 0.5) * WIDTH, TOP + high + 16.0), "", right);
    }
    text(&mut svg, (LEFT + 0.5 * wide, TOP + high + 34.0), "", across);
    let middle = TOP + 0.5 * high;
    let _ = write!(
        svg,
        "<text x=\"18\" y=\"{middle}\" transform=\"rotate(-90 18 {middle})\">{}</text>",
        escape(upwards)
    );
    for (index, (colour, words)) in ENDS.into_iter().enumerate() {
        let (x, y) = (LEFT + 150.0 * index as f64, height - 22.0);
        let _ = write!(
            svg,
            "<rect x=\"{x}\" y=\"{y}\" width=\"12\" height=\"12\" fill=\"{colour}\" stroke=\"#9aa3ad\"/><text x=\"{}\" y=\"{}\" style=\"text-anchor:start\">{words}</text>",
            x + 18.0,
            y + 10.0
        );
    }
    svg + "</svg>\n"
}

fn cell(svg: &mut String, (x, y): (f64, f64), trial: &Trial<'_>, figure: &str) {
    let verdicts = trial.json.as_ref().map_or(&[][..], |json| &json.verdicts[..]);
    let end = match trial.status() {
        "completed" if verdicts.is_empty() => 0,
        "completed" => 1,
        "not run" => 3,
        _ => 2,
    };
    let colour = ENDS[end].0;
    let _ = write!(
        svg,
        "<rect x=\"{x}\" y=\"{y}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"{colour}\" stroke=\"#fff\"/>"
    );
    let value = trial.json.as_ref().and_then(|json| json.health.get(figure)).copied();
    let lines = value.map(|value| format!("{value:.3}"));
    let lines: Vec<_> = lines.into_iter().chain(verdicts.iter().cloned()).collect();
    for (line, words) in lines.iter().enumerate() {
        let down = 0.5 * (HEIGHT - 13.0 * lines.len() as f64) + 13.0 * line as f64 + 10.5;
        let class = if line == 0 && value.is_some() { "figure" } else { "" };
        text(svg, (x + 0.5 * WIDTH, y + down), class, &escape(words));
    }
}

fn text(svg: &mut String, (x, y): (f64, f64), class: &str, words: &str) {
    let _ = write!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" class=\"{class}\">{words}</text>");
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::super::file::Setting;
    use super::*;

    #[test]
    fn every_setting_has_its_cell() {
        let (across, upwards) = (["1", "2", "3"], ["0.1", "0.2"]);
        let setting = |a: &str, b: &str| Setting {
            label: String::new(),
            series: String::new(),
            size: None,
            case: None,
            options: vec![format!("k={a}"), format!("l={b}")],
        };
        let settings: Vec<_> = across.iter().flat_map(|a| upwards.map(|b| setting(a, b))).collect();
        let trial = |setting| Trial { setting, repetition: 1, folder: PathBuf::new(), json: None };
        let trials: Vec<_> = settings.iter().map(trial).collect();
        let values = |all: &[&str]| all.iter().map(|&value| value.to_owned()).collect();
        let plan = Map {
            figure: "f".to_owned(),
            across: ("k".to_owned(), values(&across)),
            upwards: ("l".to_owned(), values(&upwards)),
        };
        let svg = map(&plan, &trials);
        assert_eq!(svg.matches("stroke=\"#fff\"").count(), 6);
        assert!(svg.contains("not run") && !svg.contains("NaN"));
    }
}
