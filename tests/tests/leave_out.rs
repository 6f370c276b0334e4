//! What a scene does not need is not there: no process, no phase, no file. (No memory: `fluid-isph/src/leave_out.rs`.)

use std::collections::BTreeMap;

use tidewall_tests::run::{Finished, Stage};
use tidewall_tests::scene;

/// Ten steps and what they left.
struct Seen {
    run: Finished,
    /// Holds the run folder.
    _stage: Stage,
}

impl Seen {
    fn of(scene: &str, options: &[&str]) -> Self {
        let stage = Stage::new(scene);
        let options: Vec<&str> = ["--until", "0.005"].into_iter().chain(options.iter().copied()).collect();
        Self { run: stage.run("run", &options).expect_no_trace().expect_code(0), _stage: stage }
    }

    /// The phases of each process.
    fn phases(&self) -> BTreeMap<String, Vec<String>> {
        let names = |process: &launcher::run_json::ProcessEntry| {
            (process.name.clone(), process.phases.iter().map(|phase| phase.name.clone()).collect())
        };
        self.run.json().processes.iter().map(names).collect()
    }

    /// The phases of another run that this one does not have.
    fn lacks(&self, full: &Self) -> Vec<String> {
        let own: Vec<_> = self.phases().into_values().flatten().collect();
        full.phases().into_values().flatten().filter(|phase| !own.contains(phase)).collect()
    }

    fn says_it_left_out(&self, what: &str) -> bool {
        self.run.json().left_out.iter().any(|entry| entry.what.contains(what))
    }
}

/// Water with turbulence and viscosity against an elastic obstacle, everything recorded.
fn full() -> Seen {
    Seen::of(&scene::coupled(), &["--set", "fluid.smagorinsky=0.12"])
}

/// The case without the lines that hold one of `words`.
fn without(case: &str, words: &[&str]) -> String {
    let lines = case.lines().filter(|line| !words.iter().any(|word| line.contains(word)));
    lines.map(|line| format!("{line}\n")).collect()
}

#[test]
fn each_term_that_is_off_takes_its_phase_with_it() {
    let full = full();
    let plain = Seen::of(&scene::coupled(), &[]);
    assert_eq!(plain.lacks(&full), ["eddy viscosity"], "no turbulence");
    assert!(plain.says_it_left_out("turbulence"));
    let inviscid = Seen::of(&without(&scene::coupled(), &["kinematic_viscosity"]), &[]);
    assert_eq!(inviscid.lacks(&full), ["eddy viscosity", "viscosity"], "nu = 0");
    assert!(inviscid.says_it_left_out("viscous term"));
    let unseen = Seen::of(&without(&scene::coupled(), &["[output]", "fields_every"]), &[]);
    assert_eq!(unseen.lacks(&plain), ["fields"], "no output of fields");
    assert!(plain.run.out.join("fields").exists() && !unseen.run.out.join("fields").exists());
}

#[test]
fn water_alone_has_nothing_of_a_body() {
    let (full, alone) = (full(), Seen::of(&scene::fluid_only(), &["--set", "fluid.smagorinsky=0.12"]));
    assert_eq!(alone.run.programs(), ["fluid-isph"]);
    assert_eq!(alone.phases().into_keys().collect::<Vec<_>>(), ["fluid-isph"]);
    let lacks = alone.lacks(&full);
    for phase in ["place body", "load", "receive motion", "send load"] {
        assert!(lacks.iter().any(|absent| absent == phase), "{phase}: {lacks:?}");
    }
    let counts = alone.run.json().counts;
    assert_eq!(counts.get("body_particles").copied().unwrap_or(0), 0, "{counts:?}");
    assert!(!counts.contains_key("interface_nodes") && !counts.contains_key("solid_nodes"), "{counts:?}");
}

#[test]
fn a_rigid_body_has_no_finite_elements() {
    let rigid = Seen::of(&scene::coupled_rigid(), &[]);
    assert_eq!(rigid.run.programs(), ["coupler", "fluid-isph", "solid-rigid"]);
    let phases: Vec<_> = rigid.phases().into_values().flatten().collect();
    for phase in ["balance_forces", "assemble_tangent", "solve_linear", "correct_motion"] {
        assert!(!phases.iter().any(|found| found == phase), "{phase}: {phases:?}");
    }
    assert!(!rigid.run.json().counts.contains_key("solid_elements"), "{:?}", rigid.run.json().counts);
}

#[test]
fn a_linear_solid_assembles_nothing_in_its_steps() {
    // Released in its unloaded place, it swings from the first step on.
    let tangents = |kinematics: &str| {
        let option = format!("solid.kinematics={kinematics}");
        let options = ["--set", "solid.start=unloaded", "--set", &option];
        Seen::of(&scene::solid_only(), &options).run.json().health["solid_tangents"]
    };
    let (linear, large) = (tangents("linear"), tangents("total_lagrangian"));
    assert!(linear == 0.0 && large > 0.0, "{linear}, {large}");
}

#[test]
fn without_gravity_water_at_rest_costs_no_iteration() {
    let weightless = without(&scene::coupled(), &["[gravity]", "acceleration"]);
    let rest = Seen::of(&weightless, &[]);
    assert!(rest.says_it_left_out("gravity") && rest.says_it_left_out("self-weight"));
    let health = rest.run.json().health;
    assert_eq!((health["mean_pressure_iterations"], health["max_speed_m_s"]), (0.0, 0.0), "{health:?}");
}
