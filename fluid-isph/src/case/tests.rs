//! What the check says about good and bad cases.

use super::*;

const DAM: &str = r#"
[case]
name = "dam"
dimension = 2
[domain]
min = [0.0, 0.0]
max = [0.584, 1.0]
open = ["top"]
[gravity]
acceleration = [0.0, -9.81]
[fluid]
spacing = 0.003
[[fluid.region]]
min = [0.0, 0.0]
max = [0.146, 0.292]
[time]
end = 0.1
max_dt = 0.001
"#;

fn report(text: &str, options: &[&str]) -> CheckReport {
    let options: Vec<String> = options.iter().map(|&option| option.to_owned()).collect();
    check(&CaseFile::parse("dam.toml", text, &options))
}

#[test]
fn a_sound_case_gets_a_plan_and_the_list_of_what_it_leaves_out() {
    let report = report(DAM, &[]);
    assert!(report.diagnostics.is_empty(), "{:?}", report.diagnostics);
    assert_eq!(report.figure("water_particles"), Some(49.0 * 98.0));
    let left: Vec<_> = report.left_out.iter().map(|entry| entry.what.as_str()).collect();
    assert!(left.contains(&"viscous term") && left.contains(&"turbulence"), "{left:?}");
}

#[test]
fn obstacles_are_checked_with_place_and_hint() {
    let boxed = |min: &str, max: &str| format!("{DAM}\n[[obstacle]]\nmin = {min}\nmax = {max}\n");
    for (text, expected) in [
        (boxed("[0.3, 0.0]", "[0.304, 0.1]"), "0.004"),
        (boxed("[0.1, 0.0]", "[0.2, 0.1]"), "overlap"),
        (boxed("[0.3, 0.002]", "[0.4, 0.1]"), "gap of 0.002"),
        (boxed("[0.7, 0.0]", "[0.8, 0.1]"), "outside the domain"),
        (format!("{DAM}\n[[obstacle]]\nfile = \"bed.stl\"\n"), "3-D"),
    ] {
        let found = report(&text, &[]).diagnostics;
        assert!(found.iter().any(|found| found.message.contains(expected)), "{expected}: {found:?}");
        assert!(found.iter().all(|found| !found.hint.is_empty()), "{found:?}");
    }
    let sound = boxed("[0.3, 0.0]", "[0.36, 0.1]");
    assert!(report(&sound, &[]).diagnostics.is_empty());
    let carved = boxed("[0.1, 0.0]", "[0.2, 0.1]");
    assert!(report(&carved, &["fluid.carve=true"]).diagnostics.is_empty());
}

#[test]
fn a_surface_with_a_hole_is_refused_with_the_place() {
    let folder = tempfile::tempdir().unwrap();
    let corner = |x: &str| format!("vertex {x}\n");
    let facet = |corners: [&str; 3]| {
        format!("facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n", corners.map(corner).concat())
    };
    let open = format!(
        "solid t\n{}{}endsolid t\n",
        facet(["0 0 0", "0 1 0", "1 0 0"]),
        facet(["0 0 0", "1 0 0", "0 0 1"])
    );
    std::fs::write(folder.path().join("bed.stl"), open).unwrap();
    let text = DAM
        .replace("dimension = 2", "dimension = 3")
        .replace("0.0]", "0.0, 0.0]")
        .replace("1.0]", "1.0, 0.1]")
        .replace("-9.81]", "-9.81, 0.0]")
        .replace("0.292]", "0.292, 0.1]");
    let text = format!("{text}\n[[obstacle]]\nfile = \"bed.stl\"\nscale = 0.1\n");
    let report = check(&CaseFile::parse(folder.path().join("case.toml"), &text, &[]));
    let found = report.diagnostics.iter().find(|found| found.key == "obstacle[0].file");
    assert!(found.is_some_and(|found| found.message.contains("not closed")), "{:?}", report.diagnostics);
}

#[test]
fn mistakes_are_named_with_key_and_range() {
    for (text, options, key) in [
        (DAM, vec!["fluid.spacing=0.5"], "fluid.spacing"),
        (DAM, vec!["fluid.courant=2.0"], "fluid.courant"),
        (DAM, vec!["fluid.spacng=0.5"], "fluid.spacng"),
        (DAM, vec!["fluid.walls=\"no_slip\""], "fluid.walls"),
        (DAM, vec!["fluid.relaxation=0.1", "fluid.relaxation_time=0.01"], "fluid.relaxation"),
        (DAM, vec!["domain.max=[0.1, 1.0]"], "fluid.region[0].max"),
    ] {
        let report = report(text, &options);
        assert!(report.diagnostics.iter().any(|found| found.key == key), "{key}: {:?}", report.diagnostics);
    }
}

#[test]
fn a_thin_body_wet_on_both_faces_is_refused() {
    let body = format!("{DAM}\n[solid]\nmodel = \"rigid\"\nmin = [0.292, 0.0]\nmax = [0.297, 0.08]\n");
    let found = report(&body, &[]);
    assert!(
        found.diagnostics.iter().any(|found| found.message.contains("see itself")),
        "{:?}",
        found.diagnostics
    );
}

/// Everything that overlaps, does not fit or lies outside is refused with its place and a hint, before anything starts.
#[test]
fn water_and_walls_without_room_are_refused_with_place_and_hint() {
    let more = |text: &str| format!("{DAM}\n{text}\n");
    let solid = |min: &str, max: &str| more(&format!("[solid]\nmodel = \"rigid\"\nmin = {min}\nmax = {max}"));
    let hole = "[[domain.opening]]\nface = \"right\"\nmin = [0.0, 0.0]\nmax = [1.0, 0.002]";
    let two = "[[obstacle]]\nmin = [0.3, 0.0]\nmax = [0.36, 0.1]\n[[obstacle]]\nmin = [0.362, 0.0]\nmax = [0.4, 0.1]";
    let without_water = DAM.replace("[[fluid.region]]\nmin = [0.0, 0.0]\nmax = [0.146, 0.292]\n", "");
    for (text, options, key, expected) in [
        // Overlapping water and wall.
        (solid("[0.1, 0.0]", "[0.2, 0.1]"), vec![], "fluid.region[0].min", "overlaps [solid]"),
        (solid("[0.0, 0.0]", "[0.2, 0.3]"), vec![], "fluid.region[0].min", "overlaps [solid]"),
        (more("[[obstacle]]\nmin = [0.1, 0.0]\nmax = [0.2, 0.1]"), vec![], "obstacle[0].min", "overlap"),
        // A spacing larger than a gap.
        (solid("[0.3, 0.002]", "[0.32, 0.1]"), vec![], "solid.min", "gap of 0.002"),
        (more(two), vec![], "obstacle[1].min", "gap of 0.002"),
        (more(hole), vec![], "domain.opening", "hole is 0.002"),
        (DAM.to_owned(), vec!["fluid.spacing=0.25"], "fluid.spacing", "larger than a side"),
        // Water outside the tank.
        (DAM.to_owned(), vec!["domain.min=[0.01, 0.0]"], "fluid.region[0].min", "out of the domain"),
        // No water.
        (without_water, vec![], "fluid.region", "no water"),
        (
            more("[[obstacle]]\nmin = [0.0, 0.0]\nmax = [0.2, 0.3]"),
            vec!["fluid.carve=true"],
            "fluid.region",
            "no particle",
        ),
    ] {
        let found = report(&text, &options).diagnostics;
        let wanted = found.iter().find(|found| found.key == key && found.message.contains(expected));
        assert!(wanted.is_some_and(|found| !found.hint.is_empty()), "{key}, {expected}: {found:?}");
    }
    let carved = solid("[0.1, 0.0]", "[0.2, 0.1]");
    assert!(report(&carved, &["fluid.carve=true"]).diagnostics.is_empty());
}

const WALL: &str = "[solid]\nmodel = \"rigid\"\nmin = [0.292, 0.0]\nmax = [0.304, 0.08]\n[coupling]\n";

/// 27 rows of four particles, and 27 + 27 + 4 markers on left, right and top; a dummy mesh is not the water's to plan.
#[test]
fn points_without_a_mesh_are_planned_to_the_last() {
    let text = format!("{DAM}\n{WALL}");
    let points = report(&text, &["coupling.fluid_side=\"points\""]);
    assert!(points.diagnostics.is_empty(), "{:?}", points.diagnostics);
    assert_eq!(points.figure("interface_points"), Some(4.0 * 27.0 + 58.0));
    assert_eq!(report(&text, &[]).figure("interface_points"), None);
    let thin = report(&text, &["coupling.fluid_side=\"points\"", "solid.max=[0.297, 0.08]"]);
    assert!(thin.diagnostics.iter().any(|found| found.message.contains("see itself")));
}
