//! Where a process waits: its event service, the ways a wait can end, and the rule that no wait is endless.

use std::cell::{Cell, RefCell};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use iceoryx2::node::Node;
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::ipc;

use super::config::{self, ABORT, Events, KNOCK, broken};
use super::stop_flag;
use crate::link::LinkError;
use crate::names::{self, RunNames};

/// Longest uninterrupted sleep of a waiting process.
pub(super) const SLICE: Duration = Duration::from_millis(100);

/// A wait that was at most this part of the time since the one before, the last time, is spent awake, giving way to whoever
/// has work: putting a core to sleep and waking it again would take a good part of it, above all on a virtual machine
/// (`docs/performance.md`, "Orders and channels"). Who waits for most of the time, as all do for the water, sleeps
/// from the start and takes no turns with the water's threads; the water knocks shortly before it is done.
const SMALL_PART: u32 = 3;

/// Longer waits are slept through in any case.
const LONG: Duration = Duration::from_millis(5);

/// Awake beyond twice the last wait.
const GRACE: Duration = Duration::from_micros(100);

/// Awake after a knock.
const KNOCKED: Duration = Duration::from_millis(1);

/// Shortest sleep: a time-out of zero would mean an endless one to the socket below.
const SHORTEST: Duration = Duration::from_millis(1);

/// Looks after the other processes between two slices of a wait.
pub(super) type Watch = dyn FnMut() -> Result<(), LinkError>;

/// One per process and run; shared by its links, which live on one thread.
pub(super) struct Inbox {
    process: String,
    pub(super) node: Node<ipc::Service>,
    listener: Listener<ipc::Service>,
    _events: Events,
    timeout: Cell<Duration>,
    aborted: Cell<bool>,
    knocked: Cell<bool>,
    watch: RefCell<Option<Box<Watch>>>,
}

impl Inbox {
    pub(super) fn new(names: &RunNames, process: &str, timeout: Duration) -> Result<Self, LinkError> {
        let node = config::node(names, process)?;
        let events = config::events(&node, &names::inbox(process), process)?;
        let listener = events.listener_builder().create().map_err(|error| broken(process, error))?;
        let (process, timeout) = (process.to_owned(), Cell::new(timeout));
        let (aborted, knocked, watch) = (Cell::new(false), Cell::new(false), RefCell::new(None));
        Ok(Self { process, node, listener, _events: events, timeout, aborted, knocked, watch })
    }

    pub(super) fn process(&self) -> &str {
        &self.process
    }

    pub(super) fn set_timeout(&self, timeout: Duration) {
        self.timeout.set(timeout);
    }

    pub(super) fn timeout(&self) -> Duration {
        self.timeout.get()
    }

    pub(super) fn set_watch(&self, watch: Box<Watch>) {
        *self.watch.borrow_mut() = Some(watch);
    }

    /// The means to wake another process.
    pub(super) fn bell(&self, process: &str) -> Result<Notifier<ipc::Service>, LinkError> {
        let events = config::events(&self.node, &names::inbox(process), process)?;
        events.notifier_builder().create().map_err(|error| broken(process, error))
    }

    /// The means to wake another process, if it takes part: the launcher makes the inboxes of all who do.
    pub(super) fn bell_if_there(&self, process: &str) -> Option<Notifier<ipc::Service>> {
        let events = config::open_events(&self.node, &names::inbox(process))?;
        events.notifier_builder().create().ok()
    }

    /// Calls the run off for this process.
    pub(super) fn abort(&self) {
        self.aborted.set(true);
    }

    /// Whether the run goes on.
    pub(super) fn check(&self) -> Result<(), LinkError> {
        let called_off = self.aborted.get() || stop_flag().load(Ordering::Relaxed);
        if called_off { Err(LinkError::Aborted) } else { Ok(()) }
    }

    /// Sleeps until an event or the end of the slice; `Ok(true)` after an event.
    fn sleep(&self, slice: Duration) -> Result<bool, LinkError> {
        let slept = self.listener.timed_wait(
            |event| match event.id {
                ABORT => self.aborted.set(true),
                KNOCK => self.knocked.set(true),
                _ => (),
            },
            slice,
        );
        match slept {
            Ok(events) => Ok(events > 0),
            // A signal ends the slice; what it meant is in the stop flag or seen by the watch.
            Err(iceoryx2::port::listener::ListenerWaitError::InterruptSignal) => Ok(false),
            Err(error) => Err(broken(&self.process, error)),
        }
    }
}

/// How the last wait for one thing went: whether the next one is worth staying awake for.
#[derive(Debug)]
pub(super) struct Habit {
    end: Cell<Instant>,
    wait: Cell<Duration>,
    cycle: Cell<Duration>,
}

impl Habit {
    pub(super) fn new() -> Self {
        let none = || Cell::new(Duration::ZERO);
        Self { end: Cell::new(Instant::now()), wait: none(), cycle: none() }
    }

    /// How long to stay awake in the next wait.
    fn awake(&self) -> Duration {
        let wait = self.wait.get();
        let is_short = wait <= LONG && SMALL_PART * wait <= self.cycle.get();
        if is_short { 2 * wait + GRACE } else { Duration::ZERO }
    }

    fn book(&self, wait: Duration) {
        self.wait.set(wait);
        self.cycle.set(self.end.replace(Instant::now()).elapsed());
    }
}

/// One wait for one peer.
pub(super) struct Patience<'a> {
    inbox: &'a Inbox,
    peer: &'a str,
    limit: Option<Duration>,
    start: Instant,
    awake_until: Cell<Instant>,
}

impl<'a> Patience<'a> {
    /// A wait that ends after `limit`, or never by itself.
    pub(super) fn new(inbox: &'a Inbox, peer: &'a str, limit: Option<Duration>) -> Self {
        let start = Instant::now();
        Self { inbox, peer, limit, start, awake_until: Cell::new(start) }
    }

    /// The same, awake at first if such waits are short.
    pub(super) fn with_habit(self, habit: &Habit) -> Self {
        self.awake_until.set(self.start + habit.awake());
        self
    }

    /// Tells the habit how long this wait took.
    pub(super) fn end(self, habit: &Habit) {
        habit.book(self.start.elapsed());
    }

    /// Sleeps until something happens, at most for `slice`; at the start of a short wait and after a knock only gives way.
    ///
    /// # Errors
    /// [`LinkError::Aborted`], [`LinkError::PeerSilent`] past the limit, or what the watch has seen.
    pub(super) fn pause(&self, slice: Duration) -> Result<(), LinkError> {
        self.inbox.check()?;
        if Instant::now() < self.awake_until.get() {
            std::thread::yield_now();
            return Ok(());
        }
        let left = self.limit.map_or(SLICE, |limit| limit.saturating_sub(self.start.elapsed()));
        let woken = self.inbox.sleep(slice.min(SLICE).min(left).max(SHORTEST))?;
        self.inbox.check()?;
        if self.inbox.knocked.take() {
            self.awake_until.set(Instant::now() + KNOCKED);
        }
        if woken {
            return Ok(());
        }
        if let Some(watch) = self.inbox.watch.borrow_mut().as_mut() {
            watch()?;
        }
        match self.limit {
            Some(limit) if self.start.elapsed() >= limit => Err(LinkError::PeerSilent {
                peer: self.peer.to_owned(),
                waited_s: self.start.elapsed().as_secs_f64(),
                limit_s: limit.as_secs_f64(),
            }),
            _ => Ok(()),
        }
    }
}
