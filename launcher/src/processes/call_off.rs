//! The end of a run that does not end well: everybody is told, then asked, then forced; nothing is left behind.

use std::time::{Duration, Instant};

use protocol::sweep;
use rustix::process::Signal;

use super::supervise::Processes;

/// From the abort event to SIGTERM: time to write the last good state.
const GRACE: Duration = Duration::from_secs(1);
/// From SIGTERM to SIGKILL.
const LAST_GRACE: Duration = Duration::from_millis(500);

impl Processes {
    /// Calls the run off: abort event, one second later SIGTERM, half a second later SIGKILL; then removes what the
    /// run has put into shared memory. Does nothing the second time.
    pub fn call_off(&mut self) {
        if self.is_over {
            return;
        }
        self.server.abort();
        if !self.all_end_within(GRACE) {
            self.signal(Signal::TERM);
            if !self.all_end_within(LAST_GRACE) {
                self.signal(Signal::KILL);
            }
        }
        self.end_run();
    }

    fn all_end_within(&mut self, limit: Duration) -> bool {
        let start = Instant::now();
        loop {
            // No short cut: each look reaps.
            let living = self
                .children
                .borrow_mut()
                .iter_mut()
                .filter_map(|child| child.end().is_none().then_some(()))
                .count();
            if living == 0 || start.elapsed() >= limit {
                return living == 0;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn signal(&mut self, signal: Signal) {
        self.children.borrow_mut().iter_mut().for_each(|child| child.signal(signal));
    }

    /// Reaps all, closes the channels and removes the run.
    pub(super) fn end_run(&mut self) {
        self.children.borrow_mut().iter_mut().for_each(|child| {
            child.reap();
            child.tidy();
        });
        self.controls.clear();
        for left in sweep::remove_run(&self.names) {
            tracing::warn!(path = %left.display(), "could not be removed");
        }
        self.is_over = true;
    }
}

impl Drop for Processes {
    fn drop(&mut self) {
        self.call_off();
    }
}
