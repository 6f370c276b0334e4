//! `[[reference]]`: what a gauge is compared with, by which norm, over which time.

use super::file::CaseFile;
use super::gauge::Gauge;
use super::section::Section;

/// How a gauge is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Norm {
    /// Root mean square of the difference over the instants.
    Rms,
    /// Greatest value in the window, minus the expected one.
    Peak,
    /// First time the value passes the level, minus the expected one.
    Crossing,
    /// Share of the instants inside the band, widened by the margin.
    ShareInside,
    /// Mean over the window, minus the expected one.
    Mean,
    /// Last value in the window, minus the expected one.
    Final,
    /// Greatest absolute value in the window.
    MaxAbs,
    /// Frequency of the passages of the level (of the mean, if none is given), minus the expected one, Hz.
    Frequency,
    /// Rate r of the decay exp(-r t) that fits the absolute values best, minus the expected one, 1/s.
    Decay,
    /// Root mean square about the running mean, over the mean of the window.
    Noise,
}

impl Norm {
    /// The names in the case file, in the order of the variants.
    pub const NAMES: [&'static str; 10] = [
        "rms",
        "peak",
        "crossing",
        "share_inside",
        "mean",
        "final",
        "max_abs",
        "frequency",
        "decay",
        "noise",
    ];
    const ALL: [Self; 10] = [
        Self::Rms,
        Self::Peak,
        Self::Crossing,
        Self::ShareInside,
        Self::Mean,
        Self::Final,
        Self::MaxAbs,
        Self::Frequency,
        Self::Decay,
        Self::Noise,
    ];

    /// The name in the case file.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// The unit of what it measures, where that is not the column's.
    pub fn own_unit(self) -> Option<&'static str> {
        match self {
            Self::Crossing => Some("s"),
            Self::Frequency => Some("Hz"),
            Self::Decay => Some("1/s"),
            Self::Noise => Some(""),
            _ => None,
        }
    }
}

/// What is expected.
#[derive(Debug, Clone, PartialEq)]
pub enum Target {
    /// Columns of a CSV file (lines with `#` are comments, first line names the columns, first column is the time in s).
    Curve {
        /// File, relative to the case file.
        file: String,
        /// Column of the expected value.
        column: String,
        /// Columns of the band, for `share_inside` and for drawing.
        band: Option<(String, String)>,
    },
    /// A number.
    Value(f64),
}

/// One comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// The gauge compared.
    pub gauge: String,
    /// Its column.
    pub column: String,
    /// What it is compared with, for the report.
    pub label: String,
    /// The norm.
    pub norm: Norm,
    /// What is expected.
    pub target: Target,
    /// Level of a crossing, in the column's unit.
    pub level: Option<f64>,
    /// Length of the running mean that takes the series' place (of `noise`: that it is compared with), s.
    pub running_mean: Option<f64>,
    /// Widening of the band on both sides, in the column's unit.
    pub margin: f64,
    /// Window, s.
    pub from: f64,
    /// Window, s.
    pub to: f64,
    /// Distance of the instants compared, s; 0 takes the rows of the series.
    pub every: f64,
    /// Compare at the instants of the curve's rows.
    pub at_curve: bool,
    /// Whether the error is divided by the expected value.
    pub relative: bool,
    /// Bounds the measured value must keep: of the error for `rms` and relative norms, else of the value itself.
    pub gate: Option<(f64, f64)>,
}

impl Reference {
    /// Reads all references of the case.
    pub fn read_all(case: &CaseFile, gauges: &[Gauge]) -> Vec<Self> {
        case.list("reference").iter().map(|section| Self::read(section, gauges)).collect()
    }

    fn read(section: &Section<'_>, gauges: &[Gauge]) -> Self {
        let gauge = section.text("gauge").about("Name of the gauge compared.").required();
        if section.has("gauge") && !gauges.iter().any(|known| known.name == gauge) {
            let known: Vec<_> = gauges.iter().map(|gauge| gauge.name.as_str()).collect();
            let hint = super::key::nearest(&gauge, known.iter().copied());
            section.complain("gauge", format!("there is no gauge \"{gauge}\""), &known.join(", "), &hint);
        }
        let column = section.text("column").about("Column of its series, such as ux_m.").required();
        let label = section.text("label").about("What it is compared with, for the report.").required();
        let norm = section
            .choice("norm", &Norm::NAMES)
            .about("rms of the difference | greatest value | time of passing a level | share inside a band | mean | last value | greatest absolute value | frequency in Hz | rate of decay in 1/s | rms about the running mean, over the mean.")
            .required();
        let norm = Norm::ALL[Norm::NAMES.iter().position(|&name| name == norm).unwrap_or_default()];
        let target = Self::read_target(section, norm);
        let level = section
            .number("level")
            .about("Level to pass, in the column's unit (frequency takes the mean without it).")
            .optional();
        if norm == Norm::Crossing && level.is_none() {
            section.complain("level", "is missing", "a number", "A crossing needs the level to pass.");
        }
        let running_mean = section
            .number("running_mean")
            .unit("s")
            .above(0.0)
            .about("Length of the running mean that is compared in place of the series; noise: that the series departs from.")
            .optional();
        if norm == Norm::Noise && running_mean.is_none() {
            section.complain(
                "running_mean",
                "is missing",
                "a number > 0 in s",
                "Noise departs from a running mean.",
            );
        }
        let margin = section
            .number("margin")
            .at_least(0.0)
            .about("Widening of the band on both sides, in the column's unit.")
            .default(0.0);
        let from = section.number("from").unit("s").about("Start of the window.").default(0.0);
        let to =
            section.number("to").unit("s").above(0.0).about("End of the window (default: all).").optional();
        let every = section
            .number("every")
            .unit("s")
            .at_least(0.0)
            .about("Distance of the instants compared; 0 takes the rows of the series.")
            .default(0.0);
        let at_curve =
            section.flag("at_curve", false, "Compare at the instants of the curve's rows, replaces every.");
        if at_curve && !section.has("curve") {
            section.complain("at_curve", "there is no curve", "false", "Remove it, or give a curve.");
        }
        let relative = section.flag("relative", false, "Divide the error by the expected value.");
        let gate = section.pair(
            "gate",
            "",
            "Bounds to keep: of the error for rms, max_abs and relative norms, else of the measured value.",
        );
        section.finish();
        let to = to.unwrap_or(f64::INFINITY);
        Self {
            gauge,
            column,
            label,
            norm,
            target,
            level,
            running_mean,
            margin,
            from,
            to,
            every,
            at_curve,
            relative,
            gate,
        }
    }

    fn read_target(section: &Section<'_>, norm: Norm) -> Target {
        let value = section.number("value").about("Expected number.").optional();
        let file =
            section.text("curve").about("CSV file of the expected curve, relative to the case.").optional();
        let column = section.text("curve_column").about("Its column.").optional();
        let low = section.text("band_low").about("Its column of the lower bound.").optional();
        let high = section.text("band_high").about("Its column of the upper bound.").optional();
        match (value, file, column) {
            (Some(value), None, None) => Target::Value(value),
            (None, Some(file), Some(column)) => Target::Curve { file, column, band: low.zip(high) },
            (None, None, None) if matches!(norm, Norm::MaxAbs | Norm::Noise) => Target::Value(0.0),
            _ => {
                section.complain(
                    "value",
                    "what is expected is not clear",
                    "value, or curve and curve_column",
                    "Give a number, or a curve with its column.",
                );
                Target::Value(0.0)
            }
        }
    }
}
