//! Points without a mesh in the place of the dummy mesh, end to end, on the small dam break.

use tidewall_tests::run::{Finished, Stage, assert_same_series, series};
use tidewall_tests::{scene, twin};

const POINTS: [&str; 2] = ["--set", "coupling.fluid_side=points"];

fn run(stage: &Stage, name: &str, more: &[&str]) -> Finished {
    stage.run(name, &[&POINTS, more].concat()).expect_code(0).expect_no_trace()
}

/// One column of a series by its name.
fn column(run: &Finished, file: &str, name: &str) -> Vec<f64> {
    let text = &run.series()[file];
    let head = text.lines().next().expect("a series has a head");
    let column = head.split(',').position(|found| found == name).expect("the series has this column");
    let number = |line: &str| {
        let word = line.split(',').nth(column).expect("a row has this column");
        word.parse().expect("a series holds numbers")
    };
    text.lines().skip(1).map(number).collect()
}

#[test]
fn the_structure_moves_as_with_a_dummy_mesh_and_the_balance_is_kept_to_round_off() {
    let stage = Stage::new(&scene::coupled());
    // Where no facet is shorter than a point is wide, both ways carry pair forces alike; markers lie elsewhere.
    for (load, tolerance) in [("pair", 1e-6), ("markers", 0.03)] {
        let option = format!("coupling.load={load}");
        let mesh = stage.run(&format!("mesh-{load}"), &["--set", &option]).expect_code(0);
        let expected = column(&mesh, "tip.csv", "ux_m");
        let peak = expected.iter().fold(0.0_f64, |peak, x| peak.max(x.abs()));
        let points = run(&stage, load, &["--set", &option]);
        let found = column(&points, "tip.csv", "ux_m");
        let largest = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("{load}: {:.2e} of the peak", largest / peak);
        assert!(largest < tolerance * peak, "{load}: {largest} m of {peak} m");
        let health = points.json().health.clone();
        for kept in ["mapping_force_imbalance", "mapping_moment_imbalance", "mapping_work_imbalance"] {
            assert!(health[kept] < 1e-12, "{load}: {kept} {}", health[kept]);
        }
        assert!(health["pair_impulse_ns"] > 0.0 && health["marker_impulse_ns"] > 0.0);
    }
}

#[test]
fn a_run_by_points_has_the_same_bits_over_both_transports_and_on_any_number_of_threads() {
    let stage = Stage::new(&scene::coupled());
    let one = run(&stage, "1", &["--threads", "1"]);
    assert_same_series(&run(&stage, "2", &["--threads", "2"]).series(), &one.series());
    let folder = stage.out("twin");
    twin::run(&one.out.join("case.lock.toml"), &folder, 1).unwrap();
    assert_same_series(&series(&folder), &one.series());
}

#[test]
fn a_recording_with_points_takes_either_sides_place() {
    let stage = Stage::new(&scene::coupled());
    let whole = run(&stage, "whole", &["--set", "coupling.record=true"]);
    let file = format!("coupling.replay={}", whole.out.join("interface.rec").display());
    for (side, same) in [("fluid", "tip.csv"), ("solid", "front.csv")] {
        let side_option = format!("coupling.replay_of={side}");
        let part = run(&stage, side, &["--set", &file, "--set", &side_option]);
        assert_eq!(part.series()[same], whole.series()[same], "{side}");
    }
    // Without the points the recorded fluid cannot be understood.
    let options = ["--set", &file, "--set", "coupling.replay_of=fluid"];
    let refused = stage.run("refused", &options).expect_code(2);
    assert!(refused.stderr.contains("the recorded fluid had its side as points"), "{}", refused.stderr);
}

#[test]
fn points_and_a_key_of_the_dummy_mesh_exclude_each_other() {
    let stage = Stage::new(&scene::coupled());
    let options = [&POINTS[..], &["--set", "coupling.dummy_elements=[1,8]"]].concat();
    let refused = stage.run("refused", &options).expect_code(2);
    assert!(refused.stderr.contains("coupling.dummy_elements"), "{}", refused.stderr);
    assert!(refused.stderr.contains("The fluid offers points"), "{}", refused.stderr);
}
