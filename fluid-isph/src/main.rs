//! The fluid as a program.

use std::process::ExitCode;

fn main() -> ExitCode {
    protocol::participant::main(fluid_isph::participant::PROGRAM)
}
