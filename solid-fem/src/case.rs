//! The section `[solid]` of the case file, for `model = "fem"`: case as written to scene as resolved.

use protocol::case::{
    BoxRegion, CaseFile, CheckReport, GaugeKind, LeftOut, PlanFigure, Section, Shared, SolidOutline,
    face_names,
};

use crate::box_grid::{BoxGrid, Face};
use crate::element::ElementKind;
use crate::integrator::Integrator;
use crate::linear::LinearMethod;
use crate::linear::block_matrix::BlockPattern;
use crate::probe::Probe;
use crate::scene::{FaceLoad, FaceLoadKind, Scene};
use crate::solid::Solid;

/// Above this number of nodes the check leaves out the static start and the first frequency: they take seconds.
const CHECKED_NODES: usize = 12_000;

/// Keys of an elastic body, which a rigid one has no use for.
pub(crate) const ELASTIC_KEYS: [&str; 13] = [
    "young_modulus",
    "poisson_ratio",
    "damping",
    "element",
    "integrator",
    "rho_inf",
    "newmark_gamma",
    "newmark_beta",
    "newton_tolerance",
    "rollers",
    "weight",
    "analysis",
    "load",
];

/// How the solid is computed.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The scene.
    pub scene: Scene,
    /// Without inertia: every step is a static equilibrium.
    pub is_static: bool,
}

impl Settings {
    /// Reads `[solid]`, booking mistakes in the case file; `None` if the scene has no elastic solid.
    pub fn read(case: &CaseFile, shared: &Shared) -> Option<Self> {
        let outline = shared.solid.as_ref().filter(|outline| outline.model == "fem")?;
        let section = case.section("solid")?;
        let grid = grid(outline);
        skip_outline(&section, grid.dimension);
        check_place(&section, shared, outline);
        let mut scene = Scene::of_box(grid, 1.0, 1.0, 0.0);
        read_material(&section, &mut scene);
        read_numerics(&section, &mut scene);
        read_supports(&section, outline, &mut scene);
        read_weight(&section, shared, &mut scene);
        let analysis = section.choice("analysis", &["dynamic", "static"]);
        let analysis = analysis
            .about("dynamic: motion in time; static: an equilibrium at every step, inertia left out.")
            .default("dynamic");
        scene.loads =
            section.list("load").iter().filter_map(|load| read_load(load, grid.dimension)).collect();
        section.finish();
        (scene.interface, scene.wet_sides) = (outline.interface_faces(), outline.wet_sides());
        Some(Self { scene, is_static: analysis == "static" })
    }
}

/// The cells of an outlined body.
pub(crate) fn grid(outline: &SolidOutline) -> BoxGrid {
    let d = outline.region.min.len();
    let (mut minimum, mut maximum, mut cells) = ([0.0; 3], [1.0; 3], [1; 3]);
    minimum[..d].copy_from_slice(&outline.region.min);
    maximum[..d].copy_from_slice(&outline.region.max);
    cells[..d].copy_from_slice(&outline.elements);
    BoxGrid { dimension: d, minimum, maximum, cells }
}

/// Asks for the keys of the outline, which [`Shared::read`] has read, so that they are known here too.
pub(crate) fn skip_outline(section: &Section<'_>, dimension: usize) {
    let faces = face_names(dimension);
    let _ = section.choice("model", &["fem", "rigid", "none"]).about("Kind of solid.").default("fem");
    let _ = BoxRegion::read(section, dimension, "the unloaded body");
    let _ = section.vector("elements", dimension, "", "Elements along each axis (default: one each).");
    if section.has("wet") {
        let _ = section.choice("wet", faces).about("Faces the water may touch.").list(&[]);
    }
    let _ = section.choice("clamped", faces).about("Faces that are held.").list(&[]);
    let _ = section.number("density").unit("kg/m3").above(0.0).about("Density of the body.").optional();
    let _ = section.text("program").about("Another executable in the solid's place.").optional();
}

fn check_place(section: &Section<'_>, shared: &Shared, outline: &SolidOutline) {
    let Some(domain) = &shared.domain else { return };
    for axis in 0..outline.region.min.len() {
        let slack = 1e-9 * domain.region.length(axis).abs();
        for (key, value) in [("min", outline.region.min[axis]), ("max", outline.region.max[axis])] {
            let (low, high) = (domain.region.min[axis], domain.region.max[axis]);
            if value < low - slack || value > high + slack {
                let message = format!("{value} lies outside the domain along {}", ["x", "y", "z"][axis]);
                section.complain(key, message, &format!("{low} .. {high}"), "Put the body inside [domain].");
            }
        }
    }
}

fn read_material(section: &Section<'_>, scene: &mut Scene) {
    scene.density =
        section.number("density").unit("kg/m3").above(0.0).about("Density of the body.").required();
    scene.young_modulus =
        section.number("young_modulus").unit("Pa").above(0.0).about("Young's modulus.").required();
    let ratio = section.number("poisson_ratio").at_least(0.0).below(0.5);
    scene.poisson_ratio = ratio.about("Poisson's ratio; rubber-like bodies take 0.49.").default(0.0);
    let damping = section.number("damping").unit("1/s").at_least(0.0);
    scene.damping =
        damping.about("Mass-proportional damping a: vibration decays as exp(-a t / 2).").default(0.0);
}

fn read_numerics(section: &Section<'_>, scene: &mut Scene) {
    let dimension = scene.grid.dimension;
    let kinds: Vec<_> = ElementKind::ALL.into_iter().filter(|kind| kind.dimension() == dimension).collect();
    let names: Vec<_> = kinds.iter().map(|kind| kind.name()).collect();
    let element = section
        .choice("element", &names)
        .about("Element; the triangle and the tetrahedron are far too stiff in bending and serve comparisons only.")
        .default(ElementKind::default_of(dimension).name());
    scene.element = kinds.into_iter().find(|kind| kind.name() == element).unwrap_or(scene.element);
    let integrator = section
        .choice("integrator", &["generalised_alpha", "newmark"])
        .about("Time integration: generalised_alpha is of second order; newmark as in the paper of first.")
        .default("generalised_alpha");
    let rho_inf = section.number("rho_inf").at_least(0.0).at_most(1.0);
    let rho_inf =
        rho_inf.about("generalised_alpha: share of the highest frequencies kept per step.").default(0.5);
    let gamma = section.number("newmark_gamma").about("newmark: gamma, 0.5 .. 1, in the standard meaning.");
    let gamma = gamma.default(0.6);
    let beta = section.number("newmark_beta").about("newmark: beta, newmark_gamma / 2 .. 1.").default(0.3025);
    scene.integrator = match integrator.as_str() {
        "newmark" => checked_newmark(section, gamma, beta),
        _ => Integrator::GeneralisedAlpha { rho_inf },
    };
    let tolerance = section.number("newton_tolerance").above(0.0).below(0.1);
    scene.newton_tolerance =
        tolerance.about("Residual over the largest force at which Newton's method stops.").default(1.5e-6);
}

fn checked_newmark(section: &Section<'_>, gamma: f64, beta: f64) -> Integrator {
    if !(0.5..=1.0).contains(&gamma) {
        let hint = "Below 1/2 the scheme feeds energy in; the paper's table prints gamma and beta the other way round.";
        section.complain("newmark_gamma", format!("{gamma} is not allowed"), "0.5 .. 1", hint);
    } else if !(0.5 * gamma..=1.0).contains(&beta) {
        let hint = "Below newmark_gamma / 2 the scheme is stable for small steps only; (gamma + 0.5)^2 / 4 is usual.";
        section.complain(
            "newmark_beta",
            format!("{beta} is not allowed"),
            &format!("{} .. 1", 0.5 * gamma),
            hint,
        );
    } else {
        return Integrator::Newmark { gamma, beta };
    }
    Integrator::PAPER
}

fn read_supports(section: &Section<'_>, outline: &SolidOutline, scene: &mut Scene) {
    let names = face_names(scene.grid.dimension);
    let rollers =
        section.choice("rollers", names).about("Faces that slide in their own plane (symmetry).").list(&[]);
    scene.clamped.clone_from(&outline.clamped);
    scene.rollers = rollers.iter().filter_map(|name| Face::from_name(name)).collect();
    if outline.clamped.is_empty() {
        section.complain(
            "clamped",
            "nothing holds the body",
            &names.join(", "),
            "Name the faces that are held, such as clamped = [\"bottom\"].",
        );
    }
}

fn read_weight(section: &Section<'_>, shared: &Shared, scene: &mut Scene) {
    let has_weight = section.flag("weight", true, "Whether gravity acts on the body too.");
    scene.gravity = [0.0; 3];
    if let Some(gravity) = shared.gravity.as_ref().filter(|_| has_weight) {
        scene.gravity[..gravity.acceleration.len()].copy_from_slice(&gravity.acceleration);
        scene.gravity_table = gravity.table.clone().unwrap_or_default();
    }
}

fn read_load(section: &Section<'_>, dimension: usize) -> Option<FaceLoad> {
    let face = section.choice("face", face_names(dimension)).about("Face the load acts on.").required();
    let kind = section
        .choice("kind", &["follower_pressure", "dead_pressure", "dead_traction"])
        .about("follower_pressure turns with the face; dead loads keep direction and reference area.")
        .default("follower_pressure");
    let pressure = section.number("pressure").unit("Pa").about("Pressure, for the two pressures.").optional();
    let traction =
        section.vector("traction", dimension, "Pa", "Force per reference area, for dead_traction.");
    let rows =
        section.rows("table", 2, "s, -", "Factor on it over time: rows [time, factor], linear between.");
    let table: Vec<_> = rows.unwrap_or_default().iter().map(|row| (row[0], row[1])).collect();
    if table.windows(2).any(|pair| pair[0].0 >= pair[1].0) {
        section.complain("table", "the times do not increase", "increasing times", "Sort the rows by time.");
    }
    section.finish();
    let kind = match (kind.as_str(), pressure, traction) {
        ("dead_traction", None, Some(values)) => {
            let mut traction = [0.0; 3];
            traction[..dimension].copy_from_slice(&values);
            FaceLoadKind::DeadTraction(traction)
        }
        ("dead_traction", ..) => {
            section.complain("traction", "dead_traction takes a traction", "one number per axis in Pa", "");
            return None;
        }
        ("dead_pressure", Some(pressure), None) => FaceLoadKind::DeadPressure(pressure),
        ("follower_pressure", Some(pressure), None) => FaceLoadKind::FollowerPressure(pressure),
        (kind, ..) => {
            section.complain("pressure", format!("{kind} takes a pressure"), "a number in Pa", "");
            return None;
        }
    };
    Some(FaceLoad { face: Face::from_name(&face)?, kind, table })
}

/// The answer of `solid-fem --check`.
pub fn check(case: &CaseFile) -> CheckReport {
    let shared = Shared::read(case);
    let settings = Settings::read(case, &shared);
    let (mut plan, mut left_out) = (Vec::new(), Vec::new());
    if let Some(settings) = settings.filter(|_| case.diagnostics().is_empty()) {
        check_gauges(case, &shared, &settings.scene);
        figures(&settings, shared.time.max_dt, &mut plan);
        start_figures(case, &settings, &mut plan);
        absences(&settings, shared.time.max_dt, &mut left_out);
    }
    CheckReport::new("solid-fem", case, plan, left_out)
}

/// A point to be recorded must lie in the body.
pub(crate) fn check_gauges(case: &CaseFile, shared: &Shared, scene: &Scene) {
    for (section, gauge) in case.list("gauge").iter().zip(&shared.gauges) {
        let GaugeKind::Displacement { point } = &gauge.kind else { continue };
        if Probe::at(&scene.grid, scene.element.is_simplex(), point).is_none() {
            let d = scene.grid.dimension;
            let allowed = format!("{:?} .. {:?}", &scene.grid.minimum[..d], &scene.grid.maximum[..d]);
            section.complain("point", format!("{point:?} lies outside the solid"), &allowed, "");
        }
    }
}

fn figures(settings: &Settings, dt: f64, plan: &mut Vec<PlanFigure>) {
    let scene = &settings.scene;
    let mesh = scene.mesh();
    let (surface, _) = scene.grid.surface(&scene.interface, scene.element.is_simplex(), scene.areal_mass());
    let pattern = BlockPattern::new(&mesh);
    let d = mesh.dimension;
    let numbers = 20 * mesh.node_count() * d + 4 * pattern.block_count() * d * d;
    let bytes = 8 * numbers + 4 * pattern.element_block.len() + 8 * mesh.connectivity.len();
    let courant = scene.wave_speed() * dt / scene.smallest_cell();
    let method = if settings.is_static { LinearMethod::Cholesky } else { LinearMethod::for_courant(courant) };
    let mut line = |name: &str, value: f64, remark: &str| plan.push(PlanFigure::new(name, value, remark));
    line("solid_nodes", mesh.node_count() as f64, "");
    line("solid_elements", mesh.element_count() as f64, scene.element.name());
    line("surface_nodes", surface.node_count() as f64, "interface nodes of the solid");
    line("solid_memory_bytes", bytes as f64, "without a factor");
    line("solid_courant", courant, &format!("c dt / h at the largest step: {}", method.name()));
}

/// What only the static start can tell: whether the body carries its weight, and how it swings.
fn start_figures(case: &CaseFile, settings: &Settings, plan: &mut Vec<PlanFigure>) {
    let scene = &settings.scene;
    if scene.grid.node_count() > CHECKED_NODES {
        return;
    }
    match Solid::new(scene.clone()).and_then(|mut solid| solid.first_frequency()) {
        Ok(frequency) => {
            plan.push(PlanFigure::new("first_frequency_hz", frequency, "of the dry body under its weight"))
        }
        Err(error) => {
            if let Some(section) = case.section("solid") {
                let hint = "Raise young_modulus or the thickness, take less slender elements, or set weight = false.";
                section.complain("young_modulus", format!("no equilibrium at the start: {error}"), "", hint);
            }
        }
    }
}

fn absences(settings: &Settings, dt: f64, left_out: &mut Vec<LeftOut>) {
    let scene = &settings.scene;
    if scene.gravity == [0.0; 3] {
        left_out.push(LeftOut::new("self-weight", "no gravity, or weight = false"));
    }
    if scene.damping == 0.0 {
        left_out.push(LeftOut::new("structural damping", "damping = 0"));
    }
    if settings.is_static {
        left_out.push(LeftOut::new("inertia of the solid", "analysis = \"static\""));
    } else if LinearMethod::for_courant(scene.wave_speed() * dt / scene.smallest_cell())
        == LinearMethod::JacobiConjugateGradient
    {
        left_out.push(LeftOut::new("factorisation per step", "the mass dominates: c dt / h is below 20"));
    }
}
