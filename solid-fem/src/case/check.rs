//! `solid-fem --check`: the mistakes only the body as a whole shows, and the plan.

use protocol::case::{CaseFile, CheckReport, GaugeKind, LeftOut, PlanFigure, Shared};

use super::{Analysis, Settings};
use crate::linear::LinearMethod;
use crate::linear::block_matrix::BlockPattern;
use crate::mesh::Mesh;
use crate::modes::Mode;
use crate::probe::Probe;
use crate::solid::Solid;
use crate::surface;

/// Above this number of nodes the check leaves out the static start and the first frequency: they take seconds.
const CHECKED_NODES: usize = 12_000;

/// The answer of `solid-fem --check`.
pub fn check(case: &CaseFile) -> CheckReport {
    let shared = Shared::read(case);
    let settings = Settings::read(case, &shared);
    let (mut plan, mut left_out) = (Vec::new(), Vec::new());
    if let Some(settings) = settings.filter(|_| case.diagnostics().is_empty()) {
        let mesh = settings.scene.mesh();
        check_gauges(case, &shared, &mesh, settings.analysis);
        check_modes(case, &shared, settings.analysis);
        figures(&settings, &mesh, shared.time.max_dt, &mut plan);
        start_figures(case, &settings, &mut plan);
        absences(&settings, shared.time.max_dt, &mut left_out);
    }
    CheckReport::new("solid-fem", case, plan, left_out).with_state()
}

/// The steps of an analysis of modes are its modes.
fn check_modes(case: &CaseFile, shared: &Shared, analysis: Analysis) {
    let (count, step) = (shared.time.end, shared.time.max_dt);
    let is_whole = step == 1.0 && count >= 1.0 && count.fract() == 0.0;
    if analysis != Analysis::Modes {
        return;
    }
    if let Some(section) = case.section("time").filter(|_| !is_whole) {
        let what = format!("{count} in steps of {step} is no number of modes");
        section.complain("end", what, "a whole number, with max_dt = 1", "Step n gives mode n.");
    }
    if let Some(section) = case.section("solid").filter(|_| shared.fluid.is_some()) {
        section.complain("analysis", "modes are those of a dry body", "without [fluid]", "");
    }
}

/// A point to be recorded must lie in the body.
fn check_gauges(case: &CaseFile, shared: &Shared, mesh: &Mesh, analysis: Analysis) {
    for (section, gauge) in case.list("gauge").iter().zip(&shared.gauges) {
        let is_of_modes = match &gauge.kind {
            GaugeKind::Frequency => Some(true),
            GaugeKind::Reaction => Some(false),
            GaugeKind::Energy { of } if of == "solid" => Some(false),
            _ => None,
        };
        if is_of_modes.is_some_and(|needed| needed != (analysis == Analysis::Modes)) {
            let what = format!("analysis = \"{}\" gives nothing to record here", analysis.name());
            section.complain("kind", what, "frequency and displacement with \"modes\", else the others", "");
        }
        let GaugeKind::Displacement { point } = &gauge.kind else { continue };
        if Probe::at(mesh, point).is_none() {
            let (low, high) = mesh.bounding_box();
            let allowed = format!("{:?} .. {:?}", &low[..mesh.dimension], &high[..mesh.dimension]);
            section.complain("point", format!("{point:?} lies outside the solid"), &allowed, "");
        }
    }
}

fn figures(settings: &Settings, mesh: &Mesh, dt: f64, plan: &mut Vec<PlanFigure>) {
    let scene = &settings.scene;
    let (surface, _) = surface::interface(mesh, &scene.interface, scene.areal_mass());
    let pattern = BlockPattern::new(mesh);
    let d = mesh.dimension;
    let numbers = 20 * mesh.node_count() * d + 4 * pattern.block_count() * d * d;
    let bytes = 8 * numbers + 4 * pattern.element_block.len() + 8 * mesh.connectivity.len();
    let courant = scene.wave_speed() * dt / scene.smallest_cell();
    let is_dynamic = settings.analysis == Analysis::Dynamic;
    let method = if is_dynamic { LinearMethod::for_courant(courant) } else { LinearMethod::Cholesky };
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
    if scene.mesh().node_count() > CHECKED_NODES {
        return;
    }
    let solid =
        if settings.starts_unloaded { Solid::in_reference(scene.clone()) } else { Solid::new(scene.clone()) };
    match solid.and_then(|mut solid| solid.modes(1)) {
        Ok(modes) => {
            let remark = "of the dry body under its weight";
            let figure = |mode: &Mode| PlanFigure::new("first_frequency_hz", mode.frequency, remark);
            plan.extend(modes.first().map(figure));
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
    if scene.damping == 0.0 && scene.stiffness_damping == 0.0 {
        left_out.push(LeftOut::new("structural damping", "damping = 0 and stiffness_damping = 0"));
    }
    if scene.substance.is_linear() {
        left_out.push(LeftOut::new("tangent per step", "linear kinematics and material: assembled once"));
    }
    if settings.analysis == Analysis::Static {
        left_out.push(LeftOut::new("inertia of the solid", "analysis = \"static\""));
    } else if LinearMethod::for_courant(scene.wave_speed() * dt / scene.smallest_cell())
        == LinearMethod::JacobiConjugateGradient
    {
        left_out.push(LeftOut::new("factorisation per step", "the mass dominates: c dt / h is below 20"));
    }
}
