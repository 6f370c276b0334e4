//! Ctrl-C and SIGTERM at the launcher: the first asks for an orderly end, the second for an immediate one.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use protocol::failure::FailureClass;
use protocol::ipc::stop_flag;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

/// Whether the user has asked to stop.
#[derive(Debug, Clone)]
pub struct Interrupt {
    requested: Arc<AtomicBool>,
}

impl Interrupt {
    /// Takes SIGINT and SIGTERM over. The first sets [`Interrupt::is_requested`], which the time loop reads at the
    /// end of a step; the second sets [`stop_flag`], which ends every wait within 100 ms; the third ends the launcher
    /// on the spot, and the participants with it.
    ///
    /// # Errors
    /// The system refused the handler or its thread.
    pub fn install() -> io::Result<Self> {
        let mut signals = Signals::new([SIGINT, SIGTERM])?;
        let requested = Arc::new(AtomicBool::new(false));
        let request = requested.clone();
        let watch = move || {
            for _ in &mut signals {
                if !request.swap(true, Ordering::Relaxed) {
                    continue;
                }
                if stop_flag().swap(true, Ordering::Relaxed) {
                    std::process::exit(i32::from(FailureClass::Interrupted.exit_code()));
                }
            }
        };
        std::thread::Builder::new().name("interrupt".to_owned()).spawn(watch)?;
        Ok(Self { requested })
    }

    /// Whether the run shall end after this step.
    pub fn is_requested(&self) -> bool {
        self.requested.load(Ordering::Relaxed)
    }

    /// Whether the run shall end now.
    pub fn is_urgent(&self) -> bool {
        stop_flag().load(Ordering::Relaxed)
    }
}
