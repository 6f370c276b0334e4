//! The section `[solid]` of the case file, for `model = "fem"`: case as written to scene as resolved.

mod body;
mod check;
mod geometry;
mod load;
mod numerics;

use protocol::case::{BoxRegion, CaseFile, Section, Shared, SolidOutline, face_names, read_clamped};

use crate::box_grid::BoxGrid;
use crate::scene::Scene;

pub use check::check;

/// Keys of an elastic body, which a rigid one has no use for.
pub(crate) const ELASTIC_KEYS: [&str; 21] = [
    "young_modulus",
    "poisson_ratio",
    "material",
    "hardening",
    "kinematics",
    "plane",
    "damping",
    "stiffness_damping",
    "element",
    "integrator",
    "rho_inf",
    "newmark_gamma",
    "newmark_beta",
    "newton_tolerance",
    "max_dt",
    "rollers",
    "support",
    "weight",
    "analysis",
    "start",
    "load",
];

/// What is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Analysis {
    /// Motion in time.
    Dynamic,
    /// A static equilibrium at the end of every step, inertia left out.
    Static,
    /// Natural frequencies and mode shapes: the step n is the mode n.
    Modes,
}

impl Analysis {
    /// Names in the case file, in the order of the variants.
    pub const NAMES: [&'static str; 3] = ["dynamic", "static", "modes"];
    const ALL: [Self; 3] = [Self::Dynamic, Self::Static, Self::Modes];

    /// Its name in the case file.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

/// How the solid is computed.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The scene.
    pub scene: Scene,
    /// What is computed.
    pub analysis: Analysis,
    /// The run starts from the unloaded body at rest, not from its equilibrium under the weight.
    pub starts_unloaded: bool,
}

impl Settings {
    /// Reads `[solid]`, booking mistakes in the case file; `None` if the scene has no elastic solid.
    pub fn read(case: &CaseFile, shared: &Shared) -> Option<Self> {
        let outline = shared.solid.as_ref().filter(|outline| outline.model == "fem")?;
        let section = case.section("solid")?;
        let dimension = shared.header.dimension;
        let clamped = skip_outline(&section, dimension, outline.mesh.is_some());
        let mut scene = match &outline.mesh {
            None => Scene::of_box(grid(outline), 1.0, 1.0, 0.0),
            Some(file) => geometry::read_mesh(case, &section, outline, file)?,
        };
        geometry::check_place(&section, shared, outline);
        body::read_material(&section, &mut scene);
        numerics::read(&section, &mut scene);
        if !geometry::fit_mesh(&section, &mut scene) {
            return None;
        }
        let faces = body::read_supports(&section, clamped, &mut scene);
        body::read_weight(&section, shared, &mut scene);
        let analysis = section.choice("analysis", &Analysis::NAMES);
        let analysis = analysis
            .about(
                "dynamic: motion in time; static: an equilibrium at every step, inertia left out; modes: step n gives \
                 the n-th natural frequency and its shape, with max_dt = 1 and end = the number of modes.",
            )
            .default("dynamic");
        let start = section.choice("start", &["equilibrium", "unloaded"]);
        let start = start
            .about("equilibrium: at rest under the weight; unloaded: the body as drawn, released at time 0.")
            .default("equilibrium");
        load::read_all(&section, &faces, &mut scene);
        section.finish();
        (scene.interface, scene.wet_sides) = (outline.interface_faces(), outline.wet_sides());
        let index = Analysis::NAMES.iter().position(|&name| name == analysis).unwrap_or_default();
        Some(Self { scene, analysis: Analysis::ALL[index], starts_unloaded: start == "unloaded" })
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

/// Asks for the keys of the outline, which [`Shared::read`] has read, so that they are known here too; gives the faces
/// that are held.
pub(crate) fn skip_outline(section: &Section<'_>, dimension: usize, is_meshed: bool) -> Vec<String> {
    let faces = face_names(dimension);
    let _ = section.choice("model", &["fem", "rigid", "none"]).about("Kind of solid.").default("fem");
    let _ = section.text("mesh").about("Mesh file.").optional();
    if !is_meshed || section.has("min") || section.has("max") {
        let _ = BoxRegion::read(section, dimension, "the unloaded body");
    }
    let _ = section.vector("elements", dimension, "", "Elements along each axis (default: one each).");
    if section.has("wet") {
        let _ = section.choice("wet", faces).about("Faces the water may touch.").list(&[]);
    }
    let clamped = read_clamped(section, dimension, is_meshed);
    let _ = section.number("density").unit("kg/m3").above(0.0).about("Density of the body.").optional();
    let _ = section.text("program").about("Another executable in the solid's place.").optional();
    clamped
}
