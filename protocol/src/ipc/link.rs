//! One duplex connection between two processes: a channel per direction and a bell at the other end.

use std::rc::Rc;
use std::time::Duration;

use iceoryx2::port::LoanError;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::{PortFactory, ipc};
use iceoryx2::sample_mut::SampleMut;

use super::SharedItem;
use super::config::{self, ATTACHED, Channel, DATA, Receiver, Sender, broken};
use super::inbox::{Habit, Inbox, Patience, SLICE};
use crate::checks;
use crate::header::Header;
use crate::link::{Expect, Link, LinkError};
use crate::names;
use crate::shm::POOL;

/// First pause of a sender that waits for a free sample; it doubles up to [`SLICE`]. No event tells it, as a sender
/// waits only when the two sides have lost their step.
const FIRST_PAUSE: Duration = Duration::from_millis(1);

/// A link over iceoryx2. Stays on the thread that made it.
pub struct IpcLink<T: SharedItem> {
    peer: String,
    capacity: usize,
    is_patient: bool,
    is_attached: bool,
    sender: Sender<T>,
    receiver: Receiver<T>,
    bell: Notifier<ipc::Service>,
    outgoing: Channel<T>,
    incoming: Channel<T>,
    inbox: Rc<Inbox>,
    habit: Habit,
}

impl<T: SharedItem> IpcLink<T> {
    /// Makes this side's ports; the peer may come later. `capacity` is the size of the largest message sent.
    pub(super) fn new(inbox: &Rc<Inbox>, peer: &str, capacity: usize) -> Result<Self, LinkError> {
        let outgoing = config::channel::<T>(&inbox.node, &names::channel(inbox.process(), peer), peer)?;
        let incoming = config::channel::<T>(&inbox.node, &names::channel(peer, inbox.process()), peer)?;
        let receiver = config::receiver(&incoming, peer)?;
        let sender = config::sender(&outgoing, capacity, peer)?;
        let bell = inbox.bell(peer)?;
        bell.notify_with_custom_event_id(ATTACHED).map_err(|error| broken(peer, error))?;
        let (peer, inbox) = (peer.to_owned(), inbox.clone());
        let (is_patient, is_attached) = (false, false);
        Ok(Self {
            peer,
            capacity,
            is_patient,
            is_attached,
            sender,
            receiver,
            bell,
            outgoing,
            incoming,
            inbox,
            habit: Habit::new(),
        })
    }

    /// The same link, whose `receive` has no time-out of its own.
    pub(super) fn patient(mut self) -> Self {
        self.is_patient = true;
        self
    }

    /// Waits until the peer's ports are there, so that the first message finds its receiver.
    pub(super) fn attach(&mut self) -> Result<(), LinkError> {
        if self.is_attached {
            return Ok(());
        }
        let patience = Patience::new(&self.inbox, &self.peer, Some(self.inbox.timeout()));
        let is_there = || {
            let (there, back) = (self.outgoing.dynamic_config(), self.incoming.dynamic_config());
            there.number_of_subscribers() > 0 && back.number_of_publishers() > 0
        };
        while !is_there() {
            patience.pause(SLICE)?;
        }
        self.sender.update_connections().map_err(|error| broken(&self.peer, error))?;
        self.receiver.update_connections().map_err(|error| broken(&self.peer, error))?;
        self.is_attached = true;
        Ok(())
    }

    /// A free sample, once the peer has given one back.
    fn loan(&self, count: usize) -> Result<SampleMut<ipc::Service, [T], Header>, LinkError> {
        let patience = Patience::new(&self.inbox, &self.peer, Some(self.inbox.timeout()));
        let mut pause = FIRST_PAUSE;
        loop {
            match self.sender.loan_slice(count) {
                Ok(sample) => return Ok(sample),
                Err(LoanError::OutOfMemory) => patience.pause(pause)?,
                Err(error) => return Err(broken(&self.peer, error)),
            }
            pause = (2 * pause).min(SLICE);
        }
    }

    /// Whether the peer has read everything, so that all samples are back, or reads no more.
    fn is_drained(&self) -> bool {
        if self.outgoing.dynamic_config().number_of_subscribers() == 0 {
            return true;
        }
        let loans: Vec<_> = (0..POOL).map_while(|_| self.sender.loan_slice_uninit(1).ok()).collect();
        loans.len() == POOL
    }
}

impl<T: SharedItem> Link<T> for IpcLink<T> {
    fn peer(&self) -> &str {
        &self.peer
    }

    fn send(
        &mut self,
        header: Header,
        count: usize,
        fill: &mut dyn FnMut(&mut [T]),
    ) -> Result<(), LinkError> {
        self.leave(header, count, fill)?;
        self.bell.notify_with_custom_event_id(DATA).map_err(|error| broken(&self.peer, error))?;
        Ok(())
    }

    fn leave(
        &mut self,
        header: Header,
        count: usize,
        fill: &mut dyn FnMut(&mut [T]),
    ) -> Result<(), LinkError> {
        self.inbox.check()?;
        if count > self.capacity {
            return Err(LinkError::TooLarge { peer: self.peer.clone(), count, capacity: self.capacity });
        }
        self.attach()?;
        let mut sample = self.loan(count)?;
        fill(sample.payload_mut());
        *sample.user_header_mut() = checks::seal(header, sample.payload(), &self.peer)?;
        match sample.send() {
            Ok(0) => Err(LinkError::NoReceiver { peer: self.peer.clone() }),
            Ok(_) => Ok(()),
            Err(error) => Err(broken(&self.peer, error)),
        }
    }

    fn receive(&mut self, expect: Expect, read: &mut dyn FnMut(&Header, &[T])) -> Result<(), LinkError> {
        let limit = if self.is_patient { None } else { Some(self.inbox.timeout()) };
        let patience = Patience::new(&self.inbox, &self.peer, limit).with_habit(&self.habit);
        let sample = loop {
            // What has already arrived is looked at first, also when the run is being called off: it may say why.
            match self.receiver.receive() {
                Ok(Some(sample)) => break sample,
                Ok(None) => {
                    self.inbox.check()?;
                    patience.pause(SLICE)?;
                }
                Err(error) => return Err(broken(&self.peer, error)),
            }
        };
        patience.end(&self.habit);
        checks::verify(expect, sample.user_header(), sample.payload(), &self.peer)?;
        read(sample.user_header(), sample.payload());
        Ok(())
    }
}

impl<T: SharedItem> Drop for IpcLink<T> {
    /// Lingers until the peer has read the last message, which would be lost with the ports: the FIN of this
    /// transport is the last sample given back. A run that is called off does not wait.
    fn drop(&mut self) {
        let limit = self.inbox.timeout().min(checks::MAX_LINGER);
        let patience = Patience::new(&self.inbox, &self.peer, Some(limit));
        let mut pause = FIRST_PAUSE;
        while self.is_attached && !self.is_drained() && patience.pause(pause).is_ok() {
            pause = (2 * pause).min(SLICE);
        }
    }
}
