//! Starts the participants and listens to them while it watches over their lives.

use std::cell::{Cell, RefCell};
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use protocol::control::{Order, Reply};
use protocol::failure::{Failure, FailureClass};
use protocol::ipc::IpcServer;
use protocol::link::LinkError;
use protocol::names::{ROOT_BASE, RunNames};
use protocol::sweep;

use super::child::{self, Child, ProcessSpec};
use super::control::{Control, Task};
use super::{Call, Crew};

/// Share of a wait for several answers that one process gets.
const TURN: Duration = Duration::from_millis(20);
/// After a complaint about a peer, this long a deeper cause is looked for.
const SEARCH: Duration = Duration::from_millis(300);
/// CPU time within [`SEARCH`] of a process that computes, ticks of 10 ms: few, as others may want the cores too. One
/// that waits has none.
const BUSY_TICKS: u64 = 2;
/// From the last answer to the end of a process that was told to stop.
const FAREWELL: Duration = Duration::from_secs(10);

/// What all participants of a run share.
#[derive(Debug, Clone, Copy)]
pub struct Launch<'a> {
    /// Names of the run.
    pub names: &'a RunNames,
    /// Existing folder for what the processes print.
    pub log: &'a Path,
    /// Step time-out: longest wait for one answer.
    pub timeout: Duration,
}

/// The participants as processes. Dropping them calls the run off.
pub struct Processes {
    pub(super) names: RunNames,
    pub(super) controls: Vec<Control>,
    pub(super) server: IpcServer,
    pub(super) children: Rc<RefCell<Vec<Child>>>,
    pub(super) is_over: bool,
    is_ending: Rc<Cell<bool>>,
    timeout: Duration,
}

impl Processes {
    /// Sweeps what dead runs have left, makes the channels, starts all participants and hears their first word.
    /// To be called on the main thread: the participants end with the thread that has started them.
    ///
    /// # Errors
    /// A program that cannot be started, or a participant that does not come up.
    pub fn start(launch: Launch<'_>, specs: &[ProcessSpec]) -> Result<Self, Failure> {
        sweep::sweep_abandoned(Path::new(ROOT_BASE));
        let root = launch.names.root().display();
        sweep::claim(launch.names).map_err(|error| refused(&format!("cannot make {root}: {error}")))?;
        // A handler makes SIGCHLD end the sleep of a wait, so that a death is seen at once; the flag is not read.
        signal_hook::flag::register(signal_hook::consts::SIGCHLD, Arc::new(AtomicBool::new(false)))
            .map_err(|error| refused(&format!("cannot handle SIGCHLD: {error}")))?;
        let mut processes = Self::with_channels(launch, specs).inspect_err(|_| {
            sweep::remove_run(launch.names);
        })?;
        for spec in specs {
            let child = Child::spawn(spec, launch.names, launch.log)
                .map_err(|error| refused(&format!("cannot start {}: {error}", spec.program.display())))?;
            tracing::info!(process = child.name, pid = child.pid(), "started");
            processes.children.borrow_mut().push(child);
        }
        for (name, reply) in processes.answers()? {
            if !matches!(&reply, Reply::Hello { process, .. } if *process == name) {
                let what = format!("expected the first word of {name}, found {reply:?}");
                return Err(Failure::new(FailureClass::Process, &name, "launch", what));
            }
        }
        Ok(processes)
    }

    fn with_channels(launch: Launch<'_>, specs: &[ProcessSpec]) -> Result<Self, Failure> {
        let broken = |error: LinkError| refused(&error.to_string());
        let process_names: Vec<&str> = specs.iter().map(|spec| spec.name.as_str()).collect();
        let server = IpcServer::new(launch.names, &process_names, launch.timeout).map_err(broken)?;
        let mut controls = Vec::new();
        for name in process_names {
            controls.push(Control::new(name, server.control(name).map_err(broken)?));
        }
        let children = Rc::new(RefCell::new(Vec::new()));
        let is_ending = Rc::new(Cell::new(false));
        let (watched, ending) = (children.clone(), is_ending.clone());
        server.set_watch(Box::new(move || watch(&mut watched.borrow_mut(), ending.get())));
        let (names, timeout) = (launch.names.clone(), launch.timeout);
        Ok(Self { names, controls, server, children, is_over: false, is_ending, timeout })
    }

    /// Changes the step time-out.
    pub fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
        self.server.set_timeout(timeout);
    }

    /// Process ids, by name.
    pub fn pids(&self) -> Vec<(String, u32)> {
        self.children.borrow().iter().map(|child| (child.name.clone(), child.pid())).collect()
    }

    /// Waits until all participants, told to stop, have ended, and removes the run.
    ///
    /// # Errors
    /// A process that ends with an error or not at all.
    pub fn finish(mut self) -> Result<(), Failure> {
        self.is_ending.set(true);
        let start = Instant::now();
        while start.elapsed() < FAREWELL && self.children.borrow_mut().iter_mut().any(|c| c.end().is_none()) {
            std::thread::sleep(Duration::from_millis(2));
        }
        for control in &self.controls {
            let mut children = self.children.borrow_mut();
            let child = find(&mut children, &control.process);
            match child.end() {
                Some(end) if end.success() => (),
                Some(end) => return Err(child.death(end, &control.task())),
                None => {
                    let what = format!("did not end within {} s of its last answer", FAREWELL.as_secs());
                    return Err(Failure::new(FailureClass::Process, &child.name, "stop", what));
                }
            }
        }
        self.end_run();
        Ok(())
    }

    fn control(&mut self, process: &str) -> &mut Control {
        let known = self.controls.iter_mut().find(|control| control.process == process);
        known.expect("orders go to processes that were started")
    }

    /// One attempt at an answer.
    fn hear(&mut self, process: &str) -> Result<Reply, Failure> {
        let control = self.control(process);
        let task = control.task();
        match control.answer() {
            Ok(Reply::Failed(failure)) => Err(self.root_cause(failure)),
            Ok(reply) => Ok(reply),
            Err(error) => Err(self.explain(process, &task, error)),
        }
    }

    /// The processes whose answer is outstanding.
    fn outstanding(&self) -> Vec<String> {
        let outstanding = self.controls.iter().filter(|control| control.is_outstanding());
        outstanding.map(|control| control.process.clone()).collect()
    }

    /// An answer, if it comes within a turn.
    fn hear_for_a_turn(&mut self, process: &str) -> Result<Option<Reply>, Failure> {
        self.server.set_timeout(TURN);
        let control = self.control(process);
        let (task, answer) = (control.task(), control.answer());
        self.server.set_timeout(self.timeout);
        match answer {
            Ok(Reply::Failed(failure)) => Err(self.root_cause(failure)),
            Ok(answer) => Ok(Some(answer)),
            Err(LinkError::PeerSilent { .. }) => Ok(None),
            Err(error) => Err(self.explain(process, &task, error)),
        }
    }

    /// The failure of those whose answers have been outstanding for too long.
    fn silence(&mut self, waited: Duration) -> Failure {
        let late = self.outstanding();
        let task = self.control(&late[0]).task();
        let (waited_s, limit_s) = (waited.as_secs_f64(), self.timeout.as_secs_f64());
        let silent = LinkError::PeerSilent { peer: late.join(", "), waited_s, limit_s };
        self.explain(&late[0], &task, silent)
    }

    /// The failure behind an error of the control link to `process`.
    fn explain(&mut self, process: &str, task: &Task, error: LinkError) -> Failure {
        match error {
            // Stopped by the user, the only one who calls off behind the launcher's back.
            LinkError::Aborted => {
                let failure =
                    Failure::new(FailureClass::Interrupted, process, task.phase, "interrupted by the user");
                failure.at(task.step, task.time_s)
            }
            LinkError::PeerLost { .. } | LinkError::PeerSilent { .. } | LinkError::NoReceiver { .. } => {
                let seen = task.failure(process, error);
                self.root_cause(seen)
            }
            error => task.failure(process, error),
        }
    }

    /// The first cause behind a failure that may only be its consequence: a complaint about a peer.
    fn root_cause(&mut self, seen: Failure) -> Failure {
        if seen.class != FailureClass::Process {
            return seen;
        }
        let start = Instant::now();
        let ticks: Vec<u64> = self.children.borrow().iter().map(Child::cpu_ticks).collect();
        loop {
            if let Some(cause) = self.reported().or_else(|| self.found_dead(true)) {
                return cause;
            }
            if start.elapsed() >= SEARCH {
                let found = self.found_dead(false).or_else(|| self.found_stopped());
                return found.or_else(|| self.found_busy(&ticks)).unwrap_or(seen);
            }
            std::thread::sleep(TURN);
        }
    }

    /// A failure that some participant has reported and that is none of its peers' fault.
    fn reported(&mut self) -> Option<Failure> {
        self.server.set_timeout(TURN);
        let mut outstanding = self.controls.iter_mut().filter(|control| control.is_outstanding());
        let cause = outstanding.find_map(|control| match control.answer() {
            Ok(Reply::Failed(failure)) if failure.class != FailureClass::Process => Some(failure),
            _ => None,
        });
        self.server.set_timeout(self.timeout);
        cause
    }

    /// A process that ended when it should not have; only by a signal, or in any way.
    fn found_dead(&mut self, only_by_signal: bool) -> Option<Failure> {
        let mut children = self.children.borrow_mut();
        self.controls.iter().find_map(|control| {
            let child = find(&mut children, &control.process);
            let end = child.end().filter(|end| !end.success() || !self.is_ending.get())?;
            (!only_by_signal || end.code().is_none()).then(|| child.death(end, &control.task()))
        })
    }

    fn found_stopped(&mut self) -> Option<Failure> {
        let mut children = self.children.borrow_mut();
        self.controls.iter().find_map(|control| {
            let child = find(&mut children, &control.process);
            child.is_stopped().then(|| child.stop(&control.task()))
        })
    }

    /// The process that has computed most in the search while the others slept; `before` are the CPU times at its start,
    /// ticks.
    fn found_busy(&mut self, before: &[u64]) -> Option<Failure> {
        let children = self.children.borrow();
        let spent = children.iter().zip(before).map(|(child, before)| (child, child.cpu_ticks() - before));
        let (child, ticks) = spent.max_by_key(|(_, ticks)| *ticks)?;
        let control = self.controls.iter().find(|control| control.process == child.name)?;
        (ticks >= BUSY_TICKS && control.is_outstanding()).then(|| child.overrun(&control.task()))
    }
}

impl Crew for Processes {
    fn order(&mut self, process: &str, order: &Order, call: Call) -> Result<(), Failure> {
        if *order == Order::Stop {
            self.is_ending.set(true);
        }
        let control = self.control(process);
        let sent = control.order(order, call);
        let task = control.task();
        sent.map_err(|error| self.explain(process, &task, error))
    }

    fn answer(&mut self, process: &str) -> Result<Reply, Failure> {
        self.hear(process)
    }

    fn answers(&mut self) -> Result<Vec<(String, Reply)>, Failure> {
        let names = self.outstanding();
        let mut replies: Vec<Option<Reply>> = names.iter().map(|_| None).collect();
        let start = Instant::now();
        while replies.iter().any(Option::is_none) {
            let is_late = start.elapsed() >= self.timeout;
            for (name, reply) in names.iter().zip(&mut replies).filter(|(_, reply)| reply.is_none()) {
                *reply = self.hear_for_a_turn(name)?;
            }
            if is_late && replies.iter().any(Option::is_none) {
                return Err(self.silence(start.elapsed()));
            }
        }
        Ok(names.into_iter().zip(replies.into_iter().flatten()).collect())
    }
}

/// Looks after the children in the pauses of a wait: an end before its time ends the wait.
fn watch(children: &mut [Child], is_ending: bool) -> Result<(), LinkError> {
    for child in children {
        if let Some(end) = child.end().filter(|end| !(is_ending && end.success())) {
            return Err(LinkError::PeerLost { peer: child.name.clone(), how: child::describe(end) });
        }
    }
    Ok(())
}

fn find<'a>(children: &'a mut [Child], name: &str) -> &'a mut Child {
    children.iter_mut().find(|child| child.name == name).expect("each control link belongs to a child")
}

fn refused(what: &str) -> Failure {
    Failure::new(FailureClass::Resource, "tidewall", "launch", what)
}
