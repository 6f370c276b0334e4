//! A participant never outlives its launcher: this program plays a launcher and its participant, and kills the
//! launcher.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use protocol::ipc::{IpcServer, IpcTransport, guard, stop_flag};
use protocol::link::{LinkError, Transport};
use protocol::names::{RunId, RunNames};
use protocol::sweep;
use rustix::process::{Pid, Signal, kill_process};

const LONG: Duration = Duration::from_secs(60);

fn again(role: &str, names: &RunNames) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "the_other_process", "--nocapture", "--test-threads=1"]);
    command.env("TIDEWALL_TEST_ROLE", role).env("TIDEWALL_TEST_PREFIX", names.prefix());
    command.env("TIDEWALL_TEST_ROOT", names.root());
    command
}

/// No test by itself: launcher or participant of the tests below.
#[test]
fn the_other_process() {
    let Ok(role) = std::env::var("TIDEWALL_TEST_ROLE") else { return };
    let variable = |name| std::env::var(name).unwrap();
    let root = variable("TIDEWALL_TEST_ROOT");
    let names = RunNames::new(&variable("TIDEWALL_TEST_PREFIX"), Path::new(&root)).unwrap();
    match role.strip_prefix("launch ") {
        Some(participant) => launch(participant, &names),
        None => participate(&role, &names),
    }
}

/// Starts the participant from the main thread's point of view: the test's thread lives as long as the process.
fn launch(participant: &str, names: &RunNames) {
    sweep::claim(names).unwrap();
    let server = IpcServer::new(names, &["fluid"], LONG).unwrap();
    let mut control = server.control("fluid").unwrap();
    let mut child = again(participant, names).spawn().unwrap();
    let hello = protocol::link::Expect { kind: protocol::header::Kind::Reply, step: 0, count: None };
    control.receive(hello, &mut |_, _| ()).unwrap();
    println!("\nparticipant {}", child.id());
    child.wait().unwrap();
}

fn participate(role: &str, names: &RunNames) {
    let member = guard::guard(names).unwrap();
    let mut transport = IpcTransport::new(names, "fluid", LONG).unwrap();
    let mut control = transport.control().unwrap();
    let hello = protocol::header::Header::new(protocol::header::Kind::Reply, 0, 0.0, 0.0);
    control.send(hello, 0, &mut |_| ()).unwrap();
    if role == "compute" {
        let start = Instant::now();
        while start.elapsed() < LONG {
            std::hint::spin_loop();
        }
    }
    let order = protocol::link::Expect { kind: protocol::header::Kind::Order, step: 1, count: None };
    let lost = control.receive(order, &mut |_, _| ()).unwrap_err();
    assert!(matches!(lost, LinkError::Aborted | LinkError::PeerLost { .. }), "{lost}");
    drop(control);
    drop(transport);
    drop(member);
}

fn is_running(pid: i32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    stat.rsplit(')').next().is_some_and(|rest| !rest.is_empty() && !rest.trim_start().starts_with(['Z', 'X']))
}

fn shared_files(names: &RunNames) -> Vec<PathBuf> {
    let files = std::fs::read_dir("/dev/shm").unwrap().map(|entry| entry.unwrap().path());
    files.filter(|path| path.file_name().unwrap().to_string_lossy().starts_with(names.prefix())).collect()
}

/// Kills the launcher of a run whose participant does `what`; the participant ends and removes the run.
fn participant_ends(what: &str, within: Duration) {
    let names = RunNames::of(RunId::random().unwrap());
    let mut launcher = again(&format!("launch {what}"), &names).stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(launcher.stdout.take().unwrap()).lines().map(Result::unwrap);
    let pid = lines.find_map(|line| line.strip_prefix("participant ")?.parse::<i32>().ok()).unwrap();
    assert!(is_running(pid));
    launcher.kill().unwrap();
    launcher.wait().unwrap();
    let killed = Instant::now();
    while is_running(pid) && killed.elapsed() < LONG {
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(killed.elapsed() < within, "{:?}", killed.elapsed());
    assert!(!names.root().exists());
    assert_eq!(shared_files(&names), Vec::<PathBuf>::new());
}

#[test]
fn a_waiting_participant_ends_with_its_launcher_and_removes_the_run() {
    participant_ends("wait", Duration::from_secs(1));
}

#[test]
fn a_computing_participant_ends_within_two_seconds_of_its_launcher_and_removes_the_run() {
    participant_ends("compute", Duration::from_secs(2));
}

#[test]
fn a_participant_without_launcher_does_not_start() {
    let names = RunNames::of(RunId::random().unwrap());
    let error = guard::guard(&names).unwrap_err();
    assert!(matches!(error, guard::GuardError::NoLauncher(_)), "{error}");
}

#[test]
fn sigint_is_the_launchers() {
    // The guard is set although there is no launcher; the signal would end this process otherwise.
    let names = RunNames::of(RunId::random().unwrap());
    guard::guard(&names).unwrap_err();
    kill_process(Pid::from_raw(std::process::id().cast_signed()).unwrap(), Signal::INT).unwrap();
    assert!(!stop_flag().load(std::sync::atomic::Ordering::Relaxed));
}
