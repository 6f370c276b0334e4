//! The transport within one process, between threads: the twin of [`crate::ipc`] for tests.
//!
//! Same checks, same errors, same flow control (two messages per direction, then the sender waits), same end (a link
//! lingers until its last message is read); plain memory and a condition variable instead of shared memory and
//! events. Deliberately absent: the process-wide stop flag, as a test process holds several runs at once.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::checks::{self, MAX_LINGER};
use crate::header::Header;
use crate::link::{Expect, Item, Link, LinkError, Transport};
use crate::names::LAUNCHER;
use crate::shm::{CONTROL_CAPACITY, POOL};

/// How long a wait may last.
#[derive(Clone, Copy)]
enum Limit {
    Timeout,
    Linger,
    None,
}

/// One run: what its threads share. Clones are the same run.
#[derive(Clone)]
pub struct Hub {
    shared: Arc<Shared>,
}

struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

struct State {
    timeout: Duration,
    aborted: bool,
    bytes: Vec<Channel<u8>>,
    values: Vec<Channel<f64>>,
}

/// One direction between two processes.
struct Channel<T> {
    from: String,
    to: String,
    has_sender: bool,
    has_receiver: bool,
    waiting: VecDeque<(Header, Vec<T>)>,
    /// Buffers of messages that were read.
    free: Vec<Vec<T>>,
    /// Messages sent and not yet given back.
    in_flight: usize,
}

/// Items the hub has channels for.
trait Carried: Item {
    fn channels(state: &mut State) -> &mut Vec<Channel<Self>>;
}

impl Carried for u8 {
    fn channels(state: &mut State) -> &mut Vec<Channel<Self>> {
        &mut state.bytes
    }
}

impl Carried for f64 {
    fn channels(state: &mut State) -> &mut Vec<Channel<Self>> {
        &mut state.values
    }
}

impl State {
    /// Number of the channel between two processes, made by whoever comes first.
    fn channel<T: Carried>(&mut self, from: &str, to: &str) -> usize {
        let channels = T::channels(self);
        let known = channels.iter().position(|channel| channel.from == from && channel.to == to);
        known.unwrap_or_else(|| {
            channels.push(Channel {
                from: from.to_owned(),
                to: to.to_owned(),
                has_sender: false,
                has_receiver: false,
                waiting: VecDeque::new(),
                free: Vec::new(),
                in_flight: 0,
            });
            channels.len() - 1
        })
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // A thread that panicked has left no half-done change: all changes are single assignments.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until `ready` finds what it waits for.
    fn wait<R>(
        &self,
        peer: &str,
        limit: Limit,
        mut ready: impl FnMut(&mut State) -> Option<R>,
    ) -> Result<R, LinkError> {
        let start = Instant::now();
        let mut state = self.lock();
        loop {
            if state.aborted {
                return Err(LinkError::Aborted);
            }
            if let Some(found) = ready(&mut state) {
                return Ok(found);
            }
            let limit = match limit {
                Limit::Timeout => state.timeout,
                Limit::Linger => state.timeout.min(MAX_LINGER),
                Limit::None => Duration::MAX,
            };
            let waited = start.elapsed();
            if waited >= limit {
                let (waited_s, limit_s) = (waited.as_secs_f64(), limit.as_secs_f64());
                return Err(LinkError::PeerSilent { peer: peer.to_owned(), waited_s, limit_s });
            }
            let slice = (limit - waited).min(Duration::from_millis(100));
            state = self.changed.wait_timeout(state, slice).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl Hub {
    /// A run whose waits end after `timeout`.
    pub fn new(timeout: Duration) -> Self {
        let state = State { timeout, aborted: false, bytes: Vec::new(), values: Vec::new() };
        Self { shared: Arc::new(Shared { state: Mutex::new(state), changed: Condvar::new() }) }
    }

    /// The channels of participant `process`; may be moved to its thread.
    pub fn transport(&self, process: &str) -> InProcessTransport {
        InProcessTransport { hub: self.clone(), process: process.to_owned() }
    }

    /// The launcher's control link to a participant. It does not wait: the first `send` or `receive` does.
    pub fn control(&self, process: &str) -> Box<dyn Link<u8>> {
        Box::new(InProcessLink::<u8>::new(self, LAUNCHER, process, CONTROL_CAPACITY))
    }

    /// Changes the time-out of all links, also of those already open.
    pub fn set_timeout(&self, timeout: Duration) {
        self.shared.lock().timeout = timeout;
        self.shared.changed.notify_all();
    }

    /// Calls the run off: every wait ends with [`LinkError::Aborted`] at once.
    pub fn abort(&self) {
        self.shared.lock().aborted = true;
        self.shared.changed.notify_all();
    }
}

/// The channels of one participant.
pub struct InProcessTransport {
    hub: Hub,
    process: String,
}

impl Transport for InProcessTransport {
    fn control(&mut self) -> Result<Box<dyn Link<u8>>, LinkError> {
        let mut link = InProcessLink::<u8>::new(&self.hub, &self.process, LAUNCHER, CONTROL_CAPACITY);
        link.receive_limit = Limit::None;
        link.attach()?;
        Ok(Box::new(link))
    }

    fn connect(&mut self, peer: &str, send_capacity: usize) -> Result<Box<dyn Link<f64>>, LinkError> {
        let mut link = InProcessLink::<f64>::new(&self.hub, &self.process, peer, send_capacity);
        link.attach()?;
        Ok(Box::new(link))
    }
}

struct InProcessLink<T: Carried> {
    hub: Hub,
    peer: String,
    capacity: usize,
    receive_limit: Limit,
    is_attached: bool,
    outgoing: usize,
    incoming: usize,
    items: std::marker::PhantomData<T>,
}

impl<T: Carried> InProcessLink<T> {
    fn new(hub: &Hub, process: &str, peer: &str, capacity: usize) -> Self {
        let mut state = hub.shared.lock();
        let (outgoing, incoming) = (state.channel::<T>(process, peer), state.channel::<T>(peer, process));
        T::channels(&mut state)[outgoing].has_sender = true;
        T::channels(&mut state)[incoming].has_receiver = true;
        drop(state);
        hub.shared.changed.notify_all();
        let (hub, peer, items) = (hub.clone(), peer.to_owned(), std::marker::PhantomData);
        let receive_limit = Limit::Timeout;
        Self { hub, peer, capacity, receive_limit, is_attached: false, outgoing, incoming, items }
    }

    fn attach(&mut self) -> Result<(), LinkError> {
        if !self.is_attached {
            self.hub.shared.wait(&self.peer, Limit::Timeout, |state| {
                let channels = T::channels(state);
                let is_there = channels[self.outgoing].has_receiver && channels[self.incoming].has_sender;
                is_there.then_some(())
            })?;
            self.is_attached = true;
        }
        Ok(())
    }

    /// Changes this link's channel and wakes whoever waits for that.
    fn change<R>(&self, channel: usize, change: impl FnOnce(&mut Channel<T>) -> R) -> R {
        let changed = change(&mut T::channels(&mut self.hub.shared.lock())[channel]);
        self.hub.shared.changed.notify_all();
        changed
    }
}

impl<T: Carried> Link<T> for InProcessLink<T> {
    fn peer(&self) -> &str {
        &self.peer
    }

    fn send(
        &mut self,
        header: Header,
        count: usize,
        fill: &mut dyn FnMut(&mut [T]),
    ) -> Result<(), LinkError> {
        if self.hub.shared.lock().aborted {
            return Err(LinkError::Aborted);
        }
        if count > self.capacity {
            return Err(LinkError::TooLarge { peer: self.peer.clone(), count, capacity: self.capacity });
        }
        self.attach()?;
        let mut items = self.hub.shared.wait(&self.peer, Limit::Timeout, |state| {
            let channel = &mut T::channels(state)[self.outgoing];
            (channel.in_flight < POOL).then(|| channel.free.pop().unwrap_or_default())
        })?;
        items.clear();
        items.resize(count, T::default());
        fill(&mut items);
        let header = checks::seal(header, &items, &self.peer)?;
        self.change(self.outgoing, |channel| {
            if !channel.has_receiver {
                return Err(LinkError::NoReceiver { peer: self.peer.clone() });
            }
            channel.in_flight += 1;
            channel.waiting.push_back((header, items));
            Ok(())
        })
    }

    fn receive(&mut self, expect: Expect, read: &mut dyn FnMut(&Header, &[T])) -> Result<(), LinkError> {
        let next = |state: &mut State| T::channels(state)[self.incoming].waiting.pop_front();
        let (header, items) = self.hub.shared.wait(&self.peer, self.receive_limit, next)?;
        let verdict = checks::verify(expect, &header, &items, &self.peer);
        if verdict.is_ok() {
            read(&header, &items);
        }
        self.change(self.incoming, |channel| {
            channel.in_flight -= 1;
            channel.free.push(items);
        });
        verdict
    }
}

impl<T: Carried> Drop for InProcessLink<T> {
    fn drop(&mut self) {
        if self.is_attached {
            // Unread after the time-out, or called off: the message is lost with the link, as between processes.
            let is_drained =
                |state: &mut State| (T::channels(state)[self.outgoing].in_flight == 0).then_some(());
            let _ = self.hub.shared.wait(&self.peer, Limit::Linger, is_drained);
        }
        self.change(self.outgoing, |channel| channel.has_sender = false);
        self.change(self.incoming, |channel| {
            channel.has_receiver = false;
            // Nobody will read them: their sender need not linger for them.
            channel.in_flight -= channel.waiting.len();
            channel.waiting.clear();
        });
    }
}
