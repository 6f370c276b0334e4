//! The executables of the workspace. Cargo builds those of the tested package only, so the first test of a process
//! that needs one builds them all, into the folder and with the profile of the test itself.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// The root of the workspace.
pub fn workspace() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the package lies in the workspace")
}

/// The folder of the executables, built once per test process; several test processes wait for each other on cargo's
/// own lock.
pub fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(build)
}

/// The executable of this name.
pub fn program(name: &str) -> PathBuf {
    folder().join(name)
}

fn build() -> PathBuf {
    // <target>/<profile>/deps/<test>-<hash>
    let test = std::env::current_exe().expect("a running program has a path");
    let folder = test.ancestors().nth(2).expect("cargo puts tests into <profile>/deps").to_owned();
    let target = folder.parent().expect("the profile folder lies in the target folder");
    let profile = match folder.file_name().and_then(|name| name.to_str()) {
        Some("debug") | None => "dev",
        Some(name) => name,
    };
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| env!("CARGO").into());
    let mut command = Command::new(cargo);
    command.args(["build", "--workspace", "--bins", "--quiet", "--profile", profile, "--target-dir"]);
    let done = command.arg(target).current_dir(workspace()).status().expect("cargo can be started");
    assert!(done.success(), "the programs cannot be built: {done}");
    folder
}
