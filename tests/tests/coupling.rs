//! What a coupled run must not depend on: the transport, the number of threads, the order in which the programs start,
//! and which program stands in the solid's place. And what a scene does not need must not be there.

use std::fs;
use std::path::Path;
use std::time::Duration;

use launcher::conduct::{Ending, Observer, conduct};
use launcher::processes::{Launch, ProcessSpec, Processes};
use protocol::inprocess::Hub;
use protocol::interface::Contract;
use protocol::link::{LinkError, Transport, agree};
use protocol::names::{RunId, RunNames};
use tidewall_tests::run::{Finished, Stage, assert_same_series, series};
use tidewall_tests::{programs, scene, twin};

const SILENCE: Duration = Duration::from_secs(60);

#[test]
fn iceoryx2_and_memory_carry_the_same_bits() {
    for scene in [scene::coupled(), scene::coupled_rigid()] {
        let stage = Stage::new(&scene);
        let run = stage.run("run", &["--threads", "1"]).expect_code(0).expect_no_trace();
        let folder = stage.out("twin");
        let ending = twin::run(&run.out.join("case.lock.toml"), &folder, 1).unwrap();
        assert_eq!(ending, Ending::Completed);
        assert_same_series(&series(&folder), &run.series());
        assert!(run.series().contains_key("interface.csv"), "the coupler's ledger is compared too");
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let stage = Stage::new(&scene::coupled());
    let one = stage.run("1", &["--threads", "1"]).expect_code(0).expect_no_trace();
    for threads in ["2", "4"] {
        let more = stage.run(threads, &["--threads", threads]).expect_code(0).expect_no_trace();
        assert_same_series(&more.series(), &one.series());
        assert_eq!(more.json().threads.to_string(), threads);
        assert_eq!(more.json().health, one.json().health);
    }
}

#[test]
fn the_order_of_starts_changes_no_bit() {
    let stage = Stage::new(&scene::coupled());
    let run = stage.run("run", &["--until", "0.01", "--threads", "1"]).expect_code(0).expect_no_trace();
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        let folder = stage.out(&format!("order-{order:?}"));
        conduct_in_order(&run.out.join("case.lock.toml"), &folder, order);
        assert_same_series(&series(&folder), &run.series());
    }
}

/// Starts fluid (0), coupler (1) and solid (2) in this order and conducts the run.
fn conduct_in_order(lock: &Path, folder: &Path, order: [usize; 3]) {
    let checked = twin::check(lock);
    let names = RunNames::of(RunId::random().expect("the system has random numbers"));
    let log = folder.join("log");
    fs::create_dir_all(&log).expect("the stage can be written");
    let spec = |index: usize| {
        let program = &checked.programs[index];
        let words = ["--run", &lock.to_string_lossy(), "--folder", &folder.to_string_lossy()]
            .map(std::ffi::OsString::from);
        ProcessSpec {
            name: program.role.to_owned(),
            program: program.path.clone(),
            arguments: words.into(),
            environment: Vec::new(),
        }
    };
    programs::folder();
    let launch = Launch { names: &names, log: &log, timeout: SILENCE };
    let mut crew = Processes::start(launch, &order.map(spec)).expect("the programs start");
    struct Nobody;
    impl Observer for Nobody {}
    let ending = conduct(&mut crew, &checked.shared, checked.interface(), &mut Nobody);
    assert_eq!(ending.expect("the run goes through"), Ending::Completed);
    crew.finish().expect("the programs end");
    assert!(!names.root().exists());
}

#[test]
fn the_stub_takes_the_solids_place() {
    let stages = [Stage::new(&scene::coupled()), Stage::new(&scene::coupled_rigid())];
    let [elastic, rigid] = [0, 1].map(|which| stages[which].run("run", &[]).expect_code(0).expect_no_trace());
    assert_eq!(elastic.programs(), ["coupler", "fluid-isph", "solid-fem"]);
    assert_eq!(rigid.programs(), ["coupler", "fluid-isph", "solid-rigid"]);
    // The soft wall gives way, the rigid one does not, and it holds what the water does to it.
    let deflection = |run: &Finished| last_row(&run.series()["tip.csv"])[1].abs();
    assert!(deflection(&elastic) > 1e-5, "{}", deflection(&elastic));
    assert_eq!(deflection(&rigid), 0.0);
    let (held, felt) = (&rigid.series()["reaction.csv"], &rigid.series()["body_force.csv"]);
    let (held, felt) = (last_row(held)[1], last_row(felt)[1]);
    assert!((held + felt).abs() <= 1e-6 * felt.abs().max(1.0), "held {held} N/m, felt {felt} N/m");
}

fn last_row(series: &str) -> Vec<f64> {
    let last = series.lines().last().expect("a series has rows");
    last.split(',').map(|number| number.parse().expect("a series holds numbers")).collect()
}

/// The programs that ran and their phases, as `run.json` lists them.
fn phases(run: &Finished) -> Vec<(String, Vec<String>)> {
    let names = |process: &launcher::run_json::ProcessEntry| {
        (process.name.clone(), process.phases.iter().map(|phase| phase.name.clone()).collect())
    };
    run.json().processes.iter().map(names).collect()
}

#[test]
fn water_alone_starts_only_the_fluid() {
    let stage = Stage::new(&scene::fluid_only());
    let mut run = stage.start("run", &[]);
    run.wait_until_simulated(0.01);
    run.hold();
    // One for orders, one for answers: no data channel.
    assert_eq!(channels(&run.seen()[0].prefix), 2);
    run.go_on();
    let run = run.end().expect_code(0).expect_no_trace();
    assert_eq!(run.programs(), ["fluid-isph"]);
    let phases = phases(&run);
    assert_eq!(phases.len(), 1);
    let (name, phases) = &phases[0];
    assert_eq!(name, "fluid-isph");
    for absent in ["receive motion", "send load", "turbulence"] {
        assert!(!phases.iter().any(|phase| phase == absent), "{absent}: {phases:?}");
    }
    let left_out: Vec<_> = run.json().left_out.iter().map(|entry| entry.what.clone()).collect();
    assert!(left_out.iter().any(|what| what == "coupler process, data channels"), "{left_out:?}");
    assert!(!run.series().contains_key("interface.csv"));
}

#[test]
fn water_and_body_take_four_data_channels_more() {
    let stage = Stage::new(&scene::coupled());
    let mut run = stage.start("run", &[]);
    run.wait_until_simulated(0.01);
    run.hold();
    assert_eq!(channels(&run.seen()[0].prefix), 3 * 2 + 4);
    run.go_on();
    let run = run.end().expect_code(0).expect_no_trace();
    let fluid = phases(&run).into_iter().find(|(name, _)| name == "fluid-isph").unwrap().1;
    assert!(fluid.iter().any(|phase| phase == "receive motion"), "{fluid:?}");
}

/// The channels of a run: each has one sender with one data segment in shared memory.
fn channels(prefix: &str) -> usize {
    let files = fs::read_dir("/dev/shm").expect("there is shared memory").flatten();
    let names = files.map(|file| file.file_name().to_string_lossy().into_owned());
    names.filter(|name| name.starts_with(prefix) && name.ends_with(".data")).count()
}

#[test]
fn a_body_alone_starts_only_the_solid() {
    let stage = Stage::new(&scene::solid_only());
    let run = stage.run("run", &[]).expect_code(0).expect_no_trace();
    assert_eq!(run.programs(), ["solid-fem"]);
    let phases = phases(&run);
    assert_eq!(phases.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["solid-fem"]);
    assert!(last_row(&run.series()["tip.csv"])[1].abs() > 0.0, "it swings under its weight");
}

/// A run with a solid that does not fit; it is refused.
fn refused(flaw: &str) -> (Stage, Finished) {
    let stage = Stage::new(&scene::coupled_with(&programs::program("bad-participant")));
    let run = stage.start_with("run", &[], &[("TIDEWALL_TEST_FLAW", flaw)]).end().expect_code(2);
    (stage, run)
}

/// Fails unless the launcher gives the view of one of the sides in its message, and so does that side's log; the other
/// side says its own view, or that it was called off before it came to that.
fn assert_both_views(run: &Finished, solid: &str, coupler: &str) {
    let log = |name: &str| {
        fs::read_to_string(run.out.join(format!("log/{name}.jsonl"))).expect("participants keep a log")
    };
    let sides = [("bad-participant", solid), ("coupler", coupler)];
    let is_named = |(name, view): (&str, &str)| {
        run.stderr.contains(&format!("tidewall: {name} failed in ")) && run.stderr.contains(view)
    };
    assert_eq!(sides.into_iter().filter(|&side| is_named(side)).count(), 1, "{}", run.stderr);
    for side in sides {
        let log = log(side.0);
        let is_called_off = !is_named(side) && log.contains("the run was called off");
        assert!(log.contains(side.1) || is_called_off, "{side:?}: {log}");
    }
}

#[test]
fn another_protocol_version_is_refused_by_both_sides() {
    let (_stage, run) = refused("version");
    let run = run.expect_no_trace();
    let solid = "protocol version of coupler: expected 3, found 2";
    assert_both_views(&run, solid, "protocol version of solid: expected 2, found 3");
}

#[test]
fn another_protocol_version_is_found_before_anything_starts() {
    let (_stage, run) = refused("check-version");
    assert!(run.stderr.contains("protocol version: expected 2, found 3 in "), "{}", run.stderr);
    assert_eq!(run.programs(), Vec::<&str>::new());
    assert!(!run.out.exists(), "no run folder is made");
}

#[test]
fn another_interface_size_is_refused_by_both_sides() {
    let (stage, run) = refused("size");
    let run = run.expect_no_trace();
    let lock = fs::read(stage.out("run/case.lock.toml")).unwrap();
    let scene = crc32fast::hash(&lock);
    // Six cells along the height of the planned surface make 2 x 7 nodes, nine cells 2 x 10.
    let side = |nodes: usize| format!("2-D, {nodes} interface nodes, end 0.06 s, scene {scene:08x}");
    let (planned, made) = (side(14), side(20));
    let solid = format!("interface of coupler: expected {made}; found {planned}");
    assert_both_views(&run, &solid, &format!("interface of solid: expected {planned}; found {made}"));
}

#[test]
fn both_ends_of_a_link_refuse_an_unequal_contract() {
    let contract = |nodes| Contract { dimension: 2, node_count: nodes, end_time: 1.0, scene: 7 };
    let hub = Hub::new(SILENCE);
    let ends = [("solid", "coupler", 20), ("coupler", "solid", 14)].map(|(own, peer, nodes)| {
        let mut transport = hub.transport(own);
        std::thread::spawn(move || agree(&mut *transport.connect(peer, 8).unwrap(), &contract(nodes)))
    });
    for (end, (peer, mine, theirs)) in ends.into_iter().zip([("coupler", 20, 14), ("solid", 14, 20)]) {
        let (expected, found) = (contract(mine).to_string(), contract(theirs).to_string());
        let refused = LinkError::Contract { peer: peer.to_owned(), expected, found };
        assert_eq!(end.join().unwrap(), Err(refused));
    }
}

#[test]
fn another_program_in_the_solids_place_gives_the_same_bits() {
    let misfit = scene::coupled_with(&programs::program("bad-participant"));
    let stages = [Stage::new(&misfit), Stage::new(&scene::coupled_rigid())];
    let [other, stub] =
        [0, 1].map(|which| stages[which].run("run", &["--until", "0.005"]).expect_code(0).expect_no_trace());
    assert_eq!(other.programs(), ["bad-participant", "coupler", "fluid-isph"]);
    assert_same_series(&other.series(), &stub.series());
}
