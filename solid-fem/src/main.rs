//! The elastic solid as a program; with `--export` it writes the solid of a case for CalculiX instead.

use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    match arguments.next().as_deref() {
        Some("--export") => solid_fem::export::main(arguments),
        _ => protocol::participant::main(solid_fem::participant::PROGRAM),
    }
}
