//! `study.svg`: error against wall time and against core-seconds, both axes logarithmic, a row for each error measure.

use std::fmt::Write as _;

use super::file::{Peer, Study};
use super::fit;
use super::runs::Trial;
use super::summary::{Point, points};
use crate::report::escape;

const PALETTE: [&str; 6] = ["#0b5fa5", "#c8442b", "#2a7f4f", "#8a5a9e", "#b8860b", "#4a4a4a"];
const PEER_COLOUR: &str = "#7a7f87";
const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 380.0;
const LEFT: f64 = 70.0;
const RIGHT: f64 = 20.0;
const TOP: f64 = 46.0;
const BOTTOM: f64 = 50.0;
/// Width of a letter and height of a line of a label.
const LETTER: f64 = 5.8;
const LINE: f64 = 12.0;
const STYLE: &str = "text{font:11px system-ui,sans-serif;fill:#1d2733}.title{font-size:13px;font-weight:600}.grid{stroke:#e3e7ec;fill:none}";

/// Something drawn: what it costs, its error, and how it is marked.
struct Mark<'a> {
    label: &'a str,
    at: (f64, f64),
    series: Option<usize>,
    is_front: bool,
}

/// The whole picture.
pub(super) fn picture(study: &Study, trials: &[Trial<'_>]) -> String {
    let (width, height) = (2.0 * WIDTH, HEIGHT * study.errors.len() as f64);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{0}\"><title>{0}</title><style>{STYLE}</style><rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>",
        escape(&study.name)
    );
    for (row, measure) in study.errors.iter().enumerate() {
        let points = points(study, trials, measure);
        let peers: Vec<_> = study.peers.iter().filter(|peer| peer.norm == measure.norm).collect();
        let columns: [(&str, Cost<'_>, PeerCost); 2] = [
            ("wall time, s", &|point| point.wall_s, |peer| peer.wall_s),
            ("CPU time of all cores, s", &|point| point.core_s, |peer| peer.core_s),
        ];
        for (column, (cost_name, cost, peer_cost)) in columns.into_iter().enumerate() {
            let marks = marks(&points, &peers, cost, peer_cost);
            let title = format!("{}: error against {cost_name}", measure.name());
            let (x, y) = (column as f64 * WIDTH, row as f64 * HEIGHT);
            let _ =
                write!(svg, "<g transform=\"translate({x} {y})\">{}</g>", panel(&title, cost_name, &marks));
        }
    }
    svg + "</svg>\n"
}

type Cost<'a> = &'a dyn Fn(&Point<'_>) -> f64;
type PeerCost = fn(&Peer) -> Option<f64>;

fn marks<'a>(
    points: &'a [Point<'_>],
    peers: &[&'a Peer],
    cost: Cost<'_>,
    peer_cost: PeerCost,
) -> Vec<Mark<'a>> {
    let places: Vec<_> = points.iter().map(|point| (cost(point), point.error)).collect();
    let mut names: Vec<&str> = points.iter().map(|point| point.series).collect();
    names.sort_unstable();
    names.dedup();
    let own = points.iter().zip(&places).zip(fit::front(&places)).map(|((point, &at), is_front)| {
        let series = names.iter().position(|name| *name == point.series);
        Mark { label: point.label, at, series, is_front }
    });
    let theirs = peers.iter().filter_map(|peer| {
        let at = (peer_cost(peer)?, peer.error);
        Some(Mark { label: peer.label.as_str(), at, series: None, is_front: false })
    });
    // A logarithm has no place for what is not positive.
    own.chain(theirs).filter(|mark| mark.at.0 > 0.0 && mark.at.1 > 0.0).collect()
}

/// Whole powers of ten around the values; at least one.
fn decades(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let low = values.clone().fold(f64::INFINITY, f64::min);
    let high = values.fold(0.0, f64::max);
    if !(low.is_finite() && high > 0.0) {
        return (0.0, 1.0);
    }
    let (low, high) = ((low.log10() - 0.05).floor(), (high.log10() + 0.05).ceil());
    (low, high.max(low + 1.0))
}

fn panel(title: &str, x_label: &str, marks: &[Mark<'_>]) -> String {
    let x_range = decades(marks.iter().map(|mark| mark.at.0));
    let y_range = decades(marks.iter().map(|mark| mark.at.1));
    let place = |at: (f64, f64)| {
        let share = |value: f64, range: (f64, f64)| (value.log10() - range.0) / (range.1 - range.0);
        let x = LEFT + share(at.0, x_range) * (WIDTH - LEFT - RIGHT);
        (x, HEIGHT - BOTTOM - share(at.1, y_range) * (HEIGHT - TOP - BOTTOM))
    };
    let mut svg = format!("<text x=\"{LEFT}\" y=\"20\" class=\"title\">{}</text>", escape(title));
    grid(&mut svg, x_range, y_range, x_label);
    joined(&mut svg, marks, &place);
    for mark in marks {
        let (x, y) = place(mark.at);
        let colour = mark.series.map_or(PEER_COLOUR, |series| PALETTE[series % PALETTE.len()]);
        if mark.is_front {
            let _ = write!(
                svg,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"8\" fill=\"none\" stroke=\"{colour}\"/>"
            );
        }
        let _ = match mark.series {
            Some(_) => write!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{colour}\"/>"),
            None => write!(svg, "<path d=\"M{x:.1} {:.1}l5 5l-5 5l-5 -5z\" fill=\"{colour}\"/>", y - 5.0),
        };
    }
    labels(&mut svg, marks, &place);
    svg
}

/// The labels, each moved up or down until it covers no other and no mark.
fn labels(svg: &mut String, marks: &[Mark<'_>], place: &dyn Fn((f64, f64)) -> (f64, f64)) {
    let around = |mark: &Mark<'_>| {
        let (x, y) = place(mark.at);
        (x - 6.0, x + 6.0, y + 4.0)
    };
    let mut taken: Vec<(f64, f64, f64)> = marks.iter().map(around).collect();
    for mark in marks {
        let (x, y) = place(mark.at);
        let width = LETTER * mark.label.chars().count() as f64;
        // Near the right edge a label stands on the left of its mark.
        let is_left = x + 11.0 + width > WIDTH;
        let start = if is_left { x - 11.0 - width } else { x + 11.0 };
        let is_free = |at: f64| {
            taken
                .iter()
                .all(|&(from, to, other)| (other - at).abs() >= LINE || from > start + width || to < start)
        };
        let moves = (0..12).flat_map(|i| [f64::from(i) * LINE, -f64::from(i) * LINE]);
        let at = moves.map(|shift| y + 4.0 + shift).find(|&at| is_free(at)).unwrap_or(y + 4.0);
        taken.push((start, start + width, at));
        let label = escape(mark.label);
        let (anchor, edge) = if is_left { ("end", x - 11.0) } else { ("start", start) };
        let _ = write!(svg, "<text x=\"{edge:.1}\" y=\"{at:.1}\" text-anchor=\"{anchor}\">{label}</text>");
    }
}

/// A line through the marks of each series, in the order of the settings.
fn joined(svg: &mut String, marks: &[Mark<'_>], place: &dyn Fn((f64, f64)) -> (f64, f64)) {
    let last = marks.iter().filter_map(|mark| mark.series).max();
    for series in 0..=last.unwrap_or(0) {
        let mut own: Vec<_> = marks.iter().filter(|mark| mark.series == Some(series)).collect();
        own.sort_by(|a, b| a.at.0.total_cmp(&b.at.0));
        let path: Vec<_> =
            own.iter().map(|mark| place(mark.at)).map(|(x, y)| format!("{x:.1} {y:.1}")).collect();
        if path.len() > 1 {
            let colour = PALETTE[series % PALETTE.len()];
            let _ = write!(
                svg,
                "<path d=\"M{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1\" opacity=\"0.5\"/>",
                path.join("L")
            );
        }
    }
}

fn grid(svg: &mut String, x_range: (f64, f64), y_range: (f64, f64), x_label: &str) {
    let (bottom, right) = (HEIGHT - BOTTOM, WIDTH - RIGHT);
    let steps = |range: (f64, f64)| {
        let decades = (range.0 as i32..=range.1 as i32).map(move |power| (power, range));
        decades.map(|(power, range)| (power, (f64::from(power) - range.0) / (range.1 - range.0)))
    };
    for (power, share) in steps(x_range) {
        let x = LEFT + share * (right - LEFT);
        let _ = write!(
            svg,
            "<path d=\"M{x:.1} {TOP}V{bottom}\" class=\"grid\"/><text x=\"{x:.1}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text>",
            bottom + 16.0,
            shown(power)
        );
    }
    for (power, share) in steps(y_range) {
        let y = bottom - share * (bottom - TOP);
        let _ = write!(
            svg,
            "<path d=\"M{LEFT} {y:.1}H{right}\" class=\"grid\"/><text x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            LEFT - 6.0,
            y + 4.0,
            shown(power)
        );
    }
    let _ = write!(
        svg,
        "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text>",
        0.5 * (LEFT + right),
        HEIGHT - 12.0,
        escape(x_label)
    );
}

/// A power of ten.
fn shown(power: i32) -> String {
    if (-2..=4).contains(&power) { format!("{}", 10f64.powi(power)) } else { format!("1e{power}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_hold_the_values() {
        assert_eq!(decades([0.03, 5.0].into_iter()), (-2.0, 1.0));
        assert_eq!(decades(std::iter::empty()), (0.0, 1.0));
    }

    #[test]
    fn the_front_is_marked_and_the_series_joined() {
        let mark = |at, is_front| Mark { label: "a<b", at, series: Some(0), is_front };
        let svg =
            panel("t", "x", &[mark((1.0, 1.0), true), mark((10.0, 0.1), true), mark((20.0, 5.0), false)]);
        assert_eq!(svg.matches("r=\"8\"").count(), 2);
        assert_eq!(svg.matches("opacity=\"0.5\"").count(), 1);
        assert!(svg.contains("a&lt;b") && !svg.contains("NaN"));
    }
}
