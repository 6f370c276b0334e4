//! `tidewall`: checks a case, plans it, starts the programs it needs, gives the orders of the staggered time loop, and
//! reports what came of it.
//!
//! One coupling step is [`step`]: one screen, one line an order. The launcher is never in the data path.
//!
//! Deliberately absent: any edge to a solver; solvers are executables with a contract (`--check`, orders, replies).

pub mod check;
pub mod cli;
pub mod compare;
pub mod conduct;
pub mod conform;
pub mod diagnostics;
pub mod folder;
pub mod measures;
pub mod plan;
pub mod processes;
pub mod progress;
pub mod report;
pub mod resume;
pub mod run;
pub mod run_json;
pub mod running_mean;
pub mod step;
pub mod stress;
pub mod study;
pub mod time_step;
