//! Progress of a run: a bar on a terminal, plain lines elsewhere.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use protocol::control::{StepReport, StepTime};

/// Plain lines come at most this often.
const LINE_EVERY: Duration = Duration::from_secs(10);
/// Resolution of the bar.
const TICKS: f64 = 1e4;

/// Shows simulated time, step, dt, time left, and the value of the first gauge.
pub struct Progress {
    bar: Option<ProgressBar>,
    end: f64,
    /// Simulated time of the start, known with the first step.
    begin: Option<f64>,
    start: Instant,
    last_line: Instant,
}

impl Progress {
    /// Starts with the end of the run, s.
    pub fn new(end: f64) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(TICKS as u64);
            let style = ProgressStyle::with_template("{bar:32} {percent:>3} % {msg}");
            bar.set_style(style.expect("the template is constant and valid"));
            bar
        });
        Self { bar, end, begin: None, start: Instant::now(), last_line: Instant::now() }
    }

    /// Shows a step.
    pub fn show(&mut self, at: StepTime, done: &StepReport) {
        let begin = *self.begin.get_or_insert(at.time - at.dt);
        let due = self.last_line.elapsed() >= LINE_EVERY;
        if self.bar.is_none() && !due {
            return;
        }
        let share = at.time / self.end;
        let left = self.start.elapsed().as_secs_f64() * (self.end - at.time) / (at.time - begin).max(1e-12);
        let shown =
            done.shown.as_ref().map_or(String::new(), |(name, value)| format!("  {name} {value:.4e}"));
        let text =
            format!("t {:.4} s  step {}  dt {:.2e} s{shown}  {left:.0} s left", at.time, at.step, at.dt);
        match &self.bar {
            Some(bar) => {
                bar.set_position((share * TICKS) as u64);
                bar.set_message(text);
            }
            None => {
                eprintln!("{:5.1} %  {text}", 100.0 * share);
                self.last_line = Instant::now();
            }
        }
    }

    /// Leaves the terminal clean.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
