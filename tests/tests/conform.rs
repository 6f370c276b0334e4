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

/// Number of points of the contract that are kept; one that is not fails the test.
fn kept(output: Output) -> usize {
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    said.lines().filter(|line| line.starts_with("  ok")).count()
}

#[test]
fn the_stub_and_the_elastic_solid_keep_the_contract() {
    let headline = workspace().join("cases/dam-break-elastic/plane.toml");
    for (name, case) in [("solid-rigid", None), ("solid-fem", Some(headline.as_path()))] {
        assert_eq!(kept(conform(name, "", case)), 17, "{name}");
    }
}

#[test]
fn the_water_keeps_the_contract() {
    let mut command = Command::new(program("tidewall"));
    command.arg("conform").arg(program("fluid-isph")).args(["--role", "fluid"]);
    // With points, and with the dummy mesh.
    assert_eq!(kept(command.output().expect("tidewall is built")), 18 + 17);
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

/// Whether the Python in the path has the package the participants of `cases/participants` are written with; says so if not.
fn has_python_package() -> bool {
    let python = Command::new("python3").args(["-c", "import iceoryx2"]).output();
    let is_there = python.is_ok_and(|output| output.status.success());
    if !is_there {
        println!("skipped: python3 with the package iceoryx2 (pip install iceoryx2==0.10.0) is not there");
    }
    is_there
}

/// `tidewall conform` on a participant of `cases/participants` with its case.
fn conform_python(program_name: &str, role: &str, case: &str) -> Output {
    let folder = workspace().join("cases/participants");
    let mut command = Command::new(program("tidewall"));
    command.arg("conform").arg(folder.join(program_name)).args(["--role", role]);
    command.arg("--case").arg(folder.join(case)).output().expect("tidewall is built")
}

/// A stage with the case of a Python participant, and the option that names its program there.
fn python_stage(program_name: &str, role: &str, case: &str) -> (Stage, String) {
    let folder = workspace().join("cases/participants");
    let stage = Stage::new(&std::fs::read_to_string(folder.join(case)).expect("the case is there"));
    (stage, format!("{role}.program={}", folder.join(program_name).display()))
}

#[test]
fn a_wall_written_in_python_keeps_the_contract_and_runs() {
    if !has_python_package() {
        return;
    }
    assert_eq!(kept(conform_python("spring_wall.py", "solid", "spring-wall.toml")), 17);
    let (stage, wall) = python_stage("spring_wall.py", "solid", "spring-wall.toml");
    let run = stage.run("run", &["--set", &wall]).expect_code(0).expect_no_trace();
    let health = &run.json().health;
    assert!(health["spring_wall_displacement_m"] > 5e-3, "the water pushes it: {health:?}");
    assert!(health["work_mismatch"] < 0.02 && run.json().verdicts.is_empty(), "{health:?}");
}

#[test]
fn waves_written_in_python_keep_the_contract_and_press_as_theory_says() {
    if !has_python_package() {
        return;
    }
    assert_eq!(kept(conform_python("wave_wall.py", "fluid", "wave-wall.toml")), 18);
    let (stage, waves) = python_stage("wave_wall.py", "fluid", "wave-wall.toml");
    let still = ["fluid.wave_height=0.0", "solid.model=rigid", "time.end=0.1"];
    let options: Vec<_> =
        still.iter().chain([&waves.as_str()]).flat_map(|option| ["--set", option]).collect();
    let run = stage.run("still", &options).expect_code(0).expect_no_trace();
    let (height, spacing, weight) = (4.0_f64, 0.25, 1025.0 * 9.81);
    // The middles of the pieces give the force exactly, the moment of the parabola by h^2 / 12 of its second derivative more.
    let force = weight * height.powi(2) / 2.0;
    let moment = weight * (height.powi(3) / 6.0 + height * spacing * spacing / 12.0);
    for (column, expected) in [("fx_n", force), ("solid_fx_n", force), ("mz_nm", -moment)] {
        let found = last(&run.series()["interface.csv"], column);
        assert!((found - expected).abs() < 1e-12 * expected.abs(), "{column}: {found}, expected {expected}");
    }
}

/// Last value of a column of a series.
fn last(series: &str, column: &str) -> f64 {
    let place = series.lines().next().and_then(|names| names.split(',').position(|name| name == column));
    let row = series.lines().last().expect("the series has rows");
    let value = row.split(',').nth(place.expect("the column is there"));
    value.and_then(|value| value.parse().ok()).expect("a row has a number for each column")
}
