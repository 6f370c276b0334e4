//! `[domain]` beyond its box, and `[[obstacle]]`: what stands around the water and how it moves.

use protocol::case::{BoxRegion, CaseFile, Prescribed, Section, Shared};

use super::point;
use crate::obstacle::{Obstacle, Outline};
use crate::scene::{Face, Opening, Scene};
use crate::surface::Surface;
use crate::vector::{Vector, add_scaled, sub};

/// Names of the axes in messages.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];

/// Takes over periodic directions, planes of symmetry, holes and the motion of the tank.
pub(super) fn read_domain<const D: usize>(case: &CaseFile, shared: &Shared, scene: &mut Scene<D>) {
    let Some(domain) = &shared.domain else { return };
    scene.periodic = std::array::from_fn(|k| domain.periodic[k]);
    for face in &domain.symmetry {
        scene.symmetry[face.axis()][usize::from(face.sign() > 0.0)] = true;
    }
    for opening in &domain.openings {
        let face = Face { axis: opening.face.axis(), upper: opening.face.sign() > 0.0 };
        let (min, max) = (point(&opening.region.min), point(&opening.region.max));
        scene.openings.push(Opening { face, min, max });
    }
    scene.gravity.frame.clone_from(&domain.motion);
    let Some(section) = case.section("domain") else { return };
    let refuse = |key: &str, message: &str, hint: &str| section.complain(key, message, "", hint);
    if shared.solid.is_some() && scene.periodic != [false; D] {
        refuse("periodic", "a scene with [solid] cannot be periodic", "Use closed or symmetric faces.");
    }
    if shared.solid.is_some() && domain.motion.is_some() {
        refuse("motion", "the tank cannot move with a [solid] in it", "Move the body by [solid.motion].");
    }
    if scene.periodic != [false; D] && scene.smagorinsky.is_some() {
        refuse("periodic", "smagorinsky is for scenes without periodic directions", "Leave one of them out.");
    }
    for opening in &scene.openings {
        let Face { axis, upper } = opening.face;
        if scene.tank.open[axis][usize::from(upper)] || scene.periodic[axis] {
            refuse("opening", "the face with the hole is no wall", "Remove the opening, or close the face.");
        }
    }
}

/// Reads `[[obstacle]]`.
pub(super) fn read_obstacles<const D: usize>(case: &CaseFile, scene: &mut Scene<D>) {
    for section in case.list("obstacle") {
        let file = section
            .text("file")
            .about("STL file of a closed surface, relative to the case (3-D); replaces min and max.");
        let file = file.optional();
        let scale = section.number("scale").unit("m").above(0.0);
        let scale = scale.about("file: length of one unit of the file.").default(1.0);
        let motion = section.inner("motion").map(|motion| Prescribed::read(&motion, D));
        let outline = match file {
            Some(file) => read_surface(case, &section, (&file, scale)),
            None => {
                let bounds = BoxRegion::read(&section, D, "the obstacle");
                Some(Outline::Box { min: point(&bounds.min), max: point(&bounds.max) })
            }
        };
        section.finish();
        if let Some(outline) = outline {
            let obstacle = Obstacle { outline, motion };
            // Placeholders of refused values would only bring follow-on mistakes.
            if case.diagnostics().is_empty() {
                check_obstacle(&section, scene, &obstacle);
            }
            scene.obstacles.push(obstacle);
        }
    }
}

fn read_surface<const D: usize>(
    case: &CaseFile,
    section: &Section<'_>,
    (file, scale): (&str, f64),
) -> Option<Outline<D>> {
    section.pass_over(&["min", "max"]);
    if D != 3 {
        section.complain("file", "surfaces are for 3-D", "min and max", "Describe the obstacle as a box.");
        return None;
    }
    let folder = case.path().parent().unwrap_or(std::path::Path::new("."));
    match Surface::read(&folder.join(file), scale) {
        Ok(surface) => Some(Outline::Surface(surface)),
        Err(error) => {
            section.complain("file", error.to_string(), "an STL file of a closed surface", "Mend the mesh.");
            None
        }
    }
}

/// Thickness, place, and the gaps beside an obstacle.
fn check_obstacle<const D: usize>(section: &Section<'_>, scene: &Scene<D>, obstacle: &Obstacle<D>) {
    let key = if matches!(obstacle.outline, Outline::Surface(_)) { "file" } else { "min" };
    let (min, max) = obstacle.outline.bounds();
    let (tank, spacing) = (&scene.tank, scene.particle_spacing);
    for k in 0..D {
        let thickness = max[k] - min[k];
        if thickness < 2.0 * spacing * (1.0 - 1e-9) {
            let message = format!("the obstacle is {thickness} m thick along {}", AXES[k]);
            let hint = "Water would see itself through less than two spacings.";
            section.complain(key, message, &format!("thickness >= {} m", 2.0 * spacing), hint);
        }
        if max[k] < tank.min[k] || min[k] > tank.max[k] {
            let message = format!("the obstacle stands outside the domain along {}", AXES[k]);
            let inside = format!("{} to {} m", tank.min[k], tank.max[k]);
            section.complain(key, message, &inside, "Move it, or enlarge [domain].");
        }
        let gaps = [("lower", min[k] - tank.min[k]), ("upper", tank.max[k] - max[k])];
        for (number, (side, gap)) in gaps.into_iter().enumerate() {
            if !tank.open[k][number] && gap > 0.01 * spacing && gap < spacing * (1.0 - 1e-9) {
                let message = format!(
                    "the gap of {gap:.6} m to the {side} wall along {} is less than a spacing",
                    AXES[k]
                );
                let hint = "Close the gap, widen it, or refine the spacing.";
                section.complain(key, message, &format!("0 m, or at least {spacing} m"), hint);
            }
        }
    }
    if !scene.carve
        && let Some(number) =
            scene.water.iter().position(|water| overlaps((&water.min, &water.max), obstacle, spacing))
    {
        let message = format!("the obstacle and fluid.region[{number}] overlap");
        let hint = "Move one of them, or set fluid.carve = true to leave the water inside out.";
        section.complain(key, message, "", hint);
    }
}

/// Whether any water particle of a box would lie inside an obstacle.
fn overlaps<const D: usize>(
    (low, high): (&Vector<D>, &Vector<D>),
    obstacle: &Obstacle<D>,
    spacing: f64,
) -> bool {
    let (bounds, start) = (obstacle.outline.bounds(), obstacle.start());
    let [min, max] = [bounds.0, bounds.1].map(|mut corner| {
        add_scaled(&mut corner, 1.0, &start);
        corner
    });
    let common = |k: usize| (low[k].max(min[k]), high[k].min(max[k]));
    if (0..D).any(|k| common(k).1 - common(k).0 < 0.25 * spacing) {
        return false;
    }
    let Outline::Surface(surface) = &obstacle.outline else { return true };
    // The surface may leave room in its box: look at the places of particles.
    let count: [usize; D] = std::array::from_fn(|k| ((common(k).1 - common(k).0) / spacing).ceil() as usize);
    (0..count.iter().product::<usize>()).any(|number| {
        let mut rest = number;
        let x: Vector<D> = std::array::from_fn(|k| {
            let digit = rest % count[k];
            rest /= count[k];
            common(k).0 + (digit as f64 + 0.5) * spacing
        });
        surface.contains(&sub(&x, &start))
    })
}
