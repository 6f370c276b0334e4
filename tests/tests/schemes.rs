//! The coupling schemes end to end, on the small dam break.

use tidewall_tests::run::{Finished, Stage, assert_same_series, series};
use tidewall_tests::{scene, twin};

fn run(stage: &Stage, scheme: &str, more: &[&str]) -> Finished {
    let option = format!("coupling.scheme={scheme}");
    let options: Vec<&str> = ["--set", &option].into_iter().chain(more.iter().copied()).collect();
    stage.run(&format!("{scheme}{}", more.concat().replace(['/', '.', '='], "-")), &options).expect_no_trace()
}

fn numbers(series: &str, column: usize) -> Vec<f64> {
    let number = |line: &str| {
        let word = line.split(',').nth(column).expect("a row has this column");
        word.parse().expect("a series holds numbers")
    };
    series.lines().skip(1).map(number).collect()
}

#[test]
fn the_strong_scheme_settles_every_step_and_closes_the_work() {
    let stage = Stage::new(&scene::coupled());
    let staggered = run(&stage, "css", &[]).expect_code(0);
    for acceleration in ["iqn-ils", "aitken"] {
        let option = format!("coupling.acceleration={acceleration}");
        let strong = run(&stage, "strong", &["--set", &option]).expect_code(0);
        let health = &strong.json().health;
        assert_eq!(health["unsettled_steps"], 0.0, "{acceleration}");
        assert!(
            (1.0..4.0).contains(&health["coupling_passes"]),
            "{acceleration}: {}",
            health["coupling_passes"]
        );
        // What is given and taken differs by the tolerance only, where staggering loses a part of every step.
        let (closed, open) = (health["work_mismatch"], staggered.json().health["work_mismatch"]);
        assert!(closed < 0.5 * open, "{acceleration}: {closed}, staggered {open}");
    }
}

#[test]
fn a_strong_run_carries_the_same_bits_over_both_transports() {
    let stage = Stage::new(&scene::coupled());
    let strong = run(&stage, "strong", &["--threads", "1", "--until", "0.03"]).expect_code(0);
    let folder = stage.out("twin");
    twin::run(&strong.out.join("case.lock.toml"), &folder, 1).unwrap();
    assert_same_series(&series(&folder), &strong.series());
}

#[test]
fn one_way_to_the_solid_the_water_sees_a_rigid_wall() {
    let (elastic, rigid) = (Stage::new(&scene::coupled()), Stage::new(&scene::coupled_rigid()));
    // Without its weight the body starts in its unloaded place, where the rigid one stands; the relaxation time has
    // another default beside an elastic wall.
    let relaxation = "fluid.relaxation_time=0.01";
    let options = ["--set", "solid.weight=false", "--set", relaxation];
    let there = run(&elastic, "to_solid", &options).expect_code(0);
    let wall = rigid.run("rigid", &["--set", relaxation]).expect_code(0);
    for name in ["front.csv", "body_force.csv"] {
        assert_eq!(there.series()[name], wall.series()[name], "{name}");
    }
    let tip = numbers(&there.series()["tip.csv"], 1);
    assert!(tip.iter().any(|x| x.abs() > 1e-5), "the load reaches the solid");
    assert!(there.json().verdicts.is_empty(), "{:?}", there.json().verdicts);
}

#[test]
fn one_way_to_the_fluid_the_solid_feels_no_water() {
    let stage = Stage::new(&scene::coupled());
    let run = run(&stage, "to_fluid", &["--set", "solid.weight=false"]).expect_code(0);
    assert!(numbers(&run.series()["tip.csv"], 1).iter().all(|x| *x == 0.0));
    assert!(numbers(&run.series()["body_force.csv"], 1).iter().any(|f| f.abs() > 1.0), "the water does push");
}

#[test]
fn parallel_and_predicted_steps_run_and_count_one_pass() {
    let stage = Stage::new(&scene::coupled());
    for (scheme, more) in [("parallel", &[][..]), ("css", &["--set", "coupling.prediction_order=2"][..])] {
        let run = run(&stage, scheme, more).expect_code(0);
        assert!(!run.json().health.contains_key("coupling_passes"), "{scheme}");
        assert!(numbers(&run.series()["tip.csv"], 1).iter().any(|x| x.abs() > 1e-5), "{scheme}");
    }
}

#[test]
fn a_key_of_another_scheme_is_refused_with_the_reason() {
    let stage = Stage::new(&scene::coupled());
    let options = ["--set", "coupling.scheme=robin", "--set", "coupling.tolerance=1e-3"];
    let refused = stage.run("refused", &options).expect_code(2);
    assert!(refused.stderr.contains("has no use here"), "{}", refused.stderr);
}

#[test]
fn a_restless_staggered_scheme_gives_way_to_the_robin_wall_where_the_case_allows_it() {
    let stage = Stage::new(&scene::plate(1.4));
    let pinned = run(&stage, "css", &[]).expect_code(0);
    assert_eq!(pinned.json().verdicts, ["unstable_coupling"]);
    assert!(
        !pinned.json().health.contains_key("escalations_to_robin"),
        "a scheme that is asked for is obeyed"
    );
    let free = run(&stage, "css", &["--set", "coupling.on_guard=escalate"]).expect_code(0);
    let health = &free.json().health;
    assert_eq!(health["escalations_to_robin"], 1.0);
    assert!(health["load_jump_greatest"] < 0.5 && free.json().verdicts.is_empty(), "{health:?}");
    let log = std::fs::read_to_string(free.out.join("log/coupler.jsonl")).expect("the coupler keeps a log");
    assert!(log.contains("another scheme from here on"), "{log}");
    let report = std::fs::read_to_string(free.out.join("report.html")).expect("there is a report");
    assert!(report.contains("the Robin wall took over 1 times"));
}

#[test]
fn a_robin_wall_that_gives_way_too_little_is_passed_over() {
    let stage = Stage::new(&scene::plate(20.0));
    let run = stage.run("robin", &["--set", "coupling.robin_factor=2.0"]).expect_no_trace().expect_code(0);
    let health = &run.json().health;
    assert!(health["escalations_to_passes"] >= 1.0 && health["escalated_steps"] >= 50.0, "{health:?}");
    assert!(health["coupling_passes"] > 1.0, "{health:?}");
    assert!(health["unsettled_steps"] < 0.2 * health["escalated_steps"], "{health:?}");
}

#[test]
fn a_wall_too_light_for_a_scheme_is_given_another_from_the_start() {
    // Too light for staggering: the Robin wall; too light for that to move right: passes from the second step on.
    for (ratio, has_passes) in [(40.0, false), (200.0, true)] {
        let stage = Stage::new(&scene::plate(ratio));
        let run = run(&stage, "css", &["--set", "coupling.on_guard=escalate"]).expect_code(0);
        let health = &run.json().health;
        assert_eq!(
            (health["escalations_to_robin"], health["escalations_to_passes"]),
            (0.0, 0.0),
            "{health:?}"
        );
        assert_eq!(health.contains_key("coupling_passes"), has_passes, "{health:?}");
        assert!(health["load_jump_greatest"] < 0.2 && run.json().verdicts.is_empty(), "{health:?}");
    }
}

#[test]
fn a_solid_with_shorter_steps_of_its_own_swings_as_with_shorter_steps_of_all() {
    let stage = Stage::new(&scene::solid_only());
    let own = stage.run("own", &["--set", "solid.max_dt=1.25e-4"]).expect_code(0);
    let all = stage.run("all", &["--set", "time.max_dt=1.25e-4"]).expect_code(0);
    assert_eq!(own.json().health["solid_substeps"], 4.0);
    let tip = |run: &Finished| numbers(&run.series()["tip.csv"], 1).last().copied().expect("it has rows");
    // Equal but for the round-off of the times; Newton's tolerance is 1.5e-6.
    assert!((tip(&own) / tip(&all) - 1.0).abs() < 1e-6, "{} {}", tip(&own), tip(&all));
}
