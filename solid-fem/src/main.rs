//! The elastic solid as a program.

use std::process::ExitCode;

fn main() -> ExitCode {
    protocol::participant::main(solid_fem::participant::PROGRAM)
}
