//! The launcher's side of the channels: one control link per participant, and the means to call the run off.

use std::rc::Rc;
use std::time::Duration;

use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::ipc;

use super::config::ABORT;
use super::inbox::Inbox;
use super::link::IpcLink;
use crate::link::{Link, LinkError};
use crate::names::{LAUNCHER, RunNames};
use crate::shm::CONTROL_CAPACITY;

/// The launcher in the run's name space. Made before the participants start; stays on its thread.
pub struct IpcServer {
    bells: Vec<Notifier<ipc::Service>>,
    inbox: Rc<Inbox>,
}

impl IpcServer {
    /// Makes the inboxes of all `processes`; `timeout` is the step time-out.
    ///
    /// # Errors
    /// [`LinkError::Transport`] when the root folder or shared memory cannot be used.
    pub fn new(names: &RunNames, processes: &[&str], timeout: Duration) -> Result<Self, LinkError> {
        let inbox = Inbox::new(names, LAUNCHER, timeout)?;
        let bells = processes.iter().map(|process| inbox.bell(process)).collect::<Result<_, _>>()?;
        Ok(Self { bells, inbox: Rc::new(inbox) })
    }

    /// Makes the control link to a participant. It does not wait: the first `send` or `receive` does.
    ///
    /// # Errors
    /// [`LinkError::Transport`].
    pub fn control(&self, process: &str) -> Result<Box<dyn Link<u8>>, LinkError> {
        Ok(Box::new(IpcLink::<u8>::new(&self.inbox, process, CONTROL_CAPACITY)?))
    }

    /// Changes the time-out of all links, also of those already open.
    pub fn set_timeout(&self, timeout: Duration) {
        self.inbox.set_timeout(timeout);
    }

    /// `watch` runs at least every 100 ms while the launcher waits on a link, and at once after a signal such as
    /// SIGCHLD if that has a handler; an error of its ends the wait.
    pub fn set_watch(&self, watch: Box<dyn FnMut() -> Result<(), LinkError>>) {
        self.inbox.set_watch(watch);
    }

    /// Calls the run off: every wait of every participant ends with [`LinkError::Aborted`] at once, and so does
    /// every further wait of the launcher.
    pub fn abort(&self) {
        self.inbox.abort();
        for bell in &self.bells {
            // Fails only for a participant that is gone, which needs no waking.
            let _ = bell.notify_with_custom_event_id(ABORT);
        }
    }
}
