//! Line plots as inline SVG.

use std::fmt::Write as _;

/// One line.
pub(super) struct Line {
    pub(super) name: String,
    pub(super) points: Vec<(f64, f64)>,
    /// Index into the palette.
    pub(super) colour: usize,
    pub(super) dashed: bool,
}

/// A shaded band between two curves.
pub(super) struct Band {
    pub(super) name: String,
    pub(super) low: Vec<(f64, f64)>,
    pub(super) high: Vec<(f64, f64)>,
}

/// What a plot shows.
pub(super) struct Plot {
    pub(super) title: String,
    pub(super) x_label: String,
    pub(super) y_label: String,
    pub(super) lines: Vec<Line>,
    pub(super) bands: Vec<Band>,
}

const PALETTE: [&str; 6] = ["#0b5fa5", "#c8442b", "#2a7f4f", "#8a5a9e", "#b8860b", "#4a4a4a"];
const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 320.0;
const LEFT: f64 = 78.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 48.0;
/// More points than this per line are thinned to extremes per pixel column.
const MOST_POINTS: usize = 1500;

struct Axes {
    x: (f64, f64),
    y: (f64, f64),
}

impl Axes {
    fn of(plot: &Plot) -> Self {
        let bands = plot.bands.iter().flat_map(|band| band.low.iter().chain(&band.high));
        let points: Vec<_> = plot.lines.iter().flat_map(|line| &line.points).chain(bands).collect();
        let range = |value: &dyn Fn(&(f64, f64)) -> f64| {
            let low = points.iter().map(|p| value(p)).fold(f64::INFINITY, f64::min);
            let high = points.iter().map(|p| value(p)).fold(f64::NEG_INFINITY, f64::max);
            match (low < high, low.is_finite()) {
                (true, _) => (low, high),
                (false, true) => (low - 0.5 * low.abs().max(1e-12), high + 0.5 * high.abs().max(1e-12)),
                _ => (0.0, 1.0),
            }
        };
        let (x, y) = (range(&|p| p.0), range(&|p| p.1));
        let margin = 0.05 * (y.1 - y.0);
        Self { x, y: (y.0 - margin, y.1 + margin) }
    }

    fn place(&self, point: (f64, f64)) -> (f64, f64) {
        let x = LEFT + (point.0 - self.x.0) / (self.x.1 - self.x.0) * (WIDTH - LEFT - RIGHT);
        let y = HEIGHT - BOTTOM - (point.1 - self.y.0) / (self.y.1 - self.y.0) * (HEIGHT - TOP - BOTTOM);
        (x, y)
    }

    fn path(&self, points: &[(f64, f64)]) -> String {
        let mut path = String::new();
        for &point in &thin(points) {
            let (x, y) = self.place(point);
            let _ = write!(path, "{}{x:.1} {y:.1}", if path.is_empty() { "M" } else { "L" });
        }
        path
    }
}

impl Plot {
    /// The plot as an SVG element.
    pub(super) fn render(&self) -> String {
        let axes = Axes::of(self);
        let mut svg = format!(
            "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{0}\"><text x=\"{LEFT}\" y=\"18\" class=\"title\">{0}</text>",
            escape(&self.title)
        );
        grid(&axes, self, &mut svg);
        for band in &self.bands {
            let back: Vec<_> = band.low.iter().rev().copied().collect();
            let path = format!("{}{}Z", axes.path(&band.high), axes.path(&back).replacen('M', "L", 1));
            let _ = write!(svg, "<path d=\"{path}\" fill=\"#9aa5b1\" opacity=\"0.35\"/>");
        }
        for line in &self.lines {
            let colour = PALETTE[line.colour % PALETTE.len()];
            let dash = if line.dashed { " stroke-dasharray=\"6 4\"" } else { "" };
            let path = axes.path(&line.points);
            let _ = write!(
                svg,
                "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.6\"{dash}/>"
            );
        }
        self.legend(&mut svg);
        svg + "</svg>"
    }

    fn legend(&self, svg: &mut String) {
        let entries = self.lines.iter().map(|line| (&line.name, PALETTE[line.colour % PALETTE.len()], 1.0));
        let bands = self.bands.iter().map(|band| (&band.name, "#9aa5b1", 0.5));
        let mut x = WIDTH - RIGHT;
        for (name, colour, opacity) in entries.chain(bands).collect::<Vec<_>>().into_iter().rev() {
            x -= 6.4 * name.chars().count() as f64 + 30.0;
            let _ = write!(
                svg,
                "<rect x=\"{x:.0}\" y=\"10\" width=\"16\" height=\"4\" fill=\"{colour}\" opacity=\"{opacity}\"/><text x=\"{:.0}\" y=\"16\">{}</text>",
                x + 20.0,
                escape(name)
            );
        }
    }
}

fn grid(axes: &Axes, plot: &Plot, svg: &mut String) {
    let (bottom, right) = (HEIGHT - BOTTOM, WIDTH - RIGHT);
    for tick in ticks(axes.x) {
        let x = axes.place((tick, axes.y.0)).0;
        let _ = write!(
            svg,
            "<path d=\"M{x:.1} {TOP}V{bottom}\" class=\"grid\"/><text x=\"{x:.1}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text>",
            bottom + 16.0,
            shown(tick)
        );
    }
    for tick in ticks(axes.y) {
        let y = axes.place((axes.x.0, tick)).1;
        let _ = write!(
            svg,
            "<path d=\"M{LEFT} {y:.1}H{right}\" class=\"grid\"/><text x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            LEFT - 6.0,
            y + 4.0,
            shown(tick)
        );
    }
    let _ = write!(
        svg,
        "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text><text x=\"14\" y=\"{:.0}\" text-anchor=\"middle\" transform=\"rotate(-90 14 {3:.0})\">{}</text>",
        0.5 * (LEFT + right),
        HEIGHT - 10.0,
        escape(&plot.x_label),
        0.5 * (TOP + bottom),
        escape(&plot.y_label)
    );
}

/// Round tick values, about six.
fn ticks((low, high): (f64, f64)) -> Vec<f64> {
    let rough = (high - low) / 6.0;
    let power = 10f64.powf(rough.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|step| *step >= rough).unwrap_or(rough);
    // A bound that is a tick itself is one, whatever its last bit.
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|i| i as f64 * step).collect()
}

fn shown(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let size = value.abs();
    if (1e-3..1e5).contains(&size) {
        let text = format!("{value:.4}");
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    format!("{value:.1e}")
}

/// Keeps the least and the greatest value of each of equal shares of the points.
fn thin(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= MOST_POINTS {
        return points.to_vec();
    }
    let share = (2 * points.len()).div_ceil(MOST_POINTS);
    let mut kept = Vec::with_capacity(MOST_POINTS + 2);
    for chunk in points.chunks(share) {
        let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let (low, high) = (chunk.iter().min_by(by_value), chunk.iter().max_by(by_value));
        let mut pair: Vec<_> = low.into_iter().chain(high).copied().collect();
        pair.sort_by(|a, b| a.0.total_cmp(&b.0));
        kept.extend(pair);
    }
    kept
}

/// Text safe inside HTML and SVG.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let found = ticks((0.0, 0.6));
        assert_eq!(
            found.iter().map(|&tick| shown(tick)).collect::<Vec<_>>(),
            ["0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6"]
        );
        assert_eq!(shown(0.30000000000000004), "0.3");
    }

    #[test]
    fn a_long_line_keeps_its_peaks() {
        let mut points: Vec<_> = (0..100_000).map(|i| (f64::from(i), 0.0)).collect();
        points[54_321].1 = 9.0;
        let thinned = thin(&points);
        assert!(thinned.len() <= MOST_POINTS + 2 && thinned.iter().any(|point| point.1 == 9.0));
    }

    #[test]
    fn an_empty_plot_is_still_a_picture() {
        let plot = Plot {
            title: "a<b".to_owned(),
            x_label: String::new(),
            y_label: String::new(),
            lines: vec![],
            bands: vec![],
        };
        let svg = plot.render();
        assert!(svg.contains("a&lt;b") && svg.ends_with("</svg>") && !svg.contains("NaN"));
    }
}
