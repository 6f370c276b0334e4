//! A participant's side of the channels.

use std::rc::Rc;
use std::time::Duration;

use super::config::KNOCK;
use super::inbox::Inbox;
use super::link::IpcLink;
use crate::link::{Knock, Link, LinkError, Transport};
use crate::names::{LAUNCHER, RunNames};
use crate::shm::CONTROL_CAPACITY;

/// The channels of one participant. Everything it gives stays on the thread that made it.
pub struct IpcTransport {
    inbox: Rc<Inbox>,
}

impl IpcTransport {
    /// Joins the run as `process`. `timeout` bounds every wait for another participant; the wait for the next order
    /// is bounded by the life of the parent process instead, since an idle participant may wait for several others.
    ///
    /// # Errors
    /// [`LinkError::Transport`] when the root folder or shared memory cannot be used, or the name is taken.
    pub fn new(names: &RunNames, process: &str, timeout: Duration) -> Result<Self, LinkError> {
        let inbox = Inbox::new(names, process, timeout)?;
        let parent = rustix::process::getppid();
        inbox.set_watch(Box::new(move || {
            if rustix::process::getppid() == parent {
                return Ok(());
            }
            Err(LinkError::PeerLost { peer: LAUNCHER.to_owned(), how: "is gone".to_owned() })
        }));
        Ok(Self { inbox: Rc::new(inbox) })
    }

    /// Changes the time-out of all links, also of those already open.
    pub fn set_timeout(&self, timeout: Duration) {
        self.inbox.set_timeout(timeout);
    }
}

impl Transport for IpcTransport {
    fn control(&mut self) -> Result<Box<dyn Link<u8>>, LinkError> {
        let mut link = IpcLink::<u8>::new(&self.inbox, LAUNCHER, CONTROL_CAPACITY)?.patient();
        link.attach()?;
        Ok(Box::new(link))
    }

    fn connect(&mut self, peer: &str, send_capacity: usize) -> Result<Box<dyn Link<f64>>, LinkError> {
        let mut link = IpcLink::<f64>::new(&self.inbox, peer, send_capacity)?;
        link.attach()?;
        Ok(Box::new(link))
    }

    fn knock(&mut self, process: &str) -> Option<Knock> {
        let bell = self.inbox.bell_if_there(process)?;
        Some(Box::new(move || {
            // One that is not heard costs nothing but time.
            let _ = bell.notify_with_custom_event_id(KNOCK);
        }))
    }
}
