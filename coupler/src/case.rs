//! `[coupling]`: the coupler's own section of the case, and its part of the plan.

use std::path::{Path, PathBuf};

use protocol::case::{
    CaseFile, CheckReport, FluidSide, LeftOut, PlanFigure, Scheme, Section, Shared, Side, SolidOutline,
};
use protocol::header::Kind;
use serde::{Deserialize, Serialize};

use crate::acceleration::{Acceleration, Aitken, Imvj, IqnIls, Reuse};
use crate::added_mass;
use crate::dummy_mesh::DummyMesh;
use crate::passes::{Agreement, Passes};
use crate::record::Recording;

/// What loads the solid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoadForm {
    /// Minus the sum of pair forces on the water: exact in momentum.
    Pair,
    /// The traction field of the interface markers, the paper's.
    Markers,
}

/// How the fluid's side is tied to the solid's surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MappingKind {
    /// Node for node.
    Identity,
    /// Nearest projection on the solid's facets; its transpose for loads.
    Projection,
    /// Nearest node.
    Nearest,
    /// Radial basis functions with a linear polynomial.
    Rbf,
}

/// What happens when a guard trips.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum OnGuard {
    /// Another scheme takes over: the Robin wall from a staggered one, passes from the Robin wall.
    Escalate,
    /// The run goes on; the verdict stands in `run.json` and on the report.
    Warn,
    /// The run ends with the verdict.
    Stop,
}

/// `[coupling]`, resolved.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The scheme chosen.
    pub scheme: Scheme,
    /// Of the displacement, for the schemes that predict it.
    pub prediction_order: u8,
    /// Of the strong scheme, and of steps that are escalated.
    pub passes: Option<Passes>,
    /// What loads the solid.
    pub load: LoadForm,
    /// How the sides are tied.
    pub mapping: MappingKind,
    /// sigma of the Robin wall.
    pub robin_factor: f64,
    /// What a tripped guard does.
    pub on_guard: OnGuard,
    /// Elements of the dummy mesh along each axis; one across the wall always.
    pub dummy_elements: Vec<usize>,
    /// Window of the mean load jump, s.
    pub ledger_window: (f64, f64),
    /// Whether what travels is recorded.
    pub record: bool,
    /// A recording in the place of one side.
    pub replay: Option<(PathBuf, Side)>,
}

impl Settings {
    /// Reads `[coupling]`; without the section all defaults hold.
    pub fn read(case: &CaseFile, shared: &Shared) -> Self {
        let section = case.section_or_default("coupling");
        // Read by all, as it decides the turns.
        section.pass_over(&["scheme", "fluid_side", "replay", "replay_of"]);
        let prediction_order = read_prediction_order(&section, shared.scheme);
        let on_guard = read_on_guard(&section);
        let passes = read_passes(&section, shared.scheme == Scheme::Strong || on_guard == OnGuard::Escalate);
        let load = section
            .choice("load", &["pair", "markers"])
            .about("pair: pair reaction, exact in momentum; markers: traction from the marker pressures (the paper's).")
            .default("pair");
        let mapping = section
            .choice("mapping", &["projection", "identity", "nearest", "rbf"])
            .about(
                "projection: nearest projection, any two meshes; identity: node for node; nearest: nearest node, does \
                 not keep the moment; rbf: radial basis functions, smooth between the nodes, for up to 4000 of them. \
                 Loads always go by the transpose.",
            )
            .default("projection");
        let robin_factor = section
            .number("robin_factor")
            .above(0.0)
            .at_most(2.0)
            .about("Share of the wall's mass that gives way; 0.25 to 1 is good, 2 noisy, 4 unstable.")
            .default(0.5);
        let dimension = shared.header.dimension;
        let solid_elements = shared.solid.as_ref().map(SolidOutline::interface_elements).unwrap_or_default();
        let has_mesh = shared.fluid_side == FluidSide::DummyMesh;
        let is_foreign = case.section("fluid").is_some_and(|fluid| fluid.has("program"));
        if mapping == "identity" && !has_mesh && !is_foreign {
            let what = "wall particles lie inside the structure, not on its nodes";
            section.complain("mapping", what, "\"projection\", \"rbf\"", "");
        }
        let why = "The fluid offers points: fluid_side = \"points\".";
        let dummy_elements = read_if(&section, has_mesh, "dummy_elements", why, || {
            section.vector(
                "dummy_elements",
                dimension,
                "",
                "Cells of the fluid's side of the interface along each axis (default: the solid's elements, twice as many where \
                 these have nodes in the middle of their edges).",
            )
        });
        let dummy_elements = dummy_elements
            .flatten()
            .map_or(solid_elements, |counts| counts.iter().map(|&count| count.max(1.0) as usize).collect());
        let window = section
            .pair("ledger_window", "s", "Window of the mean load jump (default: the whole run).")
            .unwrap_or((0.0, f64::INFINITY));
        let record = section.flag(
            "record",
            false,
            "Write what travels over the interface to interface.rec in the run folder, for replay.",
        );
        section.finish();
        let folder = case.path().parent().unwrap_or(Path::new("."));
        let replay = shared.replay.as_ref().map(|replay| (folder.join(&replay.file), replay.side));
        Self {
            scheme: choose_scheme(shared, on_guard, prediction_order),
            prediction_order,
            passes,
            load: if load == "pair" { LoadForm::Pair } else { LoadForm::Markers },
            mapping: match mapping.as_str() {
                "identity" => MappingKind::Identity,
                "nearest" => MappingKind::Nearest,
                "rbf" => MappingKind::Rbf,
                _ => MappingKind::Projection,
            },
            robin_factor,
            on_guard,
            dummy_elements,
            ledger_window: window,
            record,
            replay,
        }
    }
}

/// The scheme for the steps of a run: that of the case; where the guard may change it, one that the water is not too
/// heavy for.
fn choose_scheme(shared: &Shared, on_guard: OnGuard, prediction_order: u8) -> Scheme {
    let is_free = on_guard == OnGuard::Escalate
        && shared.replay.is_none()
        && matches!(shared.scheme, Scheme::Css | Scheme::Robin);
    let Some(ratio) = added_mass::estimate(shared).filter(|_| is_free) else { return shared.scheme };
    let is_soft = added_mass::softness(shared).is_some_and(|softness| softness > added_mass::SOFT);
    if is_soft || ratio > added_mass::ROBIN_LIMIT {
        Scheme::Strong
    } else if ratio > added_mass::css_limit(prediction_order) {
        Scheme::Robin
    } else {
        shared.scheme
    }
}

/// Keys that only some schemes have a use for are refused with the others.
fn read_if<T>(
    section: &Section<'_>,
    wanted: bool,
    key: &str,
    why: &str,
    read: impl FnOnce() -> T,
) -> Option<T> {
    if wanted {
        return Some(read());
    }
    if !section.pass_over(&[key]).is_empty() {
        section.complain(key, "has no use here", "absent", why);
    }
    None
}

/// A scheme the case asks for is obeyed; one it does not ask for may be changed.
fn read_on_guard(section: &Section<'_>) -> OnGuard {
    let is_pinned = section.has("scheme");
    let word = section.choice("on_guard", &["escalate", "warn", "stop"]).about(
        "What a restless load (load jump above 0.5, or growth with alternating sign) leads to. escalate: from css and \
         parallel to robin, from robin to passes for the steps that need them; each is counted and reported; the default \
         where scheme is not written. warn: the verdict is recorded; the default where it is. stop: the run ends.",
    );
    match word.default(if is_pinned { "warn" } else { "escalate" }).as_str() {
        "escalate" => OnGuard::Escalate,
        "stop" => OnGuard::Stop,
        _ => OnGuard::Warn,
    }
}

fn read_prediction_order(section: &Section<'_>, scheme: Scheme) -> u8 {
    let wanted = matches!(scheme, Scheme::Css | Scheme::Parallel);
    let why =
        "Only css and parallel predict the displacement; the Robin wall stands at the solid's true position.";
    let order = read_if(section, wanted, "prediction_order", why, || {
        let order = section.integer("prediction_order").at_least(0.0).at_most(2.0).about(
            "css, parallel: order of the displacement prediction, u | u + dt v | u + dt (3 v - v_before) / 2; the \
             paper does not state its own.",
        );
        order.default(1.0) as u8
    });
    order.unwrap_or(1)
}

fn read_passes(section: &Section<'_>, wanted: bool) -> Option<Passes> {
    let why = "It belongs to scheme = \"strong\" and to on_guard = \"escalate\".";
    let method = read_if(section, wanted, "acceleration", why, || {
        let choice = section.choice("acceleration", &["iqn-ils", "imvj", "aitken", "fixed"]).about(
            "strong: from one pass to the next; iqn-ils: interface quasi-Newton, least squares over the last steps; imvj: \
             the same with a Jacobian that each step corrects; aitken: changing relaxation; fixed: constant relaxation, \
             slow or unstable with a heavy fluid.",
        );
        choice.default("iqn-ils")
    });
    let relaxation = read_if(section, wanted, "relaxation", why, || {
        let number = section.number("relaxation").above(0.0).at_most(1.0).about(
            "strong: relaxation of the first correction, with acceleration = \"fixed\" of all of them.",
        );
        number.default(0.1)
    });
    let reused_steps = read_if(section, wanted && is_newton(method.as_deref()), "reused_steps", why, || {
        let number = section
            .integer("reused_steps")
            .at_least(0.0)
            .at_most(100.0)
            .about("iqn-ils, imvj: steps whose passes serve the next ones.");
        number.default(10.0) as usize
    });
    let tolerance = read_if(section, wanted, "tolerance", why, || {
        let number = section.number("tolerance").at_least(1e-4).at_most(0.1).about(
            "strong: |x~ - x| over max(|x~ - u_n|, 0.01 |x~|) at which a step stands. The pressure solve must be ten \
             times tighter.",
        );
        number.default(1e-3)
    });
    let most_passes = read_if(section, wanted, "most_passes", why, || {
        let number = section
            .integer("most_passes")
            .at_least(1.0)
            .at_most(1000.0)
            .about("strong: after so many passes a step stands as it is, and is counted.");
        number.default(30.0) as u32
    });
    let (method, relaxation) = (method?, relaxation?);
    let reuse = Reuse { steps: reused_steps.unwrap_or_default(), first_relaxation: relaxation };
    let acceleration = match method.as_str() {
        "fixed" => Acceleration::Fixed { relaxation },
        "aitken" => Acceleration::Aitken(Aitken::new(relaxation)),
        "imvj" => Acceleration::Imvj(Imvj::new(reuse)),
        _ => Acceleration::IqnIls(IqnIls::new(reuse)),
    };
    let agreement = Agreement { tolerance: tolerance?, most_passes: most_passes? };
    Some(Passes::new(agreement, acceleration))
}

fn is_newton(method: Option<&str>) -> bool {
    matches!(method, Some("iqn-ils" | "imvj"))
}

/// The coupler's answer to `--check`.
pub fn check(case: &CaseFile) -> CheckReport {
    let shared = Shared::read(case);
    let settings = Settings::read(case, &shared);
    let replay = open_replay(&settings);
    complain_of_replay(case, &shared, replay.as_ref());
    let (mut plan, mut left_out) = (Vec::new(), Vec::new());
    if let (Some(solid), true) = (&shared.solid, case.diagnostics().is_empty()) {
        plan.extend(interface_figures(solid, &shared, &settings));
        if let Some((Ok(recording), side)) = &replay {
            plan.extend(recorded_size(recording, *side));
        }
        if let Some(estimate) = added_mass::estimate(&shared) {
            plan.push(PlanFigure::new(
                "added_mass_ratio",
                estimate,
                added_mass::meaning(estimate, &settings),
            ));
        }
        if let Some(softness) = added_mass::softness(&shared).filter(|softness| *softness > added_mass::SOFT)
        {
            let meaning = "pressure of the water at rest over Young's modulus; above 0.02 the wall does not move as one mass: \
                           passes where the scheme is free";
            plan.push(PlanFigure::new("softness", softness, meaning));
        }
        if shared.fluid_side == FluidSide::Points {
            left_out.push(LeftOut::new("dummy mesh", "the fluid offers points of its own"));
        }
        left_out.extend(not_needed(&settings, solid.model == "rigid"));
    }
    CheckReport::new("coupler", case, plan, left_out).with_state()
}

/// Sizes of the dummy mesh; points are the fluid's to count.
fn interface_figures(solid: &SolidOutline, shared: &Shared, settings: &Settings) -> Vec<PlanFigure> {
    if shared.fluid_side == FluidSide::Points {
        return Vec::new();
    }
    let mesh = DummyMesh::span(solid, &settings.dummy_elements);
    let (nodes, markers) = (mesh.node_count() as f64, mesh.facets().markers().len() as f64);
    vec![
        PlanFigure::new("dummy_nodes", nodes, "interface nodes on the fluid's side"),
        PlanFigure::new("markers", markers, "interface markers"),
    ]
}

/// What the program that is not started would have said.
fn recorded_size(recording: &Recording, side: Side) -> Option<PlanFigure> {
    match (side, recording.points()) {
        (Side::Solid, _) => {
            let nodes = recording.surface().node_count() as f64;
            Some(PlanFigure::new("surface_nodes", nodes, "interface nodes of the recorded solid"))
        }
        (Side::Fluid, Some(points)) => {
            Some(PlanFigure::new("interface_points", points.len() as f64, "points of the recorded fluid"))
        }
        (Side::Fluid, None) => None,
    }
}

fn complain_of_replay(case: &CaseFile, shared: &Shared, replay: Option<&(Result<Recording, String>, Side)>) {
    let section = case.section_or_default("coupling");
    match replay {
        Some((Err(what), _)) => {
            let hint = "Make one with coupling.record = true.";
            section.complain("replay", what, "interface.rec of a run", hint);
        }
        Some((Ok(recording), Side::Fluid)) => {
            let recorded = if recording.points().is_some() { "points" } else { "dummy_mesh" };
            if (recorded == "points") != (shared.fluid_side == FluidSide::Points) {
                let what = format!("the recorded fluid had its side as {recorded}");
                section.complain("fluid_side", what, recorded, "");
            }
        }
        _ => (),
    }
}

/// The recording in the place of one side, or what is wrong with it.
pub(crate) fn open_replay(settings: &Settings) -> Option<(Result<Recording, String>, Side)> {
    let (path, side) = settings.replay.as_ref()?;
    let kind = if *side == Side::Fluid { Kind::Load } else { Kind::Motion };
    Some((Recording::open(path, kind), *side))
}

fn not_needed(settings: &Settings, is_rigid: bool) -> Vec<LeftOut> {
    if is_rigid {
        return vec![LeftOut::new("coupling scheme", "a rigid body does not respond to the water")];
    }
    let mut left_out = Vec::new();
    if settings.scheme != Scheme::Robin && settings.on_guard != OnGuard::Escalate {
        left_out.push(LeftOut::new("Robin wall", "the case pins another scheme"));
    }
    if !matches!(settings.scheme, Scheme::Css | Scheme::Parallel) {
        left_out.push(LeftOut::new("displacement prediction", "the scheme does not look ahead by it"));
    }
    if settings.scheme != Scheme::Strong {
        let why = match settings.on_guard {
            OnGuard::Escalate => "one pass a step is enough until the guard finds the load restless",
            OnGuard::Warn | OnGuard::Stop => "one pass a step is enough for the scheme chosen",
        };
        left_out.push(LeftOut::new("sub-iterations", why));
    }
    left_out
}
