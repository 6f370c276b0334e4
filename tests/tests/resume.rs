//! A run that goes on from a state kept by another one: it does, to the last bit, what that one would have done.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use launcher::conduct::{Ending, Observer};
use launcher::resume::{Resumption, complete};
use launcher::run_json::Status;
use launcher::time_step::Moment;
use protocol::case::Scheme;
use protocol::control::{Account, StepReport, StepTime};
use protocol::failure::Failure;
use protocol::phases::PhaseTime;
use protocol::state;
use rustix::process::Signal;
use tidewall_tests::run::{Finished, Stage, series};
use tidewall_tests::{scene, twin};

/// Stops a run after a step, completes its states, and remembers the health at its end and the first step at which the
/// guard chose another scheme.
struct Watcher {
    folder: PathBuf,
    last_step: u64,
    step: u64,
    health: BTreeMap<String, f64>,
    changed: Option<u64>,
}

impl Observer for Watcher {
    fn stepped(&mut self, at: StepTime, done: &StepReport) {
        self.step = at.step;
        self.changed = self.changed.or(done.next_scheme.map(|_| at.step));
    }

    fn output(
        &mut self,
        _: StepTime,
        accounts: &[(String, Account)],
        _: Vec<PhaseTime>,
    ) -> Result<(), Failure> {
        self.health.extend(accounts.iter().flat_map(|(_, account)| account.health.clone()));
        Ok(())
    }

    fn kept(&mut self, at: Moment) -> Result<(), Failure> {
        complete(&self.folder, at)
    }

    fn is_stopped(&self) -> bool {
        self.step >= self.last_step
    }
}

/// A run of the case in a folder: how it ended, and what was seen of it.
fn run(case: &Path, folder: &Path, (from, last_step): (Option<Moment>, u64)) -> (Ending, Watcher) {
    let (folder_of, health) = (folder.to_owned(), BTreeMap::new());
    let mut watcher = Watcher { folder: folder_of, last_step, step: 0, health, changed: None };
    let ending = twin::run_watched((case, from), folder, 1, &mut watcher);
    (ending.expect("the run goes through"), watcher)
}

/// Fails unless the rows of the series from a time on are the last ones of the whole run's series.
fn assert_rest(rest: &Path, whole: &Path, time: f64) {
    let (rest, whole) = (series(rest), series(whole));
    assert_eq!(rest.keys().collect::<Vec<_>>(), whole.keys().collect::<Vec<_>>());
    let rows = |text: &str| -> Vec<String> {
        let is_later = |row: &&str| first_number(row) > time;
        text.lines().skip(1).filter(is_later).map(str::to_owned).collect()
    };
    for (name, whole) in &whole {
        let (found, expected) = (rows(&rest[name]), rows(whole));
        assert!(expected.len() > 5, "{name} has few rows after {time} s");
        let different = found.iter().zip(&expected).position(|(found, expected)| found != expected);
        assert_eq!(found.len(), expected.len(), "{name}");
        assert!(different.is_none(), "{name} differs, first in row {different:?} after {time} s");
    }
}

fn first_number(row: &str) -> f64 {
    let time = row.split(',').next().expect("a row has columns");
    time.parse().expect("a series holds numbers")
}

/// Runs the case in one go, and in two with a state between them after `step` steps; gives the health and the moment of
/// the state.
fn assert_goes_on(case: &str, step: u64) -> (BTreeMap<String, f64>, Moment) {
    let stage = Stage::new(case);
    let keeping = stage.out("keeping.toml");
    fs::write(&keeping, case.replace("[output]\n", "[output]\nstate = true\n"))
        .expect("the stage can be written");
    let [whole, part, rest] = ["whole", "part", "rest"].map(|name| stage.out(name));
    let (_, expected) = run(&stage.case(), &whole, (None, u64::MAX));
    assert!(!state::folder(&whole).exists(), "a case that does not ask for states keeps none");
    assert_eq!(run(&keeping, &part, (None, step)).0, Ending::Interrupted);

    let state = Resumption::find(&part).expect("the part has kept a state");
    // The next step may have been ordered already when the run is told to stop.
    assert!(state.moment.step == step || state.moment.step == step + 1);
    let roles = twin::check(&keeping).programs;
    state.copy_into(&rest, roles.iter().map(|program| program.role)).expect("the state can be copied");
    let (ending, found) = run(&keeping, &rest, (Some(state.moment), u64::MAX));
    assert_eq!(ending, Ending::Completed);
    assert_rest(&rest, &whole, state.moment.time);
    assert_eq!(found.health, expected.health, "sums and extremes are those of the whole run");
    let last = |run: &Path, side: &str| fs::read(run.join(format!("fields/{side}_00006.vtu"))).ok();
    assert_eq!(last(&rest, "solid"), last(&whole, "solid"));
    let last = |run: &Path| fs::read(run.join("fields/fluid_00006.vtp")).ok();
    assert_eq!(last(&rest), last(&whole));
    (found.health, state.moment)
}

fn with_coupling(keys: &str) -> String {
    format!("{}\n[coupling]\n{keys}\n", scene::coupled())
}

#[test]
fn a_robin_wall_goes_on_to_the_last_bit() {
    assert_goes_on(&scene::coupled(), 47);
}

#[test]
fn predicted_and_parallel_walls_go_on_to_the_last_bit() {
    for keys in ["scheme = \"css\"\nprediction_order = 2", "scheme = \"parallel\"\nload = \"markers\""] {
        assert_goes_on(&with_coupling(keys), 61);
    }
}

#[test]
fn points_that_turn_with_the_wall_go_on_to_the_last_bit() {
    for keys in ["", "scheme = \"css\"\nload = \"markers\"", "scheme = \"strong\""] {
        assert_goes_on(&with_coupling(&format!("fluid_side = \"points\"\n{keys}")), 47);
    }
}

#[test]
fn what_passes_have_learnt_goes_on_to_the_last_bit() {
    for acceleration in ["iqn-ils", "imvj", "aitken"] {
        let keys = format!("scheme = \"strong\"\nacceleration = \"{acceleration}\"");
        assert_goes_on(&with_coupling(&keys), 50);
    }
}

#[test]
fn a_scheme_the_guard_has_chosen_goes_on_to_the_last_bit() {
    // Water so heavy that passes are chosen, from the second step on.
    let plate = scene::plate(100.0).replace("end = 0.06", "end = 0.01").replace("[time]", "[output]\n[time]");
    let (health, _) = assert_goes_on(&plate, 21);
    assert!(health["coupling_passes"] > 1.5, "{health:?}");
}

#[test]
fn a_change_of_scheme_that_is_due_goes_on_to_the_last_bit() {
    // A restless load calls for the Robin wall from the step after the next on; the state lies between the two.
    let keys = "[coupling]\nscheme = \"css\"\non_guard = \"escalate\"";
    let plate = scene::plate(1.4).replace("[time]", &format!("{keys}\n[output]\n[time]"));
    let stage = Stage::new(&plate);
    let step =
        run(&stage.case(), &stage.out("seen"), (None, u64::MAX)).1.changed.expect("the load is restless");
    let (health, moment) = assert_goes_on(&plate, step - 1);
    assert_eq!((moment.step, moment.next_scheme), (step, Some(Scheme::Robin)));
    assert_eq!(health["escalations_to_robin"], 1.0);
}

#[test]
fn water_alone_goes_on_to_the_last_bit() {
    let turbulent = scene::fluid_only().replace("[fluid]\n", "[fluid]\nsmagorinsky = 0.15\nshifting = 2.0\n");
    assert_goes_on(&turbulent, 33);
    let explicit = format!("{}\n[fluid.weakly_compressible]\n", scene::fluid_only());
    assert_goes_on(&explicit, 70);
}

#[test]
fn a_body_that_yields_goes_on_to_the_last_bit() {
    // Stiff enough for a factor that is kept over many steps, soft enough to flow.
    let metal = "young_modulus = 1e9\nstart = \"unloaded\"\nmaterial = \"plasticity\"\nhardening = [[0.0, 4e3], [1.0, 1e6]]\n";
    let (health, _) = assert_goes_on(&scene::solid_only().replace("young_modulus = 1e5\n", metal), 55);
    assert!(health["solid_factorizations"] > 0.0 && health["solid_tangents"] > 1.0, "{health:?}");
}

#[test]
fn a_body_that_rests_sleeps_on_and_a_rigid_one_stands() {
    let weight = scene::solid_only().replace("[9.81, 0.0]", "[0.0, -9.81]");
    assert!(assert_goes_on(&weight, 40).0["solid_slept_steps"] > 0.0);
    assert_goes_on(&scene::coupled_rigid(), 40);
}

#[test]
fn series_with_few_rows_keep_their_rhythm() {
    assert_goes_on(&scene::coupled().replace("[output]\n", "[output]\nseries_every = 0.0023\n"), 30);
}

/// A run of the small dam interrupted by the user after 0.02 s, which keeps its state.
fn interrupted() -> (Stage, Finished) {
    let stage = Stage::new(&scene::coupled());
    let mut run = stage.start("part", &["--set", "output.state=true", "--set", "time.max_dt=5e-5"]);
    run.wait_until_simulated(0.02);
    run.hold();
    run.signal(Signal::INT);
    run.go_on();
    let part = run.end().expect_code(130).expect_no_trace();
    (stage, part)
}

#[test]
fn an_interrupted_run_is_resumed_as_if_it_had_gone_through() {
    let (stage, part) = interrupted();
    let whole = stage.run("whole", &["--set", "time.max_dt=5e-5", "--threads", "1"]).expect_code(0);
    let rest = stage.resume("part", "rest", &[]).expect_code(0).expect_no_trace();
    let continued = rest.json().continued.expect("run.json says what the run goes on from");
    assert_eq!((continued.step, continued.time_s), (part.json().steps, part.json().simulated_s));
    assert!(fs::read_to_string(rest.out.join("report.html")).unwrap().contains("Continued from "));
    assert_rest(&rest.out, &whole.out, continued.time_s);
    assert_eq!((rest.json().status, rest.json().steps), (Status::Completed, whole.json().steps));
    assert_eq!(rest.json().health, whole.json().health);
    // It keeps states of its own, from which it goes on in its turn, by another scheme and solver too.
    let case = stage.case();
    let mut options = vec!["--case", case.to_str().unwrap(), "--until", "0.07"];
    let other =
        ["output.state=true", "coupling.scheme=css", "fluid.solver=incomplete_cholesky", "time.max_dt=1e-4"];
    options.extend(other.iter().flat_map(|option| ["--set", option]));
    let later = stage.resume("rest", "later", &options).expect_code(0);
    assert_eq!(later.json().simulated_s, 0.07);
    assert_eq!(later.json().continued.unwrap().step, whole.json().steps);
}

#[test]
fn what_cannot_be_resumed_is_refused_before_anything_starts() {
    let (stage, _part) = interrupted();
    let refused = |options: &[&str], words: &str| {
        let refused = stage.resume("part", "refused", options).expect_code(2);
        assert!(refused.stderr.contains(words), "{words}: {}", refused.stderr);
        assert_eq!(refused.stderr.lines().count(), 1, "{}", refused.stderr);
        assert!(!refused.out.exists(), "no run folder is made");
    };
    refused(&["--set", "fluid.spacing=0.006"], "fluid.spacing expected 0.012, found 0.006");
    refused(&["--set", "solid.elements=[1, 8]"], "solid.elements expected [1.0, 6.0], found [1.0, 8.0]");
    refused(&["--until", "0.01"], "Give a later end with --until");
    let step = Resumption::find(&stage.out("part")).unwrap().moment.step;
    let file = |role: &str| state::file(&stage.out("part"), step, role);
    let whole = fs::read(file("solid")).unwrap();
    let mut damaged = whole.clone();
    damaged[whole.len() / 2] ^= 1;
    fs::write(file("solid"), &damaged).unwrap();
    refused(&[], "is damaged: its checksum does not fit");
    damaged[8] = 9;
    fs::write(file("solid"), &damaged).unwrap();
    refused(&[], "version expected 1, found 9");
    fs::remove_file(file("solid")).unwrap();
    refused(&[], "cannot be read");
    fs::remove_file(file("time_loop")).unwrap();
    refused(&[], "holds no state to go on from");
}

#[test]
fn a_state_is_asked_of_programs_that_keep_one_only() {
    let case = scene::coupled_with(&tidewall_tests::programs::program("bad-participant"));
    let stage = Stage::new(&case);
    let refused =
        stage.start_with("run", &["--set", "output.state=true"], &[("TIDEWALL_TEST_FLAW", "forgets")]);
    let refused = refused.end().expect_code(2);
    assert!(refused.stderr.contains("bad-participant cannot keep its state"), "{}", refused.stderr);
}
