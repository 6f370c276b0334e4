//! What the Tidewall programs agree on.
//!
//! - [`case`]: the case file: a strict reader that finds every mistake at once, and the shared sections.
//! - [`control`]: the launcher's orders and the participants' answers.
//! - [`link`]: the transport trait, with [`ipc`] (iceoryx2 between processes) and [`inprocess`] (its twin for tests).
//! - [`names`], [`shm`], [`sweep`]: what keeps runs apart, room in shared memory, and how nothing is left behind.
//! - [`interface`]: the surface that travels in the handshake and what is exchanged over it at each step.
//! - [`failure`]: how a run ends when it does not end well.
//! - [`participant`]: the main program every solver shares: command line, `--check`, the loop over orders.
//! - [`series`], [`vtk`], [`state`]: the files of the run folder.
//!
//! Deliberately absent: any physics, and any edge to a solver.

pub mod case;
mod checks;
pub mod control;
pub mod failure;
pub mod header;
pub mod inprocess;
pub mod interface;
pub mod ipc;
pub mod link;
pub mod names;
pub mod participant;
pub mod phases;
mod program;
pub mod series;
pub mod shm;
pub mod state;
pub mod sweep;
pub mod usage;
pub mod vtk;

/// Version of everything that crosses a process border. Unequal versions refuse each other in the handshake.
pub const PROTOCOL_VERSION: u32 = 2;
