//! The participants of a run, from their start to their end, as the launcher sees them.
//!
//! [`Processes`] are programs of their own, supervised: whoever dies is noticed at once and named, a failure calls
//! all others off, and nothing is left behind. [`Threads`] are the same participants within this process, for
//! tests. The time loop speaks to either as a [`Crew`].
//!
//! | what happens | how it is found | what follows |
//! |---|---|---|
//! | a participant reports a failure | its reply | its own failure |
//! | a process dies | SIGCHLD, waitpid | named with its signal or exit code |
//! | a process is stopped or hangs | the step time-out, `/proc/<pid>/stat` | named |
//! | a survivor complains about its peer | its reply | the peer, if that is dead or has failed itself |

mod call_off;
mod child;
mod control;
mod interrupt;
mod supervise;
#[cfg(test)]
mod tests;
mod threads;

use protocol::control::{Order, Reply};
use protocol::failure::Failure;

pub use child::ProcessSpec;
pub use interrupt::Interrupt;
pub use supervise::{Launch, Processes};
pub use threads::{Duty, Threads};

/// What wakes a process that has got an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Call {
    /// The order itself.
    Now,
    /// The data of another process, for which it would have to wait anyway.
    WithData,
}

/// Those who obey orders.
pub trait Crew {
    /// Gives one order; its answer is outstanding then. A second order may be given before the answer to the first.
    ///
    /// # Errors
    /// The failure that ends the run.
    fn order(&mut self, process: &str, order: &Order, call: Call) -> Result<(), Failure>;

    /// Waits for the answer of one process to its oldest order without one. Never [`Reply::Failed`]: that is the error.
    ///
    /// # Errors
    /// The failure that ends the run: the first cause, not what followed from it.
    fn answer(&mut self, process: &str) -> Result<Reply, Failure>;

    /// Waits for one answer of each process that owes some, in the order of the processes; whichever fails first ends the
    /// wait.
    ///
    /// # Errors
    /// As [`Crew::answer`].
    fn answers(&mut self) -> Result<Vec<(String, Reply)>, Failure>;

    /// An order and its answer.
    ///
    /// # Errors
    /// As [`Crew::answer`].
    fn ask(&mut self, process: &str, order: &Order) -> Result<Reply, Failure> {
        self.order(process, order, Call::Now)?;
        self.answer(process)
    }
}
