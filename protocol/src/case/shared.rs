//! The sections several programs read: `[case]`, `[domain]`, `[gravity]`, `[time]`, `[output]`, and the outline of `[solid]`.

use serde::{Deserialize, Serialize};

use super::file::CaseFile;
use super::gauge::Gauge;
use super::prescribed::Prescribed;
use super::reference::Reference;
use super::scheme::Scheme;
use super::section::Section;

/// A face of an axis-aligned box; `y` points up, `z` along the depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BoxFace {
    /// -x
    Left = 0,
    /// +x
    Right = 1,
    /// -y
    Bottom = 2,
    /// +y
    Top = 3,
    /// -z
    Back = 4,
    /// +z
    Front = 5,
}

impl BoxFace {
    /// All faces, in the order of their numbers.
    pub const ALL: [Self; 6] = [Self::Left, Self::Right, Self::Bottom, Self::Top, Self::Back, Self::Front];
    /// Their names, in the same order; the first four exist in 2-D.
    pub const NAMES: [&'static str; 6] = ["left", "right", "bottom", "top", "back", "front"];

    /// The face of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().position(|&known| known == name).map(|index| Self::ALL[index])
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// The axis it is normal to: 0, 1 or 2.
    pub fn axis(self) -> usize {
        self as usize / 2
    }

    /// -1 for the face at the minimum of its axis, +1 for the one at the maximum.
    pub fn sign(self) -> f64 {
        if (self as usize).is_multiple_of(2) { -1.0 } else { 1.0 }
    }
}

/// An axis-aligned box, one number per dimension, m.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxRegion {
    /// Least corner.
    pub min: Vec<f64>,
    /// Greatest corner.
    pub max: Vec<f64>,
}

impl BoxRegion {
    /// Reads `min` and `max` of a section.
    pub fn read(section: &Section<'_>, dimension: usize, what: &str) -> Self {
        let min = section.required_vector("min", dimension, "m", &format!("Least corner of {what}."));
        let max = section.required_vector("max", dimension, "m", &format!("Greatest corner of {what}."));
        let written = section.has("min") && section.has("max");
        if written && min.iter().zip(&max).any(|(min, max)| min >= max) {
            section.complain(
                "max",
                format!("{max:?} is not greater than min = {min:?} in every direction"),
                "max > min",
                "Give both corners in metres.",
            );
        }
        Self { min, max }
    }

    /// Edge length along an axis, m.
    pub fn length(&self, axis: usize) -> f64 {
        self.max[axis] - self.min[axis]
    }
}

/// `[case]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// Name of the scene; the default run folder is called after it.
    pub name: String,
    /// 2 or 3.
    pub dimension: usize,
}

/// `[domain]`: the tank.
#[derive(Debug, Clone, PartialEq)]
pub struct Domain {
    /// The inside of the tank.
    pub region: BoxRegion,
    /// Faces without a wall.
    pub open: Vec<BoxFace>,
    /// Faces that are planes of symmetry: walls without friction.
    pub symmetry: Vec<BoxFace>,
    /// Axes along which the scene repeats itself: what leaves at one end enters at the other.
    pub periodic: Vec<bool>,
    /// Holes in the walls.
    pub openings: Vec<Opening>,
    /// Motion of the whole tank; everything is told in its frame.
    pub motion: Option<Prescribed>,
}

/// `[[domain.opening]]`: a hole in a wall.
#[derive(Debug, Clone, PartialEq)]
pub struct Opening {
    /// The wall.
    pub face: BoxFace,
    /// The hole; its extent across the wall does not matter.
    pub region: BoxRegion,
}

/// `[gravity]`: the body force per mass on water and structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Gravity {
    /// Acceleration, `[D]` m/s2.
    pub acceleration: Vec<f64>,
    /// Rows (time in s, factor), linear between them, constant outside; `None` is a constant 1.
    pub table: Option<Vec<(f64, f64)>>,
}

impl Gravity {
    /// The factor at a time.
    pub fn factor(&self, time: f64) -> f64 {
        self.table.as_deref().map_or(1.0, |table| interpolate(table, time))
    }
}

/// Linear interpolation in rows (abscissa, value), constant outside.
pub fn interpolate(table: &[(f64, f64)], at: f64) -> f64 {
    let after = table.partition_point(|row| row.0 <= at);
    match (after.checked_sub(1).map(|before| table[before]), table.get(after)) {
        (Some(low), Some(high)) => low.1 + (high.1 - low.1) * (at - low.0) / (high.0 - low.0),
        (Some(last), None) => last.1,
        (None, Some(first)) => first.1,
        (None, None) => 1.0,
    }
}

/// `[time]`.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeSettings {
    /// End of the run, s.
    pub end: f64,
    /// Largest coupling step, s.
    pub max_dt: f64,
    /// Whether every step has exactly `max_dt` (the fluid sub-steps inside when it must).
    pub pinned: bool,
    /// A process that does not answer a step for this long is given up, s.
    pub silence_limit: f64,
}

/// `[output]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Time between two frames of the fields, s; `None` writes no fields.
    pub fields_every: Option<f64>,
    /// Time between two rows of a series, s; 0 is every step.
    pub series_every: f64,
}

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
    /// Faces the water may touch.
    pub wet: Vec<BoxFace>,
    /// Faces that are held.
    pub clamped: Vec<BoxFace>,
    /// Density, kg/m3; not needed for a rigid body.
    pub density: Option<f64>,
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

/// Everything several programs read.
#[derive(Debug, Clone, PartialEq)]
pub struct Shared {
    /// `[case]`.
    pub header: Header,
    /// `[domain]`, where there is one.
    pub domain: Option<Domain>,
    /// `[gravity]`, where there is one.
    pub gravity: Option<Gravity>,
    /// `[time]`.
    pub time: TimeSettings,
    /// `[output]`.
    pub output: Output,
    /// `[[gauge]]`.
    pub gauges: Vec<Gauge>,
    /// `[[reference]]`.
    pub references: Vec<Reference>,
    /// The outline of `[solid]`, where there is a solid.
    pub solid: Option<SolidOutline>,
    /// The outline of `[fluid]`, where there is one.
    pub fluid: Option<FluidOutline>,
    /// `[coupling] scheme`; in a scene without coupling the default, which nobody asks for.
    pub scheme: Scheme,
}

/// Every section a case may have.
pub const SECTIONS: [&str; 11] = [
    "case",
    "domain",
    "obstacle",
    "gravity",
    "fluid",
    "solid",
    "coupling",
    "time",
    "output",
    "gauge",
    "reference",
];

impl Shared {
    /// Reads the shared sections, complaining about what is wrong in them.
    pub fn read(case: &CaseFile) -> Self {
        case.refuse_unknown_sections(&SECTIONS);
        let header = read_header(case);
        let dimension = header.dimension;
        let domain = case.section("domain").map(|section| read_domain(&section, dimension));
        let gravity = case.section("gravity").map(|section| read_gravity(&section, dimension));
        let time = read_time(case);
        let output = read_output(case);
        let gauges = Gauge::read_all(case, dimension);
        let references = Reference::read_all(case, &gauges);
        let has_fluid = case.section("fluid").is_some();
        let solid =
            case.section("solid").and_then(|section| read_outline(&section, dimension, &domain, has_fluid));
        let fluid = case.section("fluid").map(|section| read_fluid_outline(&section, dimension));
        let is_coupled = solid.is_some() && fluid.is_some();
        let scheme = if is_coupled { Scheme::read(case) } else { Scheme::default() };
        Self { header, domain, gravity, time, output, gauges, references, solid, fluid, scheme }
    }
}

fn read_header(case: &CaseFile) -> Header {
    let section = case.section_or_default("case");
    let name = section.text("name").about("Name of the scene; run folders are called after it.").required();
    let dimension = section
        .integer("dimension")
        .at_least(2.0)
        .at_most(3.0)
        .about("2: plane, everything per metre of depth; 3: in space. y points up, z along the depth.")
        .required() as usize;
    section.finish();
    Header { name, dimension: dimension.clamp(2, 3) }
}

fn faces(words: &[String]) -> Vec<BoxFace> {
    words.iter().filter_map(|word| BoxFace::from_name(word)).collect()
}

/// The names of the faces a box of this dimension has.
pub fn face_names(dimension: usize) -> &'static [&'static str] {
    &BoxFace::NAMES[..2 * dimension]
}

fn read_domain(section: &Section<'_>, dimension: usize) -> Domain {
    let region = BoxRegion::read(section, dimension, "the inside of the tank");
    let names = face_names(dimension);
    let open = faces(&section.choice("open", names).about("Faces without a wall.").list(&[]));
    let symmetry = section.choice("symmetry", names);
    let symmetry =
        faces(&symmetry.about("Faces that are planes of symmetry: walls without friction.").list(&[]));
    let axes = section.choice("periodic", &["x", "y", "z"][..dimension]);
    let axes = axes.about(
        "Axes along which the scene repeats itself; water that leaves at one end enters at the other.",
    );
    let axes = axes.list(&[]);
    let periodic: Vec<bool> =
        ["x", "y", "z"][..dimension].iter().map(|axis| axes.iter().any(|named| named == axis)).collect();
    let openings = section.list("opening").iter().map(|hole| read_opening(hole, dimension)).collect();
    let motion = section.inner("motion").map(|motion| Prescribed::read(&motion, dimension));
    section.finish();
    for face in open.iter().filter(|face| symmetry.contains(face) || periodic[face.axis()]) {
        let message =
            format!("the face \"{}\" is said to be a plane of symmetry or periodic too", face.name());
        section.complain("open", message, "one of the three", "Leave it in one list.");
    }
    Domain { region, open, symmetry, periodic, openings, motion }
}

fn read_opening(section: &Section<'_>, dimension: usize) -> Opening {
    let face = section.choice("face", face_names(dimension)).about("The wall the hole is in.").required();
    let region = BoxRegion::read(section, dimension, "the hole; its extent across the wall does not matter");
    section.finish();
    Opening { face: BoxFace::from_name(&face).unwrap_or(BoxFace::Left), region }
}

fn read_gravity(section: &Section<'_>, dimension: usize) -> Gravity {
    let acceleration = section.required_vector(
        "acceleration",
        dimension,
        "m/s2",
        "Body force per mass on water and structure, any direction.",
    );
    let rows =
        section.rows("table", 2, "s, -", "Factor on it over time: rows [time, factor], linear between.");
    let table: Option<Vec<_>> = rows.map(|rows| rows.iter().map(|row| (row[0], row[1])).collect());
    if table.as_ref().is_some_and(|table| table.windows(2).any(|pair| pair[0].0 >= pair[1].0)) {
        section.complain("table", "the times do not increase", "increasing times", "Sort the rows by time.");
    }
    section.finish();
    Gravity { acceleration, table }
}

fn read_time(case: &CaseFile) -> TimeSettings {
    let section = case.section_or_default("time");
    let end = section.number("end").unit("s").above(0.0).about("End of the run.").required();
    let max_dt = section
        .number("max_dt")
        .unit("s")
        .above(0.0)
        .about("Largest coupling step; the run takes smaller ones where the water's speed demands it.")
        .required();
    let pinned = section.flag(
        "pinned",
        false,
        "Take every coupling step with exactly max_dt; the fluid sub-steps inside when it must.",
    );
    let silence_limit = section
        .number("silence_limit")
        .unit("s")
        .above(0.0)
        .about("A process that does not answer for this long is given up.")
        .default(60.0);
    section.finish();
    TimeSettings { end, max_dt, pinned, silence_limit }
}

fn read_output(case: &CaseFile) -> Output {
    let section = case.section_or_default("output");
    let fields_every = section
        .number("fields_every")
        .unit("s")
        .above(0.0)
        .about("Time between two frames of the ParaView fields; without it no fields are written.")
        .optional();
    let series_every = section
        .number("series_every")
        .unit("s")
        .at_least(0.0)
        .about("Time between two rows of a series; 0 is every step.")
        .default(0.0);
    section.finish();
    Output { fields_every, series_every }
}

fn read_outline(
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
    Some(SolidOutline { model, region, mesh, elements, wet, clamped, density, prescribed })
}

/// The names of the faces that are held; a mesh file may name its own.
pub fn read_clamped(section: &Section<'_>, dimension: usize, is_meshed: bool) -> Vec<String> {
    let names = if is_meshed { &[] } else { face_names(dimension) };
    section
        .choice("clamped", names)
        .about("Faces that are held; of a mesh file also its named surfaces and sets of nodes.")
        .list(&[])
}

fn read_fluid_outline(section: &Section<'_>, dimension: usize) -> FluidOutline {
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
