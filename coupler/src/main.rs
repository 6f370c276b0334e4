//! The coupler as a program.

use std::process::ExitCode;

fn main() -> ExitCode {
    protocol::participant::main(coupler::participant::PROGRAM)
}
