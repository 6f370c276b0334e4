//! Whether a promise was kept.

use super::promise::{Bounds, Expect, Promise};
use super::trial::Ended;
use crate::run_json::{RunJson, Status};

/// Largest imbalance of force, moment and work between both sides of the interface: round-off of their sums.
const MAPPING: f64 = 1e-9;

/// What broke the promise; empty when it was kept.
pub(super) fn broken(promise: &Promise, ended: &Ended) -> Vec<String> {
    let Some(code) = ended.exit_code else {
        return vec![format!("no end within {} s", promise.time_limit)];
    };
    let mut broken: Vec<String> =
        ended.broken_series.iter().map(|name| format!("{name} holds what is no number")).collect();
    match &promise.expect {
        Expect::Stopped { exit_code, words } => {
            if code != *exit_code {
                broken.push(format!("exit code {code} where {exit_code} is promised"));
            }
            let missing = words.iter().filter(|word| !ended.message.contains(*word));
            broken.extend(missing.map(|word| format!("the message does not say \"{word}\"")));
        }
        Expect::Stable(bounds) => match &ended.json {
            Some(json) if json.status == Status::Completed => broken.extend(unstable(bounds, json)),
            _ => broken.push(format!("stopped: {}", cause(ended))),
        },
    }
    broken
}

fn unstable(bounds: &Bounds, json: &RunJson) -> Vec<String> {
    let mut broken = Vec::new();
    let health = |name: &str| json.health.get(name).copied().unwrap_or_default();
    let mut at_most = |name: &str, limit: f64| {
        let value = health(name);
        if value > limit || value.is_nan() {
            broken.push(format!("{name} {value:.3e} above {limit:.1e}"));
        }
    };
    at_most("energy_error", bounds.energy);
    at_most("volume_error", bounds.volume.unwrap_or(f64::INFINITY));
    at_most("lost_particles", health("outflow_particles"));
    for side in ["force", "moment", "work"] {
        at_most(&format!("mapping_{side}_imbalance"), MAPPING);
    }
    if json.verdicts != bounds.verdicts {
        broken.push(format!("verdicts {:?} where {:?} are promised", json.verdicts, bounds.verdicts));
    }
    let missed = json.errors.iter().filter(|error| error.passed == Some(false));
    broken.extend(missed.map(|error| {
        format!("{} {} {:.4e}, measured {:.4e}", error.gauge, error.norm, error.value, error.measured)
    }));
    broken
}

/// What happened, in one line.
pub(super) fn happened(ended: &Ended) -> String {
    match (&ended.json, ended.exit_code) {
        (_, None) => "killed".to_owned(),
        (Some(json), Some(0)) => {
            let health = |name: &str| json.health.get(name).copied();
            let mut words = vec![format!("{} steps", json.steps)];
            let share = |name: &str, value: Option<f64>| value.map(|v| format!("{name} {:.2} %", 100.0 * v));
            words.extend(share("energy", health("energy_error")));
            words.extend(share("volume", health("volume_error")));
            words.extend(health("load_jump_mean").map(|jump| format!("J {jump:.2}")));
            words.extend(json.verdicts.iter().cloned());
            words.join(", ")
        }
        (_, Some(code)) => format!("exit {code}: {}", cause(ended)),
    }
}

/// The line of the message that says what went wrong.
fn cause(ended: &Ended) -> String {
    let lines = || ended.message.lines().map(str::trim);
    let said = |line: &&str| line.starts_with("tidewall: ") || line.starts_with("Error: ");
    lines().find(said).or(lines().rfind(|line| !line.is_empty())).unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ended(exit_code: Option<i32>, message: &str) -> Ended {
        Ended { exit_code, message: message.to_owned(), json: None, broken_series: Vec::new(), wall_s: 1.0 }
    }

    fn promise(expect: Expect) -> Promise {
        Promise { about: String::new(), expect, short: true, time_limit: 9.0 }
    }

    #[test]
    fn a_stop_must_come_with_its_code_and_words() {
        let promise = promise(Expect::Stopped { exit_code: 3, words: vec!["sub-steps".to_owned()] });
        assert_eq!(broken(&promise, &ended(Some(3), "tidewall: needs 9 sub-steps")), Vec::<String>::new());
        assert_eq!(broken(&promise, &ended(Some(2), "sub-steps")).len(), 1);
        assert_eq!(broken(&promise, &ended(Some(3), "other")).len(), 1);
        assert_eq!(broken(&promise, &ended(None, "sub-steps")), ["no end within 9 s"]);
    }

    #[test]
    fn a_stable_run_must_reach_its_end() {
        let promise = promise(Expect::Stable(Bounds { energy: 0.02, volume: None, verdicts: Vec::new() }));
        let found = broken(&promise, &ended(Some(3), "10 %\ntidewall: fluid-isph failed in solve"));
        assert_eq!(found, ["stopped: tidewall: fluid-isph failed in solve"]);
    }
}
