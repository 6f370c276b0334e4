//! The transport between processes: each test starts this very program again as the other process.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::Duration;

use common::{CAPACITY, Echoed, bits, echo, receive, send, timed};
use protocol::PROTOCOL_VERSION;
use protocol::header::{Header, Kind};
use protocol::ipc::{IpcServer, IpcTransport};
use protocol::link::{Expect, LinkError, Transport};
use protocol::names::{RunId, RunNames};
use protocol::sweep;

const LONG: Duration = Duration::from_secs(60);
const SHORT: Duration = Duration::from_millis(500);

/// A run of its own per test; nothing may be left of it.
struct TestRun {
    names: RunNames,
}

impl TestRun {
    fn new() -> Self {
        let names = RunNames::of(RunId::random().unwrap());
        sweep::claim(&names).unwrap();
        Self { names }
    }

    /// Starts this program again; it then plays `role` in [`the_other_process`].
    fn spawn(&self, role: &str) -> Child {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", "the_other_process", "--nocapture", "--test-threads=1"]);
        command.env("TIDEWALL_TEST_ROLE", role).env("TIDEWALL_TEST_PREFIX", self.names.prefix());
        command.env("TIDEWALL_TEST_ROOT", self.names.root()).stdout(Stdio::null());
        command.spawn().unwrap()
    }

    fn fluid(&self, timeout: Duration) -> IpcTransport {
        IpcTransport::new(&self.names, "fluid", timeout).unwrap()
    }
}

impl Drop for TestRun {
    fn drop(&mut self) {
        assert_eq!(sweep::remove_run(&self.names), Vec::<std::path::PathBuf>::new());
        assert!(!self.names.root().exists());
        assert_eq!(shared_files(&self.names), 0);
    }
}

fn shared_files(names: &RunNames) -> usize {
    let files = std::fs::read_dir("/dev/shm").unwrap().map(|entry| entry.unwrap().file_name());
    files.filter(|name| name.to_string_lossy().starts_with(names.prefix())).count()
}

fn succeeded(mut child: Child) -> bool {
    child.wait().as_ref().is_ok_and(ExitStatus::success)
}

/// No test by itself: the other process of all others. It succeeds if its role went as it should.
#[test]
fn the_other_process() {
    let Ok(role) = std::env::var("TIDEWALL_TEST_ROLE") else { return };
    let variable = |name| std::env::var(name).unwrap();
    let root = variable("TIDEWALL_TEST_ROOT");
    let names = RunNames::new(&variable("TIDEWALL_TEST_PREFIX"), Path::new(&root)).unwrap();
    let mut transport = IpcTransport::new(&names, "coupler", LONG).unwrap();
    match role.as_str() {
        "echo" => echo(&mut transport, "fluid").unwrap(),
        "late echo" => {
            thread::sleep(Duration::from_millis(300));
            echo(&mut transport, "fluid").unwrap();
        }
        "foreign version" => {
            let mut link = transport.connect("fluid", 8).unwrap();
            let foreign =
                Header { protocol_version: PROTOCOL_VERSION + 1, ..Header::new(Kind::Load, 1, 0.0, 0.0) };
            link.send(foreign, 2, &mut |_| ()).unwrap();
            send(&mut *link, Kind::Load, 2, 0.0, &[1.0, 2.0]).unwrap();
            send(&mut *link, Kind::Motion, 3, 0.0, &[1.0]).unwrap();
            send(&mut *link, Kind::Load, 5, 0.0, &[1.0]).unwrap();
        }
        "control" => {
            let mut control = transport.control().unwrap();
            let order = Expect { kind: Kind::Order, step: 1, count: Some(3) };
            control.receive(order, &mut |_, bytes| assert_eq!(bytes, b"act")).unwrap();
            let reply = Header::new(Kind::Reply, 1, 0.0, 0.0);
            control.send(reply, 4, &mut |target| target.copy_from_slice(b"done")).unwrap();
        }
        "wait for data" => {
            let mut control = transport.control().unwrap();
            let mut link = transport.connect("fluid", 8).unwrap();
            control.send(Header::new(Kind::Reply, 1, 0.0, 0.0), 0, &mut |_| ()).unwrap();
            let (result, waited) = timed(|| receive(&mut *link, 1, 1));
            assert_eq!(result, Err(LinkError::Aborted));
            assert!(waited < LONG / 2);
        }
        "come and hang" => {
            let mut control = transport.control().unwrap();
            let _link = transport.connect("fluid", 8).unwrap();
            control.send(Header::new(Kind::Reply, 1, 0.0, 0.0), 0, &mut |_| ()).unwrap();
            thread::sleep(LONG);
        }
        "hang" => {
            let _link = transport.connect("fluid", 8).unwrap();
            thread::sleep(LONG);
        }
        other => panic!("no role {other}"),
    }
}

#[test]
fn any_slice_arrives_bit_for_bit() {
    let run = TestRun::new();
    let child = run.spawn("echo");
    let mut echoed = Echoed::new(&mut run.fluid(LONG), "coupler");
    common::any_slice_survives(&mut echoed);
    let full: Vec<f64> = (0..CAPACITY).map(|i| (i as f64).sqrt()).collect();
    assert_eq!(bits(&echoed.journey(&full)), bits(&full));
    echoed.end();
    assert!(succeeded(child));
}

#[test]
fn either_side_may_come_first() {
    for (role, pause) in [("late echo", 0), ("echo", 300)] {
        let run = TestRun::new();
        let child = run.spawn(role);
        thread::sleep(Duration::from_millis(pause));
        let mut echoed = Echoed::new(&mut run.fluid(LONG), "coupler");
        assert_eq!(echoed.journey(&[1.0, -0.0]), [1.0, -0.0]);
        echoed.end();
        assert!(succeeded(child), "{role}");
    }
}

#[test]
fn twenty_runs_started_at_once_do_not_disturb_each_other() {
    let runs: Vec<_> = (0..20).map(|_| TestRun::new()).map(|run| (run.spawn("echo"), run)).collect();
    for (child, run) in runs {
        let mut echoed = Echoed::new(&mut run.fluid(LONG), "coupler");
        assert_eq!(echoed.journey(&[2.0]), [2.0]);
        echoed.end();
        assert!(succeeded(child));
    }
}

#[test]
fn control_works_both_ways_and_the_last_word_is_heard() {
    let run = TestRun::new();
    let server = IpcServer::new(&run.names, &["coupler"], LONG).unwrap();
    let mut control = server.control("coupler").unwrap();
    let child = run.spawn("control");
    control
        .send(Header::new(Kind::Order, 1, 0.0, 0.0), 3, &mut |target| target.copy_from_slice(b"act"))
        .unwrap();
    // The child ends with its answer unread: it has to linger.
    thread::sleep(SHORT);
    let mut answer = Vec::new();
    let expect = Expect { kind: Kind::Reply, step: 1, count: None };
    control.receive(expect, &mut |_, bytes| answer.extend_from_slice(bytes)).unwrap();
    assert_eq!(answer, b"done");
    assert!(succeeded(child));
}

#[test]
fn another_version_count_kind_or_step_is_refused() {
    let run = TestRun::new();
    let child = run.spawn("foreign version");
    let mut link = run.fluid(LONG).connect("coupler", 8).unwrap();
    let peer = || "coupler".to_owned();
    let version =
        LinkError::Version { peer: peer(), expected: PROTOCOL_VERSION, found: PROTOCOL_VERSION + 1 };
    assert_eq!(receive(&mut *link, 1, 2), Err(version));
    assert_eq!(receive(&mut *link, 2, 3), Err(LinkError::Count { peer: peer(), expected: 3, found: 2 }));
    let kind = LinkError::Kind { peer: peer(), expected: Kind::Load as u32, found: Kind::Motion as u32 };
    assert_eq!(receive(&mut *link, 3, 1), Err(kind));
    assert_eq!(receive(&mut *link, 4, 1), Err(LinkError::Step { peer: peer(), expected: 4, found: 5 }));
    assert!(succeeded(child));
}

#[test]
fn abort_wakes_a_waiter_within_a_second() {
    let run = TestRun::new();
    let server = IpcServer::new(&run.names, &["coupler"], LONG).unwrap();
    let mut control = server.control("coupler").unwrap();
    let child = run.spawn("wait for data");
    let _link = run.fluid(LONG).connect("coupler", 8).unwrap();
    control.receive(Expect { kind: Kind::Reply, step: 1, count: Some(0) }, &mut |_, _| ()).unwrap();
    thread::sleep(Duration::from_millis(200));
    let (ended, after) = timed(|| {
        server.abort();
        succeeded(child)
    });
    assert!(ended);
    assert!(after < Duration::from_secs(1), "{after:?}");
}

#[test]
fn a_silent_peer_and_a_dead_receiver_end_by_the_time_out() {
    let run = TestRun::new();
    let mut child = run.spawn("hang");
    let mut transport = run.fluid(LONG);
    let mut link = transport.connect("coupler", 8).unwrap();
    transport.set_timeout(SHORT);
    let (silent, waited) = timed(|| receive(&mut *link, 1, 1));
    assert!(matches!(&silent, Err(LinkError::PeerSilent { peer, .. }) if peer == "coupler"), "{silent:?}");
    assert!(waited >= SHORT);

    child.kill().unwrap();
    child.wait().unwrap();
    for step in 1..=2 {
        send(&mut *link, Kind::Load, step, 0.0, &[1.0]).unwrap();
    }
    let (stuck, waited) = timed(|| send(&mut *link, Kind::Load, 3, 0.0, &[1.0]));
    assert!(matches!(stuck, Err(LinkError::PeerSilent { .. })), "{stuck:?}");
    assert!(waited >= SHORT);
}

#[test]
fn a_time_out_of_nothing_does_not_wait() {
    let run = TestRun::new();
    let server = IpcServer::new(&run.names, &["coupler"], Duration::ZERO).unwrap();
    let mut control = server.control("coupler").unwrap();
    let expect = Expect { kind: Kind::Reply, step: 1, count: None };
    let (result, waited) = timed(|| control.receive(expect, &mut |_, _| ()));
    assert!(matches!(result, Err(LinkError::PeerSilent { .. })), "{result:?}");
    assert!(waited < Duration::from_secs(1), "{waited:?}");
}

#[test]
fn the_watch_ends_a_wait() {
    let run = TestRun::new();
    let server = IpcServer::new(&run.names, &["coupler"], LONG).unwrap();
    let mut control = server.control("coupler").unwrap();
    let died = LinkError::PeerLost { peer: "coupler".to_owned(), how: "was killed by signal 9".to_owned() };
    let seen = died.clone();
    server.set_watch(Box::new(move || Err(seen.clone())));
    let (result, waited) =
        timed(|| control.receive(Expect { kind: Kind::Reply, step: 1, count: None }, &mut |_, _| ()));
    assert_eq!(result, Err(died));
    assert!(waited < Duration::from_secs(1), "{waited:?}");
}

#[test]
fn a_name_cannot_be_taken_twice() {
    let run = TestRun::new();
    let _first = run.fluid(LONG);
    let second = IpcTransport::new(&run.names, "fluid", LONG).map(|_| ());
    assert!(matches!(second, Err(LinkError::Transport { .. })), "{second:?}");
}

#[test]
fn a_run_that_ends_in_order_leaves_one_file_of_iceoryx2_and_its_root_folder() {
    let run = TestRun::new();
    let child = run.spawn("echo");
    let mut echoed = Echoed::new(&mut run.fluid(LONG), "coupler");
    echoed.end();
    assert!(succeeded(child));
    drop(echoed);
    // The management segment of the name space outlives its users by design; `TestRun` removes it, as every run.
    assert_eq!(shared_files(&run.names), 1);
    assert!(run.names.root().exists());
}

#[test]
fn the_need_that_is_computed_covers_what_is_used() {
    use protocol::shm::{control_needs, data_need, needed_bytes};
    let run = TestRun::new();
    let server = IpcServer::new(&run.names, &["coupler"], LONG).unwrap();
    let mut control = server.control("coupler").unwrap();
    let mut child = run.spawn("come and hang");
    let mut transport = run.fluid(LONG);
    let mut link = transport.connect("coupler", 100_000).unwrap();
    control.receive(Expect { kind: Kind::Reply, step: 1, count: Some(0) }, &mut |_, _| ()).unwrap();
    // Shared memory is taken when it is written to: fill both channels, which the child does not read.
    for step in 1..=2 {
        let fill = &mut |target: &mut [u8]| target.fill(1);
        control.send(Header::new(Kind::Order, step, 0.0, 0.0), 64 * 1024, fill).unwrap();
        link.send(Header::new(Kind::Motion, step, 0.0, 0.0), 100_000, &mut |target| target.fill(1.0))
            .unwrap();
    }
    let files = std::fs::read_dir("/dev/shm").unwrap().map(|entry| entry.unwrap());
    let files = files.filter(|file| file.file_name().to_string_lossy().starts_with(run.names.prefix()));
    let used: u64 = files.map(|file| 512 * file.metadata().unwrap().blocks()).sum();
    let [order, reply] = control_needs();
    let needed = needed_bytes(&[order, reply, data_need(100_000), data_need(8)]);
    assert!(used <= needed, "{used} bytes used, {needed} computed");
    assert!(needed < 2 * used, "{used} bytes used, {needed} computed");
    child.kill().unwrap();
    child.wait().unwrap();
    server.set_timeout(SHORT);
    transport.set_timeout(SHORT);
}
