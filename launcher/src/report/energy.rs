//! The energy balance of the whole system: what was put into water and structure, where it is now, and what is gone.

use std::fmt::Write as _;

use crate::run_json::RunJson;

/// One part of the balance, J (in 2-D J per metre of depth).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    name: &'static str,
    start: f64,
    /// Work done on it.
    work: f64,
    end: f64,
}

impl Part {
    /// What it has lost: start + work - end.
    fn lost(&self) -> f64 {
        self.start + self.work - self.end
    }
}

/// Water, structure and the interface between them; empty for a run without both.
fn parts(json: &RunJson) -> Option<[Part; 3]> {
    let value = |name: &str| json.health.get(name).copied();
    let (given, taken) = (value("interface_work_fluid_j")?, value("interface_work_solid_j")?);
    let water = Part {
        name: "water (viscosity, impacts, pressure solve)",
        start: value("water_energy_start_j")?,
        work: value("water_work_j")?,
        end: value("water_energy_j")?,
    };
    let solid = Part {
        name: "structure (damping of the integrator; supports and changing weight, where they work)",
        start: value("solid_energy_start_j")?,
        work: taken,
        end: value("solid_energy_j")?,
    };
    let interface =
        Part { name: "interface (staggering in time)", start: 0.0, work: given - taken, end: 0.0 };
    Some([water, solid, interface])
}

/// The section of the report.
pub(super) fn balance(json: &RunJson) -> String {
    let Some(parts) = parts(json) else { return String::new() };
    let mut text = "<h2>Energy balance</h2><p>Work on the water is that of walls, body and changing gravity, less the energy of \
                    water that has left; on the structure that of the water. Lost is start + work - end.</p>\
                    <table><tr><th>part</th><th>at the start, J</th><th>work done on it, J</th><th>at the end, J</th>\
                    <th>lost, J</th></tr>"
        .to_owned();
    let mut row = |name: &str, numbers: [f64; 4]| {
        let _ = write!(text, "<tr><td>{name}</td>");
        numbers.iter().for_each(|number| {
            let _ = write!(text, "<td class=\"n\">{number:.4}</td>");
        });
        text += "</tr>";
    };
    parts.iter().for_each(|part| row(part.name, [part.start, part.work, part.end, part.lost()]));
    let sum = |of: fn(&Part) -> f64| parts.iter().map(of).sum::<f64>();
    row("all", [sum(|part| part.start), sum(|part| part.work), sum(|part| part.end), sum(Part::lost)]);
    text + "</table>"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_lost_is_what_is_put_in_less_what_is_there() {
        let text = r#"{"case": "a", "case_file": "a", "tidewall": "0", "status": "completed", "exit_code": 0,
            "dimension": 2, "counts": {}, "steps": 1, "simulated_s": 1, "wall_s": 1, "cpu_s": 1, "threads": 1,
            "processes": [], "left_out": [], "errors": [], "verdicts": [], "failure": null, "health": {
            "water_energy_start_j": 10, "water_work_j": -2, "water_energy_j": 7, "solid_energy_start_j": 1,
            "interface_work_fluid_j": 2.5, "interface_work_solid_j": 2, "solid_energy_j": 2.75}}"#;
        let json: RunJson = serde_json::from_str(text).unwrap();
        let lost = parts(&json).unwrap().map(|part| part.lost());
        assert_eq!(lost, [1.0, 0.25, 0.5]);
        assert!(balance(&json).contains("1.7500"), "{}", balance(&json));
    }
}
