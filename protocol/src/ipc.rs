//! The transport between processes: iceoryx2 shared memory.
//!
//! Each direction between two processes is one publish-subscribe service of slices with a [`Header`], written
//! straight into shared memory and read in place. Each process has one event service, its inbox: whoever sends to
//! it notifies it afterwards (data first, then the event), and the launcher calls a run off by an event to every
//! inbox, so a waiting process wakes wherever it waits. Nobody polls: on two cores shared with the solvers' threads
//! that was over a hundred times slower than an event.
//!
//! Flow control is the memory itself: a channel has two samples, and a sender that finds none
//! free waits until the receiver has given one back. So nothing is overwritten and nothing is dropped.
//!
//! - [`IpcTransport`]: the side of a participant.
//! - [`IpcServer`]: the side of the launcher.
//! - [`guard`]: what a participant's `main` does first, so that it never outlives the launcher.
//!
//! Deliberately absent: request-response and blackboard services, dead-node recovery (a run that loses a process
//! ends, and its private name space is removed as a whole).

mod config;
pub mod guard;
mod inbox;
mod link;
mod server;
mod transport;

use std::sync::atomic::AtomicBool;

use iceoryx2::prelude::ZeroCopySend;

use crate::header::Header;
use crate::link::Item;

pub use link::IpcLink;
pub use server::IpcServer;
pub use transport::IpcTransport;

/// Set when this process shall stop now: every wait on a link then ends with
/// [`crate::link::LinkError::Aborted`]. Signal handlers set it.
pub fn stop_flag() -> &'static AtomicBool {
    guard::stop_flag().as_ref()
}

// SAFETY: `Header` is `#[repr(C)]`, made of plain numbers only, without pointers, padding or a destructor, and any
// bit pattern is a valid value, so it may lie in memory that another process writes.
#[expect(unsafe_code, reason = "iceoryx2 marks types for shared memory by an unsafe trait")]
unsafe impl ZeroCopySend for Header {
    // SAFETY: the name is given explicitly, as the compiler's own changes with crate and version and another
    // program could then never match it.
    unsafe fn type_name() -> &'static str {
        "tidewall.Header"
    }
}

/// Items that may lie in shared memory.
pub trait SharedItem: Item + ZeroCopySend {}

impl SharedItem for u8 {}
impl SharedItem for f64 {}
