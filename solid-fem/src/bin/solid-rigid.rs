//! The rigid stub as a program.

use std::process::ExitCode;

fn main() -> ExitCode {
    protocol::participant::main(solid_fem::rigid::PROGRAM)
}
