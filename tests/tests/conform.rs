//! `tidewall conform` against programs that keep the contract and one that does not.

use std::path::Path;
use std::process::{Command, Output};

use tidewall_tests::programs::{program, workspace};
use tidewall_tests::run::Stage;

fn conform(name: &str, flaw: &str, case: Option<&Path>) -> Output {
    let mut command = Command::new(program("tidewall"));
    command.arg("conform").arg(program(name)).env("TIDEWALL_TEST_FLAW", flaw);
    command.args(case.into_iter().flat_map(|case| [Path::new("--case"), case]));
    command.output().expect("tidewall is built")
}

#[test]
fn the_stub_and_the_elastic_solid_keep_the_contract() {
    let headline = workspace().join("cases/dam-break-elastic/plane.toml");
    for (name, case) in [("solid-rigid", None), ("solid-fem", Some(headline.as_path()))] {
        let output = conform(name, "", case);
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success(), "{name}: {said}{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(said.lines().filter(|line| line.trim_start().starts_with("ok")).count(), 9, "{said}");
    }
}

#[test]
fn a_program_that_breaks_it_is_told_where() {
    for (flaw, fault) in [("size", "found 2-D, 20 interface nodes"), ("version", "protocol version of solid")]
    {
        let output = conform("bad-participant", flaw, None);
        let said = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(2), "{flaw}: {said}");
        assert!(said.contains("WRONG") && said.contains(fault), "{flaw}: {said}");
    }
    let output = Command::new(program("tidewall")).args(["conform", "/bin/true"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("no check report"));
}

/// Whether the Python in the path has the package the participants of `cases/participants` are written with.
fn has_python_package() -> bool {
    let python = Command::new("python3").args(["-c", "import iceoryx2"]).output();
    python.is_ok_and(|output| output.status.success())
}

#[test]
fn a_wall_written_in_python_keeps_the_contract_and_runs() {
    if !has_python_package() {
        println!("skipped: python3 with the package iceoryx2 (pip install iceoryx2==0.10.0) is not there");
        return;
    }
    let folder = workspace().join("cases/participants");
    let case = folder.join("spring-wall.toml");
    let mut command = Command::new(program("tidewall"));
    command.arg("conform").arg(folder.join("spring_wall.py")).arg("--case").arg(&case);
    let output = command.output().expect("tidewall is built");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    let stage = Stage::new(&std::fs::read_to_string(&case).expect("the case is there"));
    let wall = format!("solid.program={}", folder.join("spring_wall.py").display());
    let run = stage.run("run", &["--set", &wall]).expect_code(0).expect_no_trace();
    let health = &run.json().health;
    assert!(health["spring_wall_displacement_m"] > 5e-3, "the water pushes it: {health:?}");
    assert!(health["work_mismatch"] < 0.02 && run.json().verdicts.is_empty(), "{health:?}");
}
