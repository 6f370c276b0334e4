//! The case file's section, the check and its complaints.

#![allow(clippy::unwrap_used, reason = "tests")]

use protocol::case::{CaseFile, CheckReport, Place};
use solid_fem::{case, rigid};

const HEAD: &str = "[case]\nname = \"t\"\ndimension = 2\n[time]\nend = 0.1\nmax_dt = 2.5e-4\n\
    [domain]\nmin = [0, 0]\nmax = [0.584, 1.0]\nopen = [\"top\"]\n[gravity]\nacceleration = [0, -9.81]\n";

const BODY: &str = "[solid]\nmin = [0.292, 0]\nmax = [0.304, 0.08]\nelements = [1, 16]\nclamped = [\"bottom\"]\n\
    density = 2500\nyoung_modulus = 1e6\n";

fn check(extra: &str) -> CheckReport {
    case::check(&CaseFile::parse("t.toml", &format!("{HEAD}{BODY}{extra}"), &[]))
}

#[test]
fn the_plan_names_counts_solver_and_frequency() {
    let report = check("[[gauge]]\nname = \"tip\"\nkind = \"displacement\"\npoint = [0.292, 0.08]\n");
    assert_eq!(report.diagnostics, []);
    assert_eq!(report.figure("solid_nodes"), Some(34.0));
    assert_eq!(report.figure("solid_elements"), Some(16.0));
    assert_eq!(report.figure("surface_nodes"), Some(34.0));
    // 5.97 Hz, lowered by the weight: it is 13 % of the buckling load.
    let frequency = report.figure("first_frequency_hz").unwrap();
    assert!((5.4..5.8).contains(&frequency), "{frequency}");
    let courant = report.figure("solid_courant").unwrap();
    assert!((courant - 20.0 * 2.5e-4 / 0.005).abs() < 1e-9);
    assert!(report.left_out.iter().any(|absent| absent.what.contains("damping")));
}

#[test]
fn mistakes_are_found_together_with_range_and_hint() {
    let report = check(
        "poisson_ratio = 0.5\nintegrator = \"newmark\"\nnewmark_gamma = 0.3025\nnewmark_beta = 0.6\nelement = \"hex8_eas9\"\n",
    );
    let keys: Vec<_> = report.diagnostics.iter().map(|diagnostic| diagnostic.key.as_str()).collect();
    assert_eq!(keys, ["solid.poisson_ratio", "solid.newmark_gamma", "solid.element"]);
    assert!(report.diagnostics.iter().all(|diagnostic| !diagnostic.allowed.is_empty()));
    assert!(report.diagnostics[1].hint.contains("other way round"));
}

#[test]
fn updated_lagrangian_with_enhanced_elements_is_refused_with_the_others_named() {
    let report = check("kinematics = \"updated_lagrangian\"\n");
    let [diagnostic] = &report.diagnostics[..] else { panic!("{:?}", report.diagnostics) };
    assert_eq!(diagnostic.key, "solid.kinematics");
    assert!(matches!(diagnostic.place, Place::File { .. }));
    assert_eq!(diagnostic.allowed, "with element quad8, tri6, tri3");
    assert!(diagnostic.hint.contains("total_lagrangian"), "{}", diagnostic.hint);
    assert_eq!(check("kinematics = \"updated_lagrangian\"\nelement = \"quad8\"\n").diagnostics, []);
}

#[test]
fn each_nonsense_is_refused() {
    let complains = |body: &str, key: &str| {
        let report = case::check(&CaseFile::parse("t.toml", &format!("{HEAD}{body}"), &[]));
        let keys: Vec<_> = report.diagnostics.iter().map(|diagnostic| diagnostic.key.clone()).collect();
        assert!(keys.contains(&key.to_owned()), "{key} not in {keys:?}");
    };
    complains(&BODY.replace("clamped = [\"bottom\"]\n", ""), "solid.clamped");
    complains(&BODY.replace("2500", "0"), "solid.density");
    complains(&BODY.replace("density = 2500\n", ""), "solid.density");
    complains(&BODY.replace("0.304, 0.08", "0.304, 1.08"), "solid.max");
    complains(&BODY.replace("1e6", "-1e6"), "solid.young_modulus");
    // Far too soft for its own weight.
    complains(&BODY.replace("1e6", "1e4"), "solid.young_modulus");
    complains(&format!("{BODY}elment = \"tri3\"\n"), "solid.elment");
    complains(&format!("{BODY}[[solid.load]]\nface = \"left\"\n"), "solid.load[0].pressure");
    let gauge = "[[gauge]]\nname = \"tip\"\nkind = \"displacement\"\npoint = [0.2, 0.08]\n";
    complains(&format!("{BODY}{gauge}"), "gauge[0].point");
}

#[test]
fn the_rigid_stub_checks_its_motion() {
    let body = "[solid]\nmodel = \"rigid\"\nmin = [0.292, 0]\nmax = [0.304, 0.08]\n";
    let check = |extra: &str| rigid::check(&CaseFile::parse("t.toml", &format!("{HEAD}{body}{extra}"), &[]));
    let fixed = check("");
    assert_eq!(fixed.diagnostics, []);
    assert_eq!(fixed.figure("surface_nodes"), Some(4.0));
    assert_eq!(fixed.left_out.len(), 1);
    assert_eq!(check("[solid.motion]\namplitude = [0.01, 0]\nfrequency = 2\n").diagnostics, []);
    assert_eq!(check("[solid.motion]\nkind = \"table\"\ntable = [[0, 0, 0], [1, 0.1, 0]]\n").diagnostics, []);
    assert_eq!(check("[solid.motion]\namplitude = [0.01, 0]\n").diagnostics.len(), 1);
    assert_eq!(
        check("[solid.motion]\nkind = \"table\"\ntable = [[1, 0, 0], [0, 0.1, 0]]\n").diagnostics.len(),
        1
    );
}
