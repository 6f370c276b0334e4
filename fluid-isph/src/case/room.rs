//! Whether water and walls have room beside each other: water written over what is solid, and gaps and holes too
//! narrow for a particle.

use protocol::case::{CaseFile, SolidOutline};

use super::point;
use super::surroundings::AXES;
use crate::obstacle::Outline;
use crate::scene::Scene;
use crate::vector::{Vector, add_scaled};

/// Shorter than this many spacings, a gap is a joint and an overlap is a touch.
const TOUCHING: f64 = 0.01;

/// A box something solid fills at the start.
struct Filled<const D: usize> {
    name: String,
    min: Vector<D>,
    max: Vector<D>,
}

/// Complains about water in the body, about gaps beside it and between obstacles, and about narrow holes.
pub(super) fn check_room<const D: usize>(case: &CaseFile, scene: &Scene<D>, solid: Option<&SolidOutline>) {
    let body = solid.map(|solid| Filled {
        name: "[solid]".to_owned(),
        min: point(&solid.region.min),
        max: point(&solid.region.max),
    });
    let boxes: Vec<Option<Filled<D>>> =
        (0..scene.obstacles.len()).map(|number| filled(scene, number)).collect();
    if let Some(body) = &body {
        check_body(case, scene, body);
    }
    for (number, section) in case.list("obstacle").iter().enumerate() {
        let Some(own) = &boxes[number] else { continue };
        for other in boxes[..number].iter().flatten().chain(&body) {
            if let Some((axis, gap)) = gap_between(own, other, scene.particle_spacing) {
                section.complain(
                    "min",
                    format!(
                        "the gap of {gap:.6} m to {} along {} is less than a spacing",
                        other.name, AXES[axis]
                    ),
                    &format!("0 m, or at least {} m", scene.particle_spacing),
                    "Close the gap, widen it, or refine the spacing.",
                );
            }
        }
    }
    check_holes(case, scene);
}

/// The box of an obstacle; `None` for a surface, whose box may be far from it.
fn filled<const D: usize>(scene: &Scene<D>, number: usize) -> Option<Filled<D>> {
    let obstacle = &scene.obstacles[number];
    let Outline::Box { mut min, mut max } = obstacle.outline else { return None };
    add_scaled(&mut min, 1.0, &obstacle.start());
    add_scaled(&mut max, 1.0, &obstacle.start());
    Some(Filled { name: format!("obstacle[{number}]"), min, max })
}

/// Axis and width of a gap that is there but holds no particle.
fn gap_between<const D: usize>(a: &Filled<D>, b: &Filled<D>, spacing: f64) -> Option<(usize, f64)> {
    let apart: Vector<D> = std::array::from_fn(|k| (a.min[k] - b.max[k]).max(b.min[k] - a.max[k]));
    let narrow = |k: usize| apart[k] > TOUCHING * spacing && apart[k] < spacing * (1.0 - 1e-9);
    let axis = (0..D).find(|&k| narrow(k))?;
    (0..D).all(|k| k == axis || apart[k] < -TOUCHING * spacing).then_some((axis, apart[axis]))
}

/// Water inside the body, and gaps between it and the walls of the tank.
fn check_body<const D: usize>(case: &CaseFile, scene: &Scene<D>, body: &Filled<D>) {
    let (Some(section), spacing) = (case.section("solid"), scene.particle_spacing) else { return };
    for k in 0..D {
        let gaps = [("lower", body.min[k] - scene.tank.min[k]), ("upper", scene.tank.max[k] - body.max[k])];
        for (number, (side, gap)) in gaps.into_iter().enumerate() {
            if !scene.tank.open[k][number] && gap > TOUCHING * spacing && gap < spacing * (1.0 - 1e-9) {
                section.complain(
                    ["min", "max"][number],
                    format!(
                        "the gap of {gap:.6} m to the {side} wall along {} is less than a spacing",
                        AXES[k]
                    ),
                    &format!("0 m, or at least {spacing} m"),
                    "Close the gap, widen it, or refine the spacing.",
                );
            }
        }
    }
    let common = |water: &crate::scene::WaterBox<D>, k: usize| {
        water.max[k].min(body.max[k]) - water.min[k].max(body.min[k])
    };
    let inside = |water: &crate::scene::WaterBox<D>| (0..D).all(|k| common(water, k) > 0.25 * spacing);
    for (number, region) in case.section("fluid").iter().flat_map(|fluid| fluid.list("region")).enumerate() {
        if !scene.carve && inside(&scene.water[number]) {
            region.complain(
                "min",
                "the water overlaps [solid]",
                "outside [solid]",
                "Move one of them, or set fluid.carve = true to leave the water inside out.",
            );
        }
    }
}

/// Holes a particle does not fit through.
fn check_holes<const D: usize>(case: &CaseFile, scene: &Scene<D>) {
    let Some(section) = case.section("domain") else { return };
    for opening in &scene.openings {
        for k in (0..D).filter(|&k| k != opening.face.axis) {
            let width = opening.max[k].min(scene.tank.max[k]) - opening.min[k].max(scene.tank.min[k]);
            if width < scene.particle_spacing * (1.0 - 1e-9) {
                section.complain(
                    "opening",
                    format!(
                        "the hole is {:.6} m wide along {}, less than a spacing",
                        width.max(0.0),
                        AXES[k]
                    ),
                    &format!("at least {} m inside the domain", scene.particle_spacing),
                    "Widen the hole, or refine the spacing.",
                );
            }
        }
    }
}
