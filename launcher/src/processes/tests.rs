//! Supervision, with this test program as the participants: what each does at its second step is in its
//! environment.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use protocol::control::{Account, Order, Part, Ready, Reply, Start, StepReport, StepTime};
use protocol::failure::{Failure, FailureClass};
use protocol::ipc::{IpcTransport, guard};
use protocol::link::Transport;
use protocol::names::{RunId, RunNames};
use protocol::participant::{Participant, serve};
use rustix::process::{Pid, Signal, kill_process};

use super::{Call, Crew, Duty, Interrupt, Launch, ProcessSpec, Processes, Threads};

const LONG: Duration = Duration::from_secs(60);
const CONDUCT: &str = "TIDEWALL_TEST_CONDUCT";

/// Does as its conduct says at step 2, and nothing otherwise.
struct Actor {
    conduct: String,
}

impl Participant for Actor {
    fn start(&mut self, _: &Start, _: &mut dyn Transport) -> Result<Ready, Failure> {
        Ok(Ready { admitted_dt: 0.5, ..Ready::default() })
    }

    fn part(&mut self, _: Part, at: StepTime) -> Result<StepReport, Failure> {
        let own = Pid::from_raw(std::process::id().cast_signed()).unwrap();
        let failure = |class, what| Failure::new(class, "itself", "advance", what).at(at.step, at.time);
        match self.conduct.as_str() {
            _ if at.step != 2 => (),
            "well" => (),
            "is killed" => kill_process(own, Signal::KILL).unwrap(),
            "is stopped" => {
                kill_process(own, Signal::STOP).unwrap();
                // The stop may take effect a moment later.
                std::thread::sleep(LONG);
            }
            "hangs" => std::thread::sleep(LONG),
            "computes" => {
                let start = Instant::now();
                while start.elapsed() < LONG {
                    std::hint::black_box(start);
                }
            }
            "exits" => {
                eprintln!("cannot go on\n");
                std::process::exit(9);
            }
            "fails" => return Err(failure(FailureClass::Numerical, "no convergence")),
            "complains" => return Err(failure(FailureClass::Process, "solid-fem has been silent")),
            other => panic!("no conduct {other}"),
        }
        Ok(StepReport::default())
    }

    fn output(&mut self, _: u32, _: StepTime) -> Result<(), Failure> {
        Ok(())
    }

    fn account(&self) -> Account {
        Account::default()
    }
}

/// No test by itself: the participant of all others.
#[test]
fn the_other_process() {
    let Ok(conduct) = std::env::var(CONDUCT) else { return };
    if conduct == "is interrupted" {
        return be_interrupted();
    }
    let arguments: Vec<String> = std::env::args().collect();
    let after = |flag| &arguments[1 + arguments.iter().position(|word| word == flag).unwrap()];
    let names = RunNames::new(after("--prefix"), Path::new(after("--root"))).unwrap();
    let name = std::env::var("TIDEWALL_TEST_NAME").unwrap();
    let conduct = match conduct.strip_prefix("hangs, killed after ms ") {
        Some(delay) => {
            die_after(Duration::from_millis(delay.parse().unwrap()));
            "hangs".to_owned()
        }
        None => conduct,
    };
    let member = guard::guard(&names).unwrap();
    let mut transport = IpcTransport::new(&names, &name, LONG).unwrap();
    let served = serve(&name, &mut Actor { conduct }, &mut transport);
    drop(transport);
    drop(member);
    if let Err(failure) = served {
        std::process::exit(i32::from(failure.class.exit_code()));
    }
}

fn die_after(delay: Duration) {
    std::thread::spawn(move || {
        std::thread::sleep(delay);
        kill_process(Pid::from_raw(std::process::id().cast_signed()).unwrap(), Signal::KILL).unwrap();
    });
}

/// Says how often it was interrupted.
fn be_interrupted() {
    let interrupt = Interrupt::install().unwrap();
    println!("\nready");
    while !interrupt.is_requested() {
        std::thread::sleep(Duration::from_millis(1));
    }
    println!("urgent: {}", interrupt.is_urgent());
    while !interrupt.is_urgent() {
        std::thread::sleep(Duration::from_millis(1));
    }
    println!("now urgent");
    std::thread::sleep(LONG);
}

/// A run of two actors; nothing is left of it.
struct Stage {
    names: RunNames,
    log: tempfile::TempDir,
}

impl Stage {
    fn new() -> Self {
        Self { names: RunNames::of(RunId::random().unwrap()), log: tempfile::tempdir().unwrap() }
    }

    fn start(&self, fluid: &str, solid: &str, timeout: Duration) -> Result<Processes, Failure> {
        let spec = |name: &str, conduct: &str| ProcessSpec {
            name: name.to_owned(),
            program: std::env::current_exe().unwrap(),
            arguments: ["--exact", "processes::tests::the_other_process", "--nocapture", "--"]
                .map(Into::into)
                .to_vec(),
            environment: vec![(CONDUCT.into(), conduct.into()), ("TIDEWALL_TEST_NAME".into(), name.into())],
        };
        let launch = Launch { names: &self.names, log: self.log.path(), timeout };
        Processes::start(launch, &[spec("fluid-isph", fluid), spec("solid-fem", solid)])
    }

    /// The failure of a run, the end of the run, and the time from one to the other.
    fn failure(&self, fluid: &str, solid: &str, timeout: Duration) -> (Failure, Duration) {
        let mut processes = self.start(fluid, solid, timeout).unwrap();
        let pids = processes.pids();
        let failure = play(&mut processes).unwrap_err();
        let start = Instant::now();
        drop(processes);
        let after = start.elapsed();
        for (name, pid) in pids {
            assert!(!Path::new(&format!("/proc/{pid}")).exists(), "{name} is left");
        }
        (failure, after)
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        assert!(!self.names.root().exists());
        let files = std::fs::read_dir("/dev/shm").unwrap().map(|entry| entry.unwrap().path());
        let is_left =
            |path: &PathBuf| path.file_name().unwrap().to_string_lossy().starts_with(self.names.prefix());
        assert_eq!(files.filter(is_left).collect::<Vec<_>>(), Vec::<PathBuf>::new());
    }
}

fn advance(at: StepTime) -> Order {
    Order::Step { at, parts: vec![Part::Advance] }
}

/// Three steps of a crew of two.
fn play(crew: &mut dyn Crew) -> Result<(), Failure> {
    for process in ["fluid-isph", "solid-fem"] {
        crew.order(process, &Order::Start(Start::default()), Call::Now)?;
    }
    let ready = crew.answers()?;
    assert!(ready.iter().all(|(_, reply)| matches!(reply, Reply::Ready(ready) if ready.admitted_dt == 0.5)));
    assert_eq!(ready.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["fluid-isph", "solid-fem"]);
    for step in 1..=3 {
        let at = StepTime { step, time: 0.1 * step as f64, dt: 0.1 };
        for process in ["solid-fem", "fluid-isph"] {
            assert!(matches!(crew.ask(process, &advance(at))?, Reply::Done(_)));
        }
    }
    for process in ["fluid-isph", "solid-fem"] {
        assert!(matches!(crew.ask(process, &Order::Stop)?, Reply::Account(_)));
    }
    Ok(())
}

#[test]
fn a_run_in_order_ends_without_a_trace() {
    let stage = Stage::new();
    let mut processes = stage.start("well", "well", LONG).unwrap();
    play(&mut processes).unwrap();
    processes.finish().unwrap();
}

#[test]
fn a_killed_process_is_named_with_signal_and_step_within_a_second() {
    let stage = Stage::new();
    let (failure, _) = stage.failure("is killed", "well", LONG);
    assert_eq!(
        (failure.class, failure.process.as_str(), failure.step),
        (FailureClass::Process, "fluid-isph", 2)
    );
    assert_eq!(
        (failure.phase.as_str(), failure.what.as_str()),
        ("advance", "was killed by signal 9 (SIGKILL)")
    );
}

#[test]
fn a_kill_at_any_instant_is_named_and_leaves_nothing() {
    for delay in (0..15).chain([20, 30, 50]) {
        let stage = Stage::new();
        let fluid = format!("hangs, killed after ms {delay}");
        let run = || play(&mut stage.start(&fluid, "well", LONG)?);
        let failure = run().unwrap_err();
        let found = (failure.process.as_str(), failure.what.as_str());
        assert_eq!(found, ("fluid-isph", "was killed by signal 9 (SIGKILL)"), "after {delay} ms");
    }
}

#[test]
fn a_process_that_dies_unasked_ends_the_wait_for_another() {
    let stage = Stage::new();
    let mut processes = stage.start("hangs", "well", LONG).unwrap();
    let solid = processes.pids()[1].1.cast_signed();
    let at = StepTime { step: 2, time: 0.2, dt: 0.1 };
    processes.order("fluid-isph", &advance(at), Call::Now).unwrap();
    kill_process(Pid::from_raw(solid).unwrap(), Signal::KILL).unwrap();
    let killed = Instant::now();
    let failure = processes.answer("fluid-isph").unwrap_err();
    assert!(killed.elapsed() < Duration::from_secs(1), "{:?}", killed.elapsed());
    assert_eq!((failure.process.as_str(), failure.class), ("solid-fem", FailureClass::Process));
    // The hanging fluid ignores the abort and ends by signal.
    let called_off = Instant::now();
    drop(processes);
    assert!(called_off.elapsed() < Duration::from_secs(3), "{:?}", called_off.elapsed());
}

#[test]
fn a_process_that_exits_is_named_with_its_code_and_last_words() {
    let stage = Stage::new();
    let (failure, _) = stage.failure("exits", "well", LONG);
    assert_eq!((failure.process.as_str(), failure.what.as_str()), ("fluid-isph", "ended with exit code 9"));
    assert!(failure.hint.ends_with("cannot go on"), "{}", failure.hint);
}

#[test]
fn a_stopped_process_is_found_by_the_time_out_and_named() {
    let stage = Stage::new();
    let (failure, after) = stage.failure("is stopped", "well", Duration::from_secs(2));
    assert_eq!((failure.class.exit_code(), failure.process.as_str(), failure.step), (4, "fluid-isph", 2));
    assert!(failure.what.starts_with("was stopped from outside"), "{failure}");
    assert!(after < Duration::from_secs(3), "{after:?}");
}

#[test]
fn a_hanging_process_is_found_by_the_time_out_and_named() {
    let stage = Stage::new();
    let (failure, _) = stage.failure("well", "hangs", Duration::from_secs(2));
    assert_eq!((failure.class.exit_code(), failure.process.as_str(), failure.step), (4, "solid-fem", 2));
    assert!(failure.what.contains("no word from solid-fem"), "{failure}");
}

#[test]
fn of_several_without_an_answer_the_one_that_computes_is_named() {
    let stage = Stage::new();
    let mut processes = stage.start("hangs", "computes", Duration::from_secs(1)).unwrap();
    let at = StepTime { step: 2, time: 0.2, dt: 0.1 };
    processes.order("fluid-isph", &advance(at), Call::Now).unwrap();
    processes.order("solid-fem", &advance(at), Call::Now).unwrap();
    let failure = processes.answers().unwrap_err();
    assert_eq!((failure.class.exit_code(), failure.process.as_str(), failure.step), (4, "solid-fem", 2));
    assert!(failure.what.contains("is still computing"), "{failure}");
}

#[test]
fn a_failure_keeps_its_own_words() {
    let stage = Stage::new();
    let (failure, _) = stage.failure("fails", "well", LONG);
    assert_eq!((failure.class.exit_code(), failure.process.as_str(), failure.step), (3, "fluid-isph", 2));
    assert_eq!(failure.what, "no convergence");
}

#[test]
fn a_survivors_complaint_is_not_the_cause() {
    let stage = Stage::new();
    let mut processes = stage.start("complains", "is killed", LONG).unwrap();
    let at = StepTime { step: 2, time: 0.2, dt: 0.1 };
    processes.order("fluid-isph", &advance(at), Call::Now).unwrap();
    processes.order("solid-fem", &advance(at), Call::Now).unwrap();
    let failure = processes.answer("fluid-isph").unwrap_err();
    assert_eq!(
        (failure.process.as_str(), failure.what.as_str()),
        ("solid-fem", "was killed by signal 9 (SIGKILL)")
    );
}

#[test]
fn the_one_that_fails_ends_the_wait_for_all() {
    let stage = Stage::new();
    let mut processes = stage.start("hangs", "fails", LONG).unwrap();
    let at = StepTime { step: 2, time: 0.2, dt: 0.1 };
    processes.order("fluid-isph", &advance(at), Call::Now).unwrap();
    processes.order("solid-fem", &advance(at), Call::Now).unwrap();
    let start = Instant::now();
    let failure = processes.answers().unwrap_err();
    assert_eq!((failure.process.as_str(), failure.class), ("solid-fem", FailureClass::Numerical));
    assert!(start.elapsed() < Duration::from_secs(1), "{:?}", start.elapsed());
}

#[test]
fn a_program_that_does_not_exist_is_named() {
    let stage = Stage::new();
    let launch = Launch { names: &stage.names, log: stage.log.path(), timeout: LONG };
    let program = PathBuf::from("/nowhere/fluid-isph");
    let spec = ProcessSpec { name: "fluid-isph".into(), program, arguments: vec![], environment: vec![] };
    let failure = Processes::start(launch, &[spec]).map(|_| ()).unwrap_err();
    assert_eq!(failure.class, FailureClass::Resource);
    assert!(failure.what.contains("/nowhere/fluid-isph"), "{failure}");
}

#[test]
fn a_program_that_is_no_participant_is_named() {
    let stage = Stage::new();
    let launch = Launch { names: &stage.names, log: stage.log.path(), timeout: LONG };
    let spec = ProcessSpec {
        name: "fluid-isph".into(),
        program: "/bin/true".into(),
        arguments: vec![],
        environment: vec![],
    };
    let failure = Processes::start(launch, &[spec]).map(|_| ()).unwrap_err();
    assert_eq!(
        failure.to_string(),
        "fluid-isph failed in launch at step 0 (t = 0.000000 s): ended before it was told to"
    );
}

#[test]
fn the_first_interrupt_asks_the_second_hurries_the_third_ends() {
    let mut command = std::process::Command::new(std::env::current_exe().unwrap());
    command
        .args(["--exact", "processes::tests::the_other_process", "--nocapture"])
        .env(CONDUCT, "is interrupted");
    let mut child = command.stdout(std::process::Stdio::piped()).spawn().unwrap();
    let pid = Pid::from_raw(child.id().cast_signed()).unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines().map(Result::unwrap);
    for (signal, said) in
        [(Signal::INT, "ready"), (Signal::TERM, "urgent: false"), (Signal::INT, "now urgent")]
    {
        assert!(lines.any(|line| line == said), "{said}");
        kill_process(pid, signal).unwrap();
    }
    assert_eq!(child.wait().unwrap().code(), Some(130));
}

#[test]
fn threads_obey_like_processes() {
    let duty = |name: &'static str, conduct: &'static str| -> (String, Duty) {
        let serve =
            move |mut transport| serve(name, &mut Actor { conduct: conduct.to_owned() }, &mut transport);
        (name.to_owned(), Box::new(serve))
    };
    let mut threads =
        Threads::start(LONG, vec![duty("fluid-isph", "well"), duty("solid-fem", "well")]).unwrap();
    play(&mut threads).unwrap();
    threads.finish().unwrap();

    let mut threads =
        Threads::start(LONG, vec![duty("fluid-isph", "fails"), duty("solid-fem", "well")]).unwrap();
    let failure = play(&mut threads).unwrap_err();
    assert_eq!((failure.process.as_str(), failure.step), ("fluid-isph", 2));
}
