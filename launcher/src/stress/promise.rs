//! `[stress]`: what a case promises when it is pushed.

use protocol::case::{CaseFile, Section};

/// What a case of the stability suite promises.
#[derive(Debug, Clone, PartialEq)]
pub struct Promise {
    /// What makes the scene hard.
    pub about: String,
    /// How it shall end.
    pub expect: Expect,
    /// Whether it belongs to the short half.
    pub short: bool,
    /// Wall time after which it counts as hung, s.
    pub time_limit: f64,
}

/// How a case shall end.
#[derive(Debug, Clone, PartialEq)]
pub enum Expect {
    /// It reaches its end within bounds.
    Stable(Bounds),
    /// It is refused or stopped, naming its cause.
    Stopped {
        /// Exit code.
        exit_code: i32,
        /// Words the message must hold.
        words: Vec<String>,
    },
}

/// Bounds of a stable run.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    /// Largest `energy_error`: energy beyond the work put in.
    pub energy: f64,
    /// Largest `volume_error` at the end, where the water is at rest there.
    pub volume: Option<f64>,
    /// Verdicts the run must end with, and no others.
    pub verdicts: Vec<String>,
}

impl Promise {
    /// The promise of a case, if it makes one.
    pub fn read(case: &CaseFile) -> Option<Self> {
        let section = case.section("stress")?;
        let about = section.text("about").about("What makes the scene hard, for the table.").required();
        let expect = section
            .choice("expect", &["stable", "stopped"])
            .about(
                "stable: reaches its end within the bounds, every [[reference]] within its gate, no particle lost, every \
                 output finite; stopped: refused or stopped with the exit code and the words.",
            )
            .required();
        let bounds = read_bounds(&section);
        let stopped = read_stopped(&section);
        let short = section.flag("short", false, "Whether `tidewall stress --short` runs it.");
        let limit = section.number("time_limit").unit("s").above(0.0);
        let time_limit = limit.about("Wall time after which it counts as hung.").default(120.0);
        section.finish();
        let expect = if expect == "stable" { Expect::Stable(bounds) } else { stopped };
        Some(Self { about, expect, short, time_limit })
    }
}

fn read_bounds(section: &Section<'_>) -> Bounds {
    let energy = section.number("energy").at_least(0.0);
    let energy = energy.about("stable: largest energy beyond the work put in, relative.").default(0.02);
    let volume = section.number("volume").above(0.0);
    let volume = volume
        .about("stable: largest relative change of volume at the end; for water that is at rest there.")
        .optional();
    let verdicts = section.text("verdicts").about("stable: the verdicts it ends with, and no others.");
    Bounds { energy, volume, verdicts: verdicts.list(&[]) }
}

fn read_stopped(section: &Section<'_>) -> Expect {
    let code = section.integer("exit_code").at_least(1.0).at_most(255.0);
    let code = code.about("stopped: the exit code.").optional();
    let words = section.text("words").about("stopped: words the message must hold.").list(&[]);
    Expect::Stopped { exit_code: code.unwrap_or(2.0) as i32, words }
}
