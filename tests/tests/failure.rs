//! How runs end that do not end well: each with one cause, its exit code, and nothing left behind.

use std::fs;
use std::path::PathBuf;

use launcher::run::check_room;
use launcher::run_json::Status;
use rustix::process::Signal;
use tidewall_tests::run::{Finished, Stage, assert_same_series, send, series, until};
use tidewall_tests::traces::{self, Traces};
use tidewall_tests::{scene, twin};

const CHILDREN: [&str; 3] = ["fluid-isph", "coupler", "solid-fem"];

/// The run ended with exit 4 because this child was killed; gives the step of the message.
fn assert_killed(finished: Finished, program: &str) -> u64 {
    let finished = finished.expect_code(4).expect_no_trace();
    let line = finished.stderr.lines().find(|line| line.starts_with("tidewall: ")).unwrap_or_default();
    assert!(line.starts_with(&format!("tidewall: {program} failed in ")), "{}", finished.stderr);
    assert!(line.contains("was killed by signal 9 (SIGKILL)"), "{line}");
    let json = finished.json();
    let failure = json.failure.expect("a failed run says why");
    assert_eq!((json.status, json.exit_code), (Status::Failed, 4));
    assert_eq!(failure.process, program);
    assert!(line.contains(&format!(" at step {} ", failure.step)), "{line}");
    assert!(finished.out.join("report.html").exists(), "a failed run has a report too");
    failure.step
}

#[test]
fn a_child_killed_in_the_handshake_is_named() {
    for (program, has_joined) in CHILDREN.into_iter().flat_map(|program| [(program, false), (program, true)])
    {
        let stage = Stage::new(&scene::coupled());
        let mut run = stage.start("run", &[]);
        let child = run.participant(program);
        let log = stage.out("run").join("log").join(format!("{program}.jsonl"));
        if has_joined {
            run.wait_for("joining", |_| fs::read_to_string(&log).ok().filter(|log| log.contains("joined")));
        }
        send(child, Signal::KILL);
        let step = assert_killed(run.end(), program);
        assert!(step == 0 || has_joined, "killed at its start, named step {step}");
    }
}

#[test]
fn a_child_killed_in_mid_run_is_named_with_the_step() {
    for program in CHILDREN {
        let stage = Stage::new(&scene::coupled());
        let mut run = stage.start("run", &["--set", "time.max_dt=1e-4"]);
        let child = run.participant(program);
        let before = run.wait_until_simulated(0.01);
        send(child, Signal::KILL);
        let step = assert_killed(run.end(), program);
        assert!(step >= before.steps, "killed after step {}, named step {step}", before.steps);
    }
}

#[test]
fn a_child_killed_near_the_end_is_named_with_the_step() {
    for program in CHILDREN {
        let stage = Stage::new(&scene::coupled());
        let arguments = ["--set", "time.max_dt=2.5e-5", "--set", "output.fields_every=0.003"];
        let mut run = stage.start("run", &arguments);
        let child = run.participant(program);
        let before = run.wait_until_simulated(0.056);
        // No order is given while the launcher is held, so the run cannot end before the kill.
        run.hold();
        send(child, Signal::KILL);
        run.go_on();
        let step = assert_killed(run.end(), program);
        assert!(step >= before.steps, "killed after step {}, named step {step}", before.steps);
    }
}

#[test]
fn children_of_a_killed_launcher_end_by_themselves() {
    let stage = Stage::new(&scene::coupled());
    let mut run = stage.start("run", &["--until", "60"]);
    let children = CHILDREN.map(|program| run.participant(program));
    run.wait_until_simulated(0.01);
    let traces = Traces::of(&run.seen()[0]);
    assert!(!traces.left().is_empty(), "a run has files while it runs");
    let killed = std::time::Instant::now();
    run.signal(Signal::KILL);
    assert!(run.end().status.code().is_none());
    until("the children end", || !children.into_iter().any(traces::is_alive));
    println!("the children ended {:.3} s after the launcher was killed", killed.elapsed().as_secs_f64());
    // Whatever the last one out has left, the next run sweeps.
    Stage::new(&scene::fluid_only()).run("next", &["--until", "0.001"]).expect_code(0);
    assert_eq!(traces.left(), Vec::<PathBuf>::new());
}

#[test]
fn a_launcher_killed_in_the_handshake_leaves_nothing() {
    let stage = Stage::new(&scene::coupled());
    let mut run = stage.start("run", &[]);
    let first = run.participant("fluid-isph");
    run.signal(Signal::KILL);
    let traces = Traces::of(&run.seen()[0]);
    let children: Vec<u32> = run.seen().iter().map(|found| found.pid).chain([first]).collect();
    drop(run);
    until("the children end", || !children.iter().any(|&pid| traces::is_alive(pid)));
    Stage::new(&scene::fluid_only()).run("next", &["--until", "0.001"]).expect_code(0);
    assert_eq!(traces.left(), Vec::<PathBuf>::new());
}

#[test]
fn a_stopped_child_is_named_after_the_silence_limit() {
    for program in CHILDREN {
        let stage = Stage::new(&scene::coupled());
        let arguments = ["--until", "60", "--set", "time.silence_limit=2.0"];
        let mut run = stage.start("run", &arguments);
        let child = run.participant(program);
        let before = run.wait_until_simulated(0.01);
        send(child, Signal::STOP);
        let finished = run.end().expect_code(4).expect_no_trace();
        assert!(finished.stderr.contains(&format!("tidewall: {program} failed in ")), "{}", finished.stderr);
        assert!(finished.stderr.contains("was stopped from outside"), "{}", finished.stderr);
        let failure = finished.json().failure.unwrap();
        assert_eq!(failure.process, program);
        assert!(failure.step >= before.steps, "{failure}");
    }
}

#[test]
fn an_interrupt_finishes_the_step_and_writes_the_report() {
    for signal in [Signal::INT, Signal::TERM] {
        let stage = Stage::new(&scene::coupled());
        let mut run = stage.start("run", &["--until", "60"]);
        run.wait_until_simulated(0.01);
        run.signal(signal);
        let finished = run.end().expect_code(130).expect_no_trace();
        let json = finished.json();
        assert_eq!((json.status, json.exit_code), (Status::Interrupted, 130));
        assert!(json.failure.is_none(), "{:?}", json.failure);
        assert!(finished.out.join("report.html").metadata().unwrap().len() > 1000);
        // Every side has written the step that was finished, and none after it.
        for (name, text) in finished.series() {
            let last: f64 = text.lines().last().unwrap().split(',').next().unwrap().parse().unwrap();
            assert_eq!(last, json.simulated_s, "{name}");
        }
    }
}

/// A load that nothing balances: the run ends with the element or residual at fault, the state before that step is written,
/// and the series hold every step that was done.
#[test]
fn a_solid_that_cannot_go_on_leaves_its_last_good_state() {
    let stage = Stage::new(&scene::solid_crushed());
    let finished = stage.run("run", &[]).expect_code(3).expect_no_trace();
    let json = finished.json();
    let failure = json.failure.expect("a failed run says why");
    assert_eq!((failure.process.as_str(), failure.phase.as_str()), ("solid-fem", "advance"));
    assert!(failure.step == json.steps + 1 && failure.time_s > 0.03 && !failure.hint.is_empty(), "{failure}");
    // The writer of fields refuses what is not finite.
    let state = fs::read(finished.out.join("fields/solid_last_good.vtu")).unwrap();
    let state = String::from_utf8_lossy(&state);
    assert!(state.contains("displacement_m") && state.contains("von_mises_pa"));
    let tip = fs::read_to_string(finished.out.join("series/tip.csv")).unwrap();
    let last: f64 = tip.lines().last().unwrap().split(',').next().unwrap().parse().unwrap();
    assert_eq!(last, json.simulated_s);
}

#[test]
fn a_second_run_into_the_same_folder_is_refused() {
    let stage = Stage::new(&scene::coupled());
    let first = stage.run("run", &["--until", "0.005"]).expect_code(0).expect_no_trace();
    let (json, rows) = (fs::read_to_string(first.out.join("run.json")).unwrap(), first.series());
    let second = stage.run("run", &["--until", "0.005"]).expect_code(5);
    assert!(second.stderr.contains("holds a run already"), "{}", second.stderr);
    assert_eq!(second.stderr.trim().lines().count(), 1, "one line of cause: {}", second.stderr);
    assert_eq!(second.programs(), Vec::<&str>::new(), "nothing is started");
    assert_eq!(fs::read_to_string(first.out.join("run.json")).unwrap(), json);
    assert_same_series(&series(&first.out), &rows);
}

#[test]
fn an_output_folder_that_cannot_be_made_is_named() {
    let stage = Stage::new(&scene::coupled());
    fs::write(stage.out("file"), "in the way").unwrap();
    for out in ["file", "file/run"] {
        let mut tidewall = std::process::Command::new(tidewall_tests::programs::program("tidewall"));
        let done = tidewall.arg("run").arg(stage.case()).arg("--out").arg(stage.out(out)).output().unwrap();
        let words = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(5), "{words}");
        assert!(words.contains(&*stage.out(out).to_string_lossy()), "{words}");
        assert_eq!(words.trim().lines().count(), 1, "one line of cause: {words}");
    }
    assert_eq!(fs::read_to_string(stage.out("file")).unwrap(), "in the way");
}

#[test]
fn a_run_that_shared_memory_has_no_room_for_is_refused() {
    let stage = Stage::new(&scene::coupled());
    let checked = twin::check(&stage.case());
    check_room(&checked, 1 << 30).unwrap();
    let refused = check_room(&checked, 256 << 10).unwrap_err();
    assert_eq!(refused.class.exit_code(), 5);
    assert!(refused.what.contains("/dev/shm has 256 kB free"), "{refused}");
    assert!(refused.hint.contains("/dev/shm"), "{refused}");
    // The need grows with the interface, and is there without one.
    let need = |case: &str| {
        let stage = Stage::new(case);
        let checked = twin::check(&stage.case());
        (0..).map(|step| step * 4096).find(|&free| check_room(&checked, free).is_ok()).unwrap()
    };
    let fine = scene::coupled_rigid().replace("elements = [1, 6]", "elements = [1, 600]");
    assert!(need(&fine) > need(&scene::coupled_rigid()));
    assert!(need(&scene::fluid_only()) > 0);
}

#[test]
fn five_mistakes_are_reported_at_once_and_nothing_is_started() {
    let wrong = [
        ("kinematic_viscosity = 1e-6", "kinematic_viscosity = -1e-6", "fluid.kinematic_viscosity"),
        ("open = [\"top\"]", "open = [\"lid\"]", "domain.open"),
        ("density = 2500.0\n", "density = 2500.0\nyoung = 1.0\n", "solid.young"),
        ("end = 0.06\n", "", "time.end"),
        ("of = \"fluid\"", "of = \"fluit\"", "gauge[1].of"),
    ];
    let case = wrong.iter().fold(scene::coupled(), |case, (right, wrong, _)| {
        assert!(case.contains(right));
        case.replacen(right, wrong, 1)
    });
    let stage = Stage::new(&case);
    for command in ["check", "run"] {
        let mut tidewall = std::process::Command::new(tidewall_tests::programs::program("tidewall"));
        tidewall.arg(command).arg(stage.case());
        if command == "run" {
            tidewall.arg("--out").arg(stage.out("run"));
        }
        let done = tidewall.output().unwrap();
        let words = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{words}");
        for (_, _, key) in wrong {
            assert!(words.contains(&format!("{key}: ")), "{key} is not reported:\n{words}");
        }
        assert!(words.contains("5 mistakes in "), "{words}");
        assert!(words.contains("Did you mean \"fluid\"?"), "{words}");
        assert!(!stage.out("run").exists(), "no run folder is made");
    }
}

#[test]
fn two_runs_at_once_are_bit_equal_to_one_alone() {
    let stage = Stage::new(&scene::coupled());
    let alone = stage.run("alone", &[]).expect_code(0).expect_no_trace();
    let (mut one, mut two) = (stage.start("one", &[]), stage.start("two", &[]));
    let together = [&mut one, &mut two].map(|run| {
        run.participant("fluid-isph");
        Traces::of(&run.seen()[0])
    });
    assert_ne!(together[0], together[1], "each has its own names");
    for run in [one, two] {
        let finished = run.end().expect_code(0).expect_no_trace();
        assert_same_series(&finished.series(), &alone.series());
    }
}
