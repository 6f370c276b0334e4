//! `[coupling]`: the coupler's own section of the case, and its part of the plan.

use protocol::case::{CaseFile, CheckReport, LeftOut, PlanFigure, Shared};

use crate::added_mass;
use crate::dummy_mesh::DummyMesh;

/// How the two solvers take turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheme {
    /// The single-pass Robin wall: the wall gives way to the pressure it has not yet felt.
    Robin,
    /// Conventional serial staggered with displacement prediction of this order (0 or 1), the paper's.
    Css {
        /// 0: x_n; 1: x_n + dt v_n.
        order: u8,
    },
}

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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OnGuard {
    /// The run goes on; the verdict stands in `run.json` and on the report.
    Warn,
    /// The run ends with the verdict.
    Stop,
}

/// `[coupling]`, resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// How the solvers take turns.
    pub scheme: Scheme,
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
}

impl Settings {
    /// Reads `[coupling]`; without the section all defaults hold.
    pub fn read(case: &CaseFile, shared: &Shared) -> Self {
        let section = case.section_or_default("coupling");
        let scheme = section
            .choice("scheme", &["robin", "css"])
            .about("robin: single pass, stable at any mass ratio; css: conventional serial staggered (the paper's).")
            .default("robin");
        let order = section
            .integer("prediction_order")
            .at_least(0.0)
            .at_most(1.0)
            .about("css only: order of the displacement prediction; the paper does not state its own.");
        let scheme = match (scheme.as_str(), section.has("prediction_order")) {
            ("css", _) => Scheme::Css { order: order.default(1.0) as u8 },
            (_, false) => Scheme::Robin,
            (_, true) => {
                order.optional();
                section.complain(
                    "prediction_order",
                    "is for scheme = \"css\" only",
                    "absent with scheme = \"robin\"",
                    "The Robin wall predicts nothing: it stands at the solid's true position.",
                );
                Scheme::Robin
            }
        };
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
        let on_guard = section
            .choice("on_guard", &["warn", "stop"])
            .about("What a tripped stability guard does; the verdict is recorded either way.")
            .default("warn");
        let dimension = shared.header.dimension;
        let solid_elements = shared.solid.as_ref().map(|solid| solid.elements.clone()).unwrap_or_default();
        let dummy_elements = section
            .vector(
                "dummy_elements",
                dimension,
                "",
                "Cells of the fluid's side of the interface along each axis (default: the solid's elements).",
            )
            .map_or(solid_elements, |counts| counts.iter().map(|&count| count.max(1.0) as usize).collect());
        let window = section
            .pair("ledger_window", "s", "Window of the mean load jump (default: the whole run).")
            .unwrap_or((0.0, f64::INFINITY));
        section.finish();
        Self {
            scheme,
            load: if load == "pair" { LoadForm::Pair } else { LoadForm::Markers },
            mapping: match mapping.as_str() {
                "identity" => MappingKind::Identity,
                "nearest" => MappingKind::Nearest,
                "rbf" => MappingKind::Rbf,
                _ => MappingKind::Projection,
            },
            robin_factor,
            on_guard: if on_guard == "stop" { OnGuard::Stop } else { OnGuard::Warn },
            dummy_elements,
            ledger_window: window,
        }
    }
}

/// The coupler's answer to `--check`.
pub fn check(case: &CaseFile) -> CheckReport {
    let shared = Shared::read(case);
    let settings = Settings::read(case, &shared);
    let (mut plan, mut left_out) = (Vec::new(), Vec::new());
    if let (Some(solid), true) = (&shared.solid, case.diagnostics().is_empty()) {
        let mesh = DummyMesh::span(solid, &settings.dummy_elements);
        plan.push(PlanFigure::new(
            "dummy_nodes",
            mesh.node_count() as f64,
            "interface nodes on the fluid's side",
        ));
        plan.push(PlanFigure::new("markers", mesh.facets().markers().len() as f64, "interface markers"));
        if let Some(estimate) = added_mass::estimate(&shared) {
            plan.push(PlanFigure::new(
                "added_mass_ratio",
                estimate,
                added_mass::meaning(estimate, settings.scheme),
            ));
        }
        if settings.scheme != Scheme::Robin {
            left_out.push(LeftOut::new("Robin wall", "the case pins the conventional staggered scheme"));
        } else if solid.model == "fem" {
            left_out
                .push(LeftOut::new("displacement prediction", "the Robin wall stands at the true position"));
        }
        left_out.push(LeftOut::new("sub-iterations", "one pass a step is enough for the scheme chosen"));
    }
    CheckReport::new("coupler", case, plan, left_out)
}
