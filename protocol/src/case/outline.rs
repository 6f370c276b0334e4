//! The parts of `[solid]` and `[fluid]` that the other programs must know.

use super::domain::{BoxFace, BoxRegion, Domain, face_names, faces};
use super::section::Section;
use super::tree::Value;

/// Elements with nodes in the middle of their edges.
const QUADRATIC: [&str; 4] = ["tri6", "quad8", "tet10", "hex20"];

/// The part of `[solid]` the fluid and the coupler must know.
#[derive(Debug, Clone, PartialEq)]
pub struct SolidOutline {
    /// `fem` or `rigid`.
    pub model: String,
    /// The unloaded body; all zero where a mesh file gives it and no water needs to know.
    pub region: BoxRegion,
    /// Mesh file of the body, relative to the case, in place of a box of elements.
    pub mesh: Option<String>,
    /// Elements along each axis.
    pub elements: Vec<usize>,
    /// Whether these have nodes in the middle of their edges.
    pub has_middle_nodes: bool,
    /// Faces the water may touch.
    pub wet: Vec<BoxFace>,
    /// Faces that are held.
    pub clamped: Vec<BoxFace>,
    /// Density, kg/m3; not needed for a rigid body.
    pub density: Option<f64>,
    /// Young's modulus, Pa; not needed for a rigid body.
    pub young_modulus: Option<f64>,
    /// Whether the motion is known beforehand (rigid body with `[solid.motion]`).
    pub prescribed: bool,
}

impl SolidOutline {
    /// The axis across the wall: the shortest edge of the body.
    pub fn thickness_axis(&self) -> usize {
        let shorter = |&a: &usize, &b: &usize| self.region.length(a).total_cmp(&self.region.length(b));
        (0..self.region.min.len()).min_by(shorter).expect("a body has axes")
    }

    /// Faces whose nodes are interface nodes: the wet ones and both faces across the wall, so that the fluid can span
    /// its cells from one face to the other; a dry one gets no load because no water is near.
    pub fn interface_faces(&self) -> Vec<BoxFace> {
        let axis = self.thickness_axis();
        let dimension = self.region.min.len();
        let faces = BoxFace::ALL.into_iter().take(2 * dimension);
        faces.filter(|face| face.axis() == axis || self.wet.contains(face)).collect()
    }

    /// Pieces along each axis between one interface node and the next.
    pub fn interface_elements(&self) -> Vec<usize> {
        let pieces = if self.has_middle_nodes { 2 } else { 1 };
        self.elements.iter().map(|count| pieces * count).collect()
    }

    /// Number of wet faces across the wall: 0, 1 or 2.
    pub fn wet_sides(&self) -> usize {
        let axis = self.thickness_axis();
        self.wet.iter().filter(|face| face.axis() == axis).count()
    }
}

/// The part of `[fluid]` the coupler must know.
#[derive(Debug, Clone, PartialEq)]
pub struct FluidOutline {
    /// Reference density, kg/m3.
    pub density: f64,
    /// Boxes of water at the start.
    pub regions: Vec<BoxRegion>,
}

pub(super) fn read_outline(
    section: &Section<'_>,
    dimension: usize,
    domain: &Option<Domain>,
    has_fluid: bool,
) -> Option<SolidOutline> {
    let model = section
        .choice("model", &["fem", "rigid", "none"])
        .about("fem: elastic, by finite elements; rigid: fixed or with a prescribed motion; none: no solid.")
        .default("fem");
    if model == "none" {
        return None;
    }
    let mesh = section
        .text("mesh")
        .about(
            "fem: mesh file in m, relative to the case (Gmsh MSH 2.2 or 4.1, Abaqus/CalculiX deck), in place of elements; \
             min and max are then needed beside water only, where the body must fill that box.",
        )
        .optional();
    let is_meshed = mesh.is_some() && model == "fem";
    let region = if is_meshed && !has_fluid && !section.has("min") && !section.has("max") {
        BoxRegion { min: vec![0.0; dimension], max: vec![0.0; dimension] }
    } else {
        BoxRegion::read(section, dimension, "the unloaded body")
    };
    let default = vec![1.0; dimension];
    let elements = section
        .vector("elements", dimension, "", "Elements along each axis (default: one each).")
        .unwrap_or(default);
    if elements.iter().any(|&count| count < 1.0 || count.fract() != 0.0 || count > 1e6) {
        section.complain("elements", format!("{elements:?} is not allowed"), "whole numbers >= 1", "");
    }
    let elements = elements.iter().map(|&count| count.clamp(1.0, 1e6) as usize).collect();
    let default = default_wet_faces(&region, dimension, domain);
    let wet = section
        .choice("wet", face_names(dimension))
        .about("Faces the water may touch (default: all that do not lie in a face of the domain).")
        .list(&default);
    let clamped = read_clamped(section, dimension, is_meshed);
    let density = section.number("density").unit("kg/m3").above(0.0).about("Density of the body.").optional();
    let prescribed = model == "rigid" && section.has("motion");
    let (wet, clamped) = (faces(&wet), faces(&clamped));
    let has_middle_nodes =
        matches!(section.peek("element"), Some(Value::Text(name)) if QUADRATIC.contains(&name.as_str()));
    let young_modulus = match section.peek("young_modulus") {
        Some(&Value::Float(value)) => Some(value),
        Some(&Value::Integer(value)) => Some(value as f64),
        _ => None,
    };
    Some(SolidOutline {
        model,
        region,
        mesh,
        elements,
        has_middle_nodes,
        wet,
        clamped,
        density,
        young_modulus,
        prescribed,
    })
}

/// The names of the faces that are held; a mesh file may name its own.
pub fn read_clamped(section: &Section<'_>, dimension: usize, is_meshed: bool) -> Vec<String> {
    let names = if is_meshed { &[] } else { face_names(dimension) };
    section
        .choice("clamped", names)
        .about("Faces that are held; of a mesh file also its named surfaces and sets of nodes.")
        .list(&[])
}

pub(super) fn read_fluid_outline(section: &Section<'_>, dimension: usize) -> FluidOutline {
    let density = section
        .number("density")
        .unit("kg/m3")
        .above(0.0)
        .about("Reference density of the water.")
        .default(1000.0);
    let regions = section.list("region");
    let regions = regions.iter().map(|region| BoxRegion::read(region, dimension, "a box of water")).collect();
    FluidOutline { density, regions }
}

fn default_wet_faces(region: &BoxRegion, dimension: usize, domain: &Option<Domain>) -> Vec<&'static str> {
    let lies_in_domain_face = |face: BoxFace| {
        let axis = face.axis();
        domain.as_ref().is_some_and(|domain| {
            let tolerance = 1e-9 * domain.region.length(axis).abs();
            if face.sign() < 0.0 {
                region.min[axis] <= domain.region.min[axis] + tolerance
            } else {
                region.max[axis] >= domain.region.max[axis] - tolerance
            }
        })
    };
    let faces = BoxFace::ALL.into_iter().take(2 * dimension);
    faces.filter(|&face| !lies_in_domain_face(face)).map(BoxFace::name).collect()
}
