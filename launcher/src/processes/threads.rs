//! The participants as threads of this process, over the in-process transport: for tests of the time loop.

use std::thread::JoinHandle;
use std::time::Duration;

use protocol::control::{Order, Reply};
use protocol::failure::Failure;
use protocol::inprocess::{Hub, InProcessTransport};

use super::control::Control;
use super::{Call, Crew};

/// What a participant's thread does, usually [`protocol::participant::serve`].
pub type Duty = Box<dyn FnOnce(InProcessTransport) -> Result<(), Failure> + Send>;

/// The participants as threads. Dropping them calls the run off.
pub struct Threads {
    hub: Hub,
    controls: Vec<Control>,
    threads: Vec<JoinHandle<Result<(), Failure>>>,
}

impl Threads {
    /// Starts one thread per name and hears its first word.
    ///
    /// # Errors
    /// A participant that does not come up.
    pub fn start(timeout: Duration, duties: Vec<(String, Duty)>) -> Result<Self, Failure> {
        let hub = Hub::new(timeout);
        let controls = duties.iter().map(|(name, _)| Control::new(name, hub.control(name))).collect();
        let start = |(name, duty): (String, Duty)| {
            let transport = hub.transport(&name);
            std::thread::spawn(move || duty(transport))
        };
        let threads = duties.into_iter().map(start).collect();
        let mut crew = Self { hub, controls, threads };
        crew.answers()?;
        Ok(crew)
    }

    /// Waits until all participants, told to stop, have ended.
    ///
    /// # Errors
    /// The failure of a participant after its last answer.
    pub fn finish(mut self) -> Result<(), Failure> {
        let ends =
            self.threads.drain(..).map(|thread| thread.join().expect("participants catch their panics"));
        ends.collect()
    }

    fn control(&mut self, process: &str) -> &mut Control {
        let known = self.controls.iter_mut().find(|control| control.process == process);
        known.expect("orders go to participants that were started")
    }
}

impl Crew for Threads {
    fn order(&mut self, process: &str, order: &Order, call: Call) -> Result<(), Failure> {
        let control = self.control(process);
        let sent = control.order(order, call);
        sent.map_err(|error| control.task().failure(process, error))
    }

    fn answer(&mut self, process: &str) -> Result<Reply, Failure> {
        let control = self.control(process);
        match control.answer() {
            Ok(Reply::Failed(failure)) => Err(failure),
            Ok(reply) => Ok(reply),
            Err(error) => Err(control.task().failure(process, error)),
        }
    }

    fn answers(&mut self) -> Result<Vec<(String, Reply)>, Failure> {
        let outstanding = self.controls.iter().filter(|control| control.is_outstanding());
        let names: Vec<String> = outstanding.map(|control| control.process.clone()).collect();
        names.into_iter().map(|name| self.answer(&name).map(|reply| (name, reply))).collect()
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        self.hub.abort();
        for thread in self.threads.drain(..) {
            // A participant that was called off ends with an error, which is not the cause.
            let _ = thread.join();
        }
    }
}
