//! A participant never outlives its launcher and never ignores a request to stop.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};
use std::time::Duration;

use rustix::process::{Signal, set_parent_process_death_signal};
use signal_hook::consts::{SIGINT, SIGTERM};

use crate::failure::FailureClass;
use crate::names::RunNames;
use crate::sweep::{self, Member};

/// From the request to stop to the end of the process, whatever it computes at that time.
const LAST_MOMENT: Duration = Duration::from_millis(1500);

pub(super) fn stop_flag() -> &'static Arc<AtomicBool> {
    static STOP: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);
    &STOP
}

/// Why a participant cannot start.
#[derive(Debug, thiserror::Error)]
pub enum GuardError {
    /// There is no run by these names, or its launcher has already gone.
    #[error("no launcher runs in {}", .0.display())]
    NoLauncher(std::path::PathBuf),
    /// The system refused.
    #[error("cannot guard this process: {0}")]
    System(#[from] io::Error),
}

/// Ties this process to the run; the first thing in a participant's `main`, kept until its end, so that it is
/// dropped after the transport.
///
/// - When the launcher's main thread ends, the kernel sends SIGTERM.
/// - SIGTERM sets [`super::stop_flag`]: every wait on a link ends at once. A process that computes meanwhile is
///   ended 1.5 s later, with the exit code of an interruption.
/// - SIGINT from the terminal is the launcher's to handle and does nothing here.
/// - The last participant to leave a run without launcher removes the run.
///
/// # Errors
/// [`GuardError::NoLauncher`] when the launcher died before this call: no signal would come any more.
pub fn guard(names: &RunNames) -> Result<Member, GuardError> {
    let stop = stop_flag();
    signal_hook::flag::register(SIGTERM, stop.clone())?;
    signal_hook::flag::register(SIGINT, Arc::new(AtomicBool::new(false)))?;
    watch_for_the_end(names.clone())?;
    set_parent_process_death_signal(Some(Signal::TERM)).map_err(io::Error::from)?;
    if !sweep::owner_is_alive(names.root()) {
        return Err(GuardError::NoLauncher(names.root().to_owned()));
    }
    Ok(Member::enter(names)?)
}

/// A thread that ends the process if the rest of it does not within [`LAST_MOMENT`] of the request.
fn watch_for_the_end(names: RunNames) -> io::Result<()> {
    let mut signals = signal_hook::iterator::Signals::new([SIGTERM])?;
    let watch = move || {
        if signals.forever().next().is_some() {
            stop_flag().store(true, Ordering::Relaxed);
            std::thread::sleep(LAST_MOMENT);
            sweep::leave(&names);
            std::process::exit(i32::from(FailureClass::Interrupted.exit_code()));
        }
    };
    std::thread::Builder::new().name("last-moment".to_owned()).spawn(watch)?;
    Ok(())
}
