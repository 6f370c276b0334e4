//! `[fluid]`: the water's own section of the case.

mod flow;
mod room;
mod surroundings;

use protocol::case::{BoxFace, BoxRegion, CaseFile, CheckReport, Section, Shared, SolidOutline};

use crate::air::{DEEP, SURFACE, natural_distance};
use crate::kernel_shape::KernelShape;
use crate::plan::make_plan;
use crate::scene::{Gravity, PressureSolver, Scene, Source, Tank, WallFriction, WallPressure, WaterBox};
use crate::vector::Vector;
use crate::weakly_compressible::Explicit;

/// The program's name in messages and reports.
pub const NAME: &str = "fluid-isph";

/// Relaxation time where the walls are rigid, s: least sensor noise.
const RIGID_RELAXATION: f64 = 0.005;

/// Relaxation time beside an elastic wall, s: a stronger density source feeds its oscillation.
const ELASTIC_RELAXATION: f64 = 0.02;

/// Largest pressure tolerance in steps that the coupler passes over: a tenth of its own default tolerance. Added mass
/// multiplies what is left of the residual in the answers that are compared.
const PASS_TOLERANCE: f64 = 1e-4;

/// Checks the water's part of a case and plans it.
pub fn check(case: &CaseFile) -> CheckReport {
    let shared = Shared::read(case);
    let (plan, left_out) = match shared.header.dimension {
        2 => make_plan::<2>(case, &shared),
        _ => make_plan::<3>(case, &shared),
    };
    CheckReport::new(NAME, case, plan, left_out).with_state()
}

/// The scene of a case; `None` without `[fluid]` or `[domain]`. Mistakes are booked with the case.
pub fn resolve<const D: usize>(case: &CaseFile, shared: &Shared) -> Option<Scene<D>> {
    let section = case.section("fluid")?;
    let Some(domain) = &shared.domain else {
        section.complain(
            "region",
            "there is water but no [domain]",
            "a [domain] with min and max",
            "Add [domain].",
        );
        return None;
    };
    let mut tank =
        Tank { min: point(&domain.region.min), max: point(&domain.region.max), open: [[false; 2]; D] };
    for face in &domain.open {
        tank.open[face.axis()][usize::from(face.sign() > 0.0)] = true;
    }
    let spacing = section
        .number("spacing")
        .unit("m")
        .above(0.0)
        .about("Distance of water particles; adjusted by at most 2 % so that water and tank are whole numbers of it.")
        .required();
    let water = read_regions(&section, &tank);
    let mut scene = Scene::new(tank, water, spacing);
    scene.reference_density = shared.fluid.as_ref().map_or(1000.0, |fluid| fluid.density);
    scene.gravity = match &shared.gravity {
        Some(gravity) => {
            Gravity { vector: point(&gravity.acceleration), factor: gravity.table.clone(), frame: None }
        }
        None => Gravity { vector: [0.0; D], factor: None, frame: None },
    };
    read_terms(&section, &mut scene);
    scene.carve = section.flag(
        "carve",
        false,
        "Leave out water written over an obstacle or the body; without it that is a mistake.",
    );
    surroundings::read_domain(case, shared, &mut scene);
    surroundings::read_obstacles(case, &mut scene);
    scene.flow = section.inner("flow").and_then(|flow| flow::read_flow(&flow, &scene));
    scene.explicit = section.inner("weakly_compressible").map(|explicit| read_explicit(&explicit, &scene));
    if scene.explicit.is_some() && shared.solid.is_some() {
        section.complain(
            "weakly_compressible",
            "the explicit scheme is for water without a [solid]",
            "absent",
            "Leave it out, or describe the body as an [[obstacle]].",
        );
    }
    scene.source = read_source(&section, shared.solid.as_ref());
    let is_elastic = shared.solid.as_ref().is_some_and(|solid| solid.model == "fem");
    read_numerics(&section, &mut scene, is_elastic);
    scene.body_wet = shared.solid.as_ref().map(wet_sides);
    // Read with the shared sections: known keys of this section too.
    let _ = section
        .number("density")
        .unit("kg/m3")
        .above(0.0)
        .about("Reference density of the water.")
        .default(1000.0);
    // Who stands in the fluid's place is the launcher's to know.
    section.pass_over(&["program"]);
    section.finish();
    // Placeholders of refused values would only bring follow-on mistakes.
    if case.diagnostics().is_empty() {
        check_body(&section, &scene, shared.solid.as_ref());
        room::check_room(case, &scene, shared.solid.as_ref());
    }
    Some(scene)
}

fn point<const D: usize>(values: &[f64]) -> Vector<D> {
    std::array::from_fn(|k| values.get(k).copied().unwrap_or(0.0))
}

fn wet_sides(solid: &SolidOutline) -> [bool; 2] {
    let axis = solid.thickness_axis();
    [2 * axis, 2 * axis + 1].map(|face| solid.wet.contains(&BoxFace::ALL[face]))
}

fn read_regions<const D: usize>(section: &Section<'_>, tank: &Tank<D>) -> Vec<WaterBox<D>> {
    let regions = section.list("region");
    if regions.is_empty() {
        section.complain(
            "region",
            "there is no water",
            "one [[fluid.region]] or more",
            "Add [[fluid.region]].",
        );
    }
    let mut water = Vec::new();
    for region in &regions {
        let bounds = BoxRegion::read(region, D, "a box of water");
        let velocity =
            region.vector("velocity", D, "m/s", "Velocity of the water at the start (default: at rest).");
        region.finish();
        let (min, max): (Vector<D>, Vector<D>) = (point(&bounds.min), point(&bounds.max));
        for k in 0..D {
            let tolerance = 1e-9 * (tank.max[k] - tank.min[k]).abs();
            if min[k] < tank.min[k] - tolerance || max[k] > tank.max[k] + tolerance {
                let key = if min[k] < tank.min[k] - tolerance { "min" } else { "max" };
                let inside = format!("{} to {} m along {}", tank.min[k], tank.max[k], ["x", "y", "z"][k]);
                region.complain(
                    key,
                    "the water reaches out of the domain",
                    &inside,
                    "Enlarge [domain] or shift the water.",
                );
            }
        }
        water.push(WaterBox { min, max, velocity: velocity.map_or([0.0; D], |v| point(&v)) });
    }
    water
}

fn read_terms<const D: usize>(section: &Section<'_>, scene: &mut Scene<D>) {
    scene.kinematic_viscosity = section
        .number("kinematic_viscosity")
        .unit("m2/s")
        .above(0.0)
        .about("Viscosity of the water (1e-6 for water); without it the viscous term is left out.")
        .optional();
    scene.smagorinsky = section
        .number("smagorinsky")
        .above(0.0)
        .at_most(0.5)
        .about("Constant of Smagorinsky's turbulence model (0.1 to 0.2); without it turbulence is left out.")
        .optional();
    scene.shifting = section
        .number("shifting")
        .above(0.0)
        .at_most(10.0)
        .about("A of the particle shifting A h |v| dt grad C (2 is usual) for vortices away from the surface; without it left out.")
        .optional();
    let friction = section.choice("walls", &["slip", "no_slip"]);
    let friction = friction.about("Whether walls take part in the viscous term.").default("slip");
    scene.friction = if friction == "slip" { WallFriction::Slip } else { WallFriction::NoSlip };
    if friction == "no_slip" && scene.kinematic_viscosity.is_none() && scene.smagorinsky.is_none() {
        section.complain(
            "walls",
            "no_slip has no effect without viscosity",
            "\"slip\"",
            "Set kinematic_viscosity.",
        );
    }
}

/// `[fluid.weakly_compressible]`: its presence chooses the explicit scheme.
fn read_explicit<const D: usize>(section: &Section<'_>, scene: &Scene<D>) -> Explicit {
    let highest = scene.water.iter().map(|water| water.max[1] - scene.tank.min[1]).fold(0.0, f64::max);
    let fall = (2.0 * crate::vector::norm(&scene.gravity.vector) * highest).sqrt();
    let start = scene.water.iter().map(|water| crate::vector::norm(&water.velocity)).fold(0.0, f64::max);
    let sound_speed = section
        .number("sound_speed")
        .unit("m/s")
        .above(0.0)
        .about("Speed of sound (default: ten times the speed of the highest fall or of the start).")
        .optional();
    let artificial_viscosity = section
        .number("artificial_viscosity")
        .at_least(0.0)
        .at_most(1.0)
        .about("alpha of Monaghan's artificial viscosity.")
        .default(0.02);
    section.finish();
    let sound_speed = sound_speed.unwrap_or(10.0 * fall.max(start));
    if sound_speed <= 0.0 {
        let hint = "Water at rest without gravity gives no speed to take it from.";
        section.complain("sound_speed", "is missing", "number > 0 in m/s", hint);
    }
    Explicit { sound_speed, artificial_viscosity }
}

fn read_source(section: &Section<'_>, solid: Option<&SolidOutline>) -> Source {
    let source = section
        .choice("source", &["stabilised", "divergence_free", "density_invariance"])
        .about("Right side of the pressure equation: (9), (6) or (8) of the paper.")
        .default("stabilised");
    let elastic = solid.is_some_and(|solid| solid.model == "fem");
    let default = if elastic { ELASTIC_RELAXATION } else { RIGID_RELAXATION };
    let alpha = section
        .number("relaxation")
        .at_least(0.0)
        .at_most(1.0)
        .about("alpha of (9) as the paper gives it; acts over dt/alpha. Replaces relaxation_time.")
        .optional();
    let time = section
        .number("relaxation_time")
        .unit("s")
        .above(0.0)
        .about("Time over which the density is restored, dt/alpha: results then do not depend on dt. Default 0.005, beside an elastic wall 0.02.");
    match (source.as_str(), alpha) {
        ("divergence_free", None) => Source::DivergenceFree,
        ("density_invariance", None) => Source::DensityInvariance,
        ("stabilised", Some(alpha)) => {
            if time.optional().is_some() {
                section.complain(
                    "relaxation",
                    "relaxation_time is given too",
                    "one of the two",
                    "Remove one.",
                );
            }
            Source::Alpha(alpha)
        }
        ("stabilised", None) => Source::Time(time.default(default)),
        (_, Some(_)) => {
            section.complain("relaxation", "is for source = \"stabilised\" only", "absent", "Remove it.");
            Source::DivergenceFree
        }
        (_, None) => Source::DivergenceFree,
    }
}

fn read_numerics<const D: usize>(section: &Section<'_>, scene: &mut Scene<D>, is_elastic: bool) {
    let pressure = section
        .choice("wall_pressure", &["shepard", "per_pair"])
        .about(
            "Pressure at walls: a mean over the water around each wall particle, or pair by pair (noisier).",
        )
        .default("shepard");
    scene.wall_pressure = if pressure == "shepard" { WallPressure::Shepard } else { WallPressure::PerPair };
    let kernel = section
        .choice("kernel", &["cubic_spline", "wendland_c2"])
        .about("Smoothing kernel; wendland_c2 reaches 3 spacings instead of 2.4: pressures are quieter and cost more.")
        .default("cubic_spline");
    scene.kernel = if kernel == "cubic_spline" { KernelShape::CubicSpline } else { KernelShape::WendlandC2 };
    let solver = section
        .choice("solver", &["multigrid", "incomplete_cholesky"])
        .about("Preconditioner of conjugate gradients; incomplete_cholesky is the paper's (ICCG), serial and slower.")
        .default("multigrid");
    scene.solver =
        if solver == "multigrid" { PressureSolver::Multigrid } else { PressureSolver::IncompleteCholesky };
    scene.courant = section
        .number("courant")
        .above(0.0)
        .at_most(0.5)
        .about("Largest distance water moves in one step, in spacings.")
        .default(0.3);
    scene.pressure_tolerance = section
        .number("pressure_tolerance")
        .at_least(2e-5)
        .at_most(0.1)
        .about("Relative residual of the pressure solve; single precision floors at 1e-5.")
        .default(1e-3);
    scene.air_distance = section
        .number("air_distance")
        .unit("spacings")
        .at_least(SURFACE)
        .at_most(DEEP)
        .about("Distance of the air's pressure, P = 0, from the outermost particles. Default 1; for water that starts as a film of at most three rows, \
                0.6 in 2-D, 0.5 in 3-D and for a single row.")
        .default(natural_distance(scene));
    // Only an elastic wall is passed over again.
    if is_elastic {
        let number = section.number("pass_tolerance").at_least(2e-5).at_most(0.1).about(
            "The same in coupling steps with several passes (scheme \"strong\", or escalated), whose answers are compared. \
             Default 1e-4, or pressure_tolerance if that is smaller.",
        );
        scene.pass_tolerance = number.default(scene.pressure_tolerance.min(PASS_TOLERANCE));
    }
    scene.max_substeps = section
        .integer("max_substeps")
        .at_least(1.0)
        .at_most(100_000.0)
        .about("Most sub-steps in one coupling step; more ends the run.")
        .default(200.0) as u32;
    scene.suction = section.flag(
        "suction",
        false,
        "Let negative pressures stand; without it water with a free surface bears no tension.",
    );
    scene.jitter = section
        .number("jitter")
        .above(0.0)
        .at_most(0.3)
        .about("Random displacement of the initial particles, in spacings.")
        .optional();
}

/// Thickness of the body.
fn check_body<const D: usize>(section: &Section<'_>, scene: &Scene<D>, solid: Option<&SolidOutline>) {
    let Some(solid) = solid else { return };
    let thickness = solid.region.length(solid.thickness_axis());
    if scene.body_wet == Some([true; 2]) && thickness < 2.0 * scene.particle_spacing * (1.0 - 1e-9) {
        section.complain(
            "spacing",
            format!("the body, wet on both faces, is {thickness} m thick: water would see itself through it"),
            &format!("number <= {} in m", thickness / 2.0),
            "Two spacings must fit into the thickness.",
        );
    }
}

#[cfg(test)]
mod tests;
