//! A recording in the place of the fluid or of the solid: the other side, alone, does what it did.

use launcher::run_json::Status;
use tidewall_tests::run::{Finished, Stage};
use tidewall_tests::scene;

/// A recorded run, and the same case with the recording in the place of one side.
fn replayed(side: &str) -> (Stage, Finished, Finished) {
    let stage = Stage::new(&scene::coupled());
    let whole = stage.run("whole", &["--set", "coupling.record=true"]).expect_code(0).expect_no_trace();
    let file = format!("coupling.replay={}", whole.out.join("interface.rec").display());
    let side = format!("coupling.replay_of={side}");
    let part = stage.run("part", &["--set", &file, "--set", &side]).expect_code(0).expect_no_trace();
    assert_eq!(part.json().status, Status::Completed);
    assert_eq!(part.json().steps, whole.json().steps);
    (stage, whole, part)
}

#[test]
fn a_solid_alone_under_the_recorded_load_moves_as_it_did() {
    let (_stage, whole, part) = replayed("fluid");
    assert_eq!(part.programs(), ["coupler", "solid-fem"]);
    for name in ["tip.csv", "reaction.csv"] {
        assert_eq!(part.series()[name], whole.series()[name], "{name}");
    }
    assert!(!part.series().contains_key("front.csv"), "there is no water to record");
}

#[test]
fn the_water_alone_beside_the_recorded_wall_flows_as_it_did() {
    let (_stage, whole, part) = replayed("solid");
    assert_eq!(part.programs(), ["coupler", "fluid-isph"]);
    for name in ["front.csv", "body_force.csv", "water_energy.csv"] {
        assert_eq!(part.series()[name], whole.series()[name], "{name}");
    }
}

#[test]
fn a_file_that_is_no_recording_is_refused_before_anything_starts() {
    let stage = Stage::new(&scene::coupled());
    let file = format!("coupling.replay={}", stage.case().display());
    let options = ["--set", &file, "--set", "coupling.replay_of=fluid"];
    let refused = stage.run("refused", &options).expect_code(2);
    assert!(refused.stderr.contains("is no recording of an interface"), "{}", refused.stderr);
}
