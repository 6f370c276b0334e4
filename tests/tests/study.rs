//! `tidewall study` from the outside: a table over settings, a failure that loses no other run, and no run done twice.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use tidewall_tests::programs;

/// A cantilever under a small pressure, static: a hundredth of a second a run.
const CASE: &str = r#"
[case]
name = "beam"
dimension = 2
[solid]
min = [0.0, 0.0]
max = [0.012, 0.08]
elements = [1, 2]
clamped = ["bottom"]
density = 2500.0
young_modulus = 1e6
poisson_ratio = 0.0
weight = false
analysis = "static"
[[solid.load]]
face = "left"
kind = "follower_pressure"
pressure = 10.0
[time]
end = 1.0
max_dt = 1.0
[[gauge]]
name = "tip"
kind = "displacement"
point = [0.0, 0.08]
[[reference]]
gauge = "tip"
column = "ux_m"
label = "Timoshenko beam"
norm = "final"
value = 3.6197e-4
relative = true
"#;

const STUDY: &str = r#"
[study]
name = "beam"
case = "case.toml"
along = "element length, m"
[[setting]]
label = "2 elements"
size = 0.04
set = ["solid.elements=[1, 2]", "solid.element=tri3"]
[[setting]]
label = "16 elements"
size = 0.005
set = ["solid.elements=[2, 16]", "solid.element=tri3"]
[[error]]
gauge = "tip"
norm = "final"
wanted = [0.9]
"#;

/// Far beyond what one step can be asked to bear.
const FAILING: &str = r#"
[[setting]]
label = "crushed"
set = ["solid.load[0].pressure=1e7"]
"#;

fn study(folder: &Path, text: &str) -> Output {
    fs::write(folder.join("case.toml"), CASE).expect("the stage can be written and tidewall started");
    fs::write(folder.join("study.toml"), text).expect("the stage can be written and tidewall started");
    let mut command = Command::new(programs::program("tidewall"));
    command.arg("study").arg(folder.join("study.toml")).arg("--out").arg(folder.join("out"));
    command.args(["--threads", "1"]).output().expect("the stage can be written and tidewall started")
}

fn words(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn a_failed_run_loses_no_other_and_a_finished_one_is_not_repeated() {
    let folder = tempfile::tempdir().unwrap();
    let first = study(folder.path(), &format!("{STUDY}{FAILING}"));
    assert_eq!(first.status.code(), Some(3), "{}", words(&first.stderr));
    let csv = fs::read_to_string(folder.path().join("out/study.csv")).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().skip(1).map(|row| row.split(',').collect()).collect();
    assert_eq!(rows.iter().map(|row| row[4]).collect::<Vec<_>>(), ["completed", "completed", "failed"]);
    let error = |row: usize| rows[row][5].parse::<f64>().unwrap();
    assert!(error(0) > error(1) && error(1) > 0.0, "{csv}");

    let kept = folder.path().join("out/16-elements-1/run.json");
    let before = fs::read(&kept).unwrap();
    let second = study(folder.path(), STUDY);
    assert_eq!(second.status.code(), Some(0), "{}", words(&second.stderr));
    assert_eq!(words(&second.stderr).matches("done before").count(), 2);
    assert_eq!(fs::read(&kept).unwrap(), before);
    let page = fs::read_to_string(folder.path().join("out/study.md")).unwrap();
    assert!(page.contains("Observed order in element length, m: "), "{page}");
    assert!(page.contains("Cheapest for an error of 9.0e-1: "), "{page}");
    let picture = fs::read_to_string(folder.path().join("out/study.svg")).unwrap();
    assert!(picture.contains("16 elements") && !picture.contains("NaN"));

    // Another case under the same label is another run.
    let third = study(folder.path(), &STUDY.replace("[2, 16]", "[2, 12]"));
    assert_eq!(words(&third.stderr).matches("done before").count(), 1);
}

#[test]
fn mistakes_are_found_before_anything_starts() {
    let folder = tempfile::tempdir().unwrap();
    let in_study = study(folder.path(), &STUDY.replace("norm = \"final\"", "norm = \"finale\""));
    assert_eq!(in_study.status.code(), Some(2));
    assert!(words(&in_study.stderr).contains("Did you mean \"final\"?"), "{}", words(&in_study.stderr));
    let in_setting = study(folder.path(), &STUDY.replace("solid.element=tri3", "solid.element=tri9"));
    assert_eq!(in_setting.status.code(), Some(2));
    let said = words(&in_setting.stderr);
    assert!(said.contains("setting \"2 elements\"") && said.contains("tri9"), "{said}");
    assert!(!folder.path().join("out").exists());
}
