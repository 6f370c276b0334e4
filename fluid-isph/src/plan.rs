//! The water's part of the plan printed before a run: counts, memory, time step, and what the scene leaves out.

use protocol::case::{
    BoxFace, CaseFile, Diagnostic, FluidSide, GaugeKind, LeftOut, Place, PlanFigure, Shared, SolidOutline,
};

use crate::air::{FILM_ROWS, film_rows, natural_distance};
use crate::body_layout::LayoutRules;
use crate::case::{NAME, resolve};
use crate::error::SetupError;
use crate::kernel::Kernel;
use crate::lattice::Lattice;
use crate::offer::Offer;
use crate::scene::{Scene, Tank, WallFriction};
use crate::time_step::StepLimits;
use crate::vector::norm;

/// Figures and left-out list of a sound case; otherwise its mistakes are booked and both are empty.
pub(crate) fn make_plan<const D: usize>(case: &CaseFile, shared: &Shared) -> (Vec<PlanFigure>, Vec<LeftOut>) {
    let Some(scene) = resolve::<D>(case, shared) else {
        return (Vec::new(), vec![LeftOut::new("fluid-isph", "there is no water")]);
    };
    check_gauges(case, shared, &scene);
    if !case.diagnostics().is_empty() {
        return (Vec::new(), Vec::new());
    }
    let planned = Lattice::new(&scene).and_then(|lattice| {
        let mut figures = figures(&scene, &lattice, shared.solid.as_ref());
        figures.extend(interface_points(&scene, lattice.spacing, shared)?);
        Ok(figures)
    });
    match planned {
        Ok(figures) => (figures, left_out(&scene, shared)),
        Err(error) => {
            refuse_layout(case, &scene, error);
            (Vec::new(), Vec::new())
        }
    }
}

/// The points offered in place of a dummy mesh, as exactly as at the start.
fn interface_points<const D: usize>(
    scene: &Scene<D>,
    spacing: f64,
    shared: &Shared,
) -> Result<Option<PlanFigure>, SetupError> {
    let solid = shared.solid.as_ref().filter(|_| shared.fluid_side == FluidSide::Points);
    let Some(solid) = solid else { return Ok(None) };
    let kernel = Kernel::new(scene.kernel, spacing);
    let offer = Offer::lay_out(solid, LayoutRules::new(scene, &kernel))?;
    let remark = format!(
        "{} particles of the body, ghost rows included, and {} markers",
        offer.particle_count(),
        offer.area.len()
    );
    Ok(Some(PlanFigure::new("interface_points", offer.len() as f64, remark)))
}

fn refuse_layout<const D: usize>(case: &CaseFile, scene: &Scene<D>, error: SetupError) {
    let hint = error.clone().into_failure(NAME).hint;
    let Some(section) = case.section("fluid") else { return };
    let allowed = match &error {
        SetupError::SpacingTooLarge { length, .. } => format!("number <= {} in m", length / 4.0),
        SetupError::NoWater => "at least one particle of water".to_owned(),
        _ => format!("a spacing near {} that divides water and tank", scene.particle_spacing),
    };
    let key = if error == SetupError::NoWater { "region" } else { "spacing" };
    section.complain(key, error.to_string(), &allowed, &hint);
}

fn check_gauges<const D: usize>(case: &CaseFile, shared: &Shared, scene: &Scene<D>) {
    let tank = &scene.tank;
    for gauge in &shared.gauges {
        let message = match &gauge.kind {
            GaugeKind::Pressure { points } => first_outside(tank, points),
            GaugeKind::WaterLevel { point } => first_outside(tank, std::slice::from_ref(point)),
            GaugeKind::Force { on } if on == "body" => {
                shared.solid.is_none().then(|| "there is no body to measure the force on".to_owned())
            }
            GaugeKind::Force { on } if on == "obstacles" => {
                scene.obstacles.is_empty().then(|| "there is no obstacle to measure the force on".to_owned())
            }
            GaugeKind::Force { on } => BoxFace::from_name(on)
                .is_some_and(|face| tank.open[face.axis()][usize::from(face.sign() > 0.0)])
                .then(|| format!("the face \"{on}\" is open: there is no wall to measure the force on")),
            _ => None,
        };
        if let Some(message) = message {
            case.complain(Diagnostic {
                place: Place::Scene,
                key: format!("gauge \"{}\"", gauge.name),
                message,
                allowed: String::new(),
                hint: "Compare the gauge with [domain] and [solid].".to_owned(),
            });
        }
    }
}

/// What to say of the first of `points` (`[n, D]` m) outside the domain, if there is one.
fn first_outside<const D: usize>(tank: &Tank<D>, points: &[Vec<f64>]) -> Option<String> {
    let is_outside = |point: &&Vec<f64>| {
        (0..D).any(|k| {
            let tolerance = 1e-6 * (tank.max[k] - tank.min[k]);
            point[k] < tank.min[k] - tolerance || point[k] > tank.max[k] + tolerance
        })
    };
    points.iter().find(is_outside).map(|point| format!("the point {point:?} lies outside the domain"))
}

fn figures<const D: usize>(
    scene: &Scene<D>,
    lattice: &Lattice<D>,
    solid: Option<&SolidOutline>,
) -> Vec<PlanFigure> {
    let spacing = lattice.spacing;
    let body = solid.map_or(0.0, |solid| {
        (0..D).map(|k| (solid.region.length(k) / spacing).round().max(1.0)).product::<f64>()
    });
    let obstacles: usize = scene.obstacles.iter().map(|one| one.outline.fill(spacing).len()).sum();
    let (water, wall) = (lattice.water.len() as f64, (lattice.wall.len() + obstacles) as f64);
    // Rows of 8 bytes an entry with room to grow, columns, search lists; the cells of the search grid.
    let kernel = Kernel::<D>::new(scene.kernel, spacing);
    let per_water = 8.0 * 1.35 * kernel.lattice_neighbours() as f64 + if D == 3 { 260.0 } else { 220.0 };
    let support = kernel.support_radius;
    let cells: f64 = (0..D).map(|k| 1.5 * (scene.tank.max[k] - scene.tank.min[k]) / support + 6.0).product();
    let memory = water * per_water + (wall + body) * 180.0 + cells * 60.0;
    let adjusted = format!(
        "asked for {}, changed by {:+.2} %",
        scene.particle_spacing,
        (spacing / scene.particle_spacing - 1.0) * 100.0
    );
    let gravity = norm(&scene.gravity.vector);
    let fall: f64 = scene.water.iter().map(|water| water.max[1] - scene.tank.min[1]).fold(0.0, f64::max);
    let start = scene.water.iter().map(|water| norm(&water.velocity)).fold(0.0, f64::max);
    let limits = |speed: f64| StepLimits {
        courant: scene.courant,
        spacing,
        speed: speed + scene.explicit.map_or(0.0, |explicit| explicit.sound_speed),
        acceleration: gravity,
        viscosity: scene.kinematic_viscosity.unwrap_or(0.0),
    };
    let fastest = (2.0 * gravity * fall).sqrt().max(start);
    let mut figures = vec![
        PlanFigure::new("spacing_m", spacing, adjusted),
        PlanFigure::new("water_particles", water, ""),
        PlanFigure::new(
            "wall_particles",
            wall,
            "layers behind every closed face, and the shells of obstacles",
        ),
        PlanFigure::new("body_particles", body, "without ghost rows"),
        PlanFigure::new("memory_bytes", memory, "estimate"),
        PlanFigure::new("air_distance_spacings", scene.air_distance, why_air(scene)),
    ];
    let (limit, first) = (limits(fastest).longest(), limits(start).longest());
    // Nothing limits the step of water at rest without weight.
    if limit.is_finite() {
        let remark = format!("at {fastest:.2} m/s, the speed of the highest fall; first step {first:.2e} s");
        figures.push(PlanFigure::new("dt_limit_s", limit, remark));
    }
    figures
}

/// Why the air begins where it does.
fn why_air<const D: usize>(scene: &Scene<D>) -> String {
    let natural = natural_distance(scene);
    match film_rows(scene) {
        _ if scene.air_distance != natural => {
            format!("air_distance; {natural} would be taken for this water")
        }
        Some(rows) => format!("a film, nowhere more than {rows} particles deep at the start"),
        None => format!("the water is no film of at most {FILM_ROWS} rows"),
    }
}

fn left_out<const D: usize>(scene: &Scene<D>, shared: &Shared) -> Vec<LeftOut> {
    let mut list = Vec::new();
    let mut note = |absent: bool, what: &str, why: &str| {
        if absent {
            list.push(LeftOut::new(what, why));
        }
    };
    let viscous = scene.kinematic_viscosity.is_some() || scene.smagorinsky.is_some();
    note(!viscous, "viscous term", "no kinematic_viscosity and no smagorinsky");
    note(
        scene.explicit.is_some(),
        "pressure equation",
        "[fluid.weakly_compressible]: Tait's equation instead",
    );
    note(scene.shifting.is_none(), "particle shifting", "no shifting");
    note(scene.smagorinsky.is_none(), "turbulence", "no smagorinsky");
    note(viscous && scene.friction == WallFriction::Slip, "friction at walls", "walls = \"slip\"");
    note(scene.gravity.vector == [0.0; D], "gravity", "no [gravity]");
    note(scene.obstacles.is_empty(), "obstacles", "no [[obstacle]]");
    note(scene.periodic == [false; D], "images of the water", "no periodic direction");
    note(shared.solid.is_none(), "body particles, loads and markers", "no [solid]");
    note(
        shared.gauges.iter().all(|gauge| !gauge.kind.is_of_fluid()),
        "gauges of the water",
        "none asked for",
    );
    note(shared.output.fields_every.is_none(), "fields of the water", "no output.fields_every");
    list
}
