//! Own loads: on faces and at points.

use protocol::case::Section;

use crate::scene::{FaceLoad, FaceLoadKind, PointLoad, Scene};

const KINDS: [&str; 4] = ["follower_pressure", "dead_pressure", "dead_traction", "point_force"];

pub(super) fn read_all(section: &Section<'_>, faces: &[String], scene: &mut Scene) {
    let names: Vec<&str> = faces.iter().map(String::as_str).collect();
    for load in section.list("load") {
        read(&load, &names, scene);
    }
}

fn read(section: &Section<'_>, faces: &[&str], scene: &mut Scene) {
    let dimension = scene.dimension();
    let kind = section
        .choice("kind", &KINDS)
        .about(
            "follower_pressure turns with the face; dead loads keep direction and reference area; point_force acts at \
             a point.",
        )
        .default(KINDS[0]);
    let face = section.choice("face", faces).about("Face the load acts on; not for point_force.").optional();
    let pressure = section.number("pressure").unit("Pa").about("Pressure, for the two pressures.").optional();
    let traction =
        section.vector("traction", dimension, "Pa", "Force per reference area, for dead_traction.");
    let point = section.vector("point", dimension, "m", "Where in the unloaded body, for point_force.");
    let unit = if dimension == 2 { "N/m" } else { "N" };
    let force = section.vector("force", dimension, unit, "The force, for point_force.");
    let table = read_table(section);
    section.finish();
    let whole = |values: Vec<f64>| std::array::from_fn(|i| values.get(i).copied().unwrap_or_default());
    let complain = |key: &str, what: &str, allowed: &str| {
        section.complain(key, format!("{kind} takes {what}"), allowed, "and nothing else");
    };
    let kind = match (kind.as_str(), pressure, traction) {
        ("point_force", None, None) => {
            match (face, point, force) {
                (None, Some(point), Some(force)) => {
                    scene.point_loads.push(PointLoad { point, force: whole(force), table });
                }
                _ => complain("point", "a point and a force", "one number per axis each"),
            }
            return;
        }
        ("dead_pressure", Some(pressure), None) => FaceLoadKind::DeadPressure(pressure),
        ("follower_pressure", Some(pressure), None) => FaceLoadKind::FollowerPressure(pressure),
        ("dead_traction", None, Some(values)) => FaceLoadKind::DeadTraction(whole(values)),
        ("dead_traction", ..) => {
            return complain("traction", "a face and a traction", "one number per axis in Pa");
        }
        _ => return complain("pressure", "a face and a pressure", "a number in Pa"),
    };
    match (face, point, force) {
        (Some(face), None, None) => scene.loads.push(FaceLoad { face, kind, table }),
        _ => complain("face", "a face", &faces.join(", ")),
    }
}

fn read_table(section: &Section<'_>) -> Vec<(f64, f64)> {
    let rows =
        section.rows("table", 2, "s, -", "Factor on it over time: rows [time, factor], linear between.");
    let table: Vec<_> = rows.unwrap_or_default().iter().map(|row| (row[0], row[1])).collect();
    if table.windows(2).any(|pair| pair[0].0 >= pair[1].0) {
        section.complain("table", "the times do not increase", "increasing times", "Sort the rows by time.");
    }
    table
}
