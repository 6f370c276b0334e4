//! What several programs read: `[case]`, `[gravity]`, `[time]`, `[output]`, and all that belongs to one scene.

use super::domain::{Domain, read_domain};
use super::file::CaseFile;
use super::gauge::Gauge;
use super::outline::{FluidOutline, SolidOutline, read_fluid_outline, read_outline};
use super::reference::Reference;
use super::scheme::{FluidSide, Replayed, Scheme};
use super::section::Section;

/// `[case]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// Name of the scene; the default run folder is called after it.
    pub name: String,
    /// 2 or 3.
    pub dimension: usize,
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
    /// Whether the whole state is kept at every output, for `tidewall resume`.
    pub state: bool,
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
    /// `[coupling] fluid_side`.
    pub fluid_side: FluidSide,
    /// `[coupling] replay`, where one side is a recording.
    pub replay: Option<Replayed>,
}

/// Every section a case may have.
pub const SECTIONS: [&str; 12] = [
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
    "stress",
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
        let fluid_side = if is_coupled { FluidSide::read(case) } else { FluidSide::default() };
        let replay = if is_coupled { Replayed::read(case) } else { None };
        Self {
            header,
            domain,
            gravity,
            time,
            output,
            gauges,
            references,
            solid,
            fluid,
            scheme,
            fluid_side,
            replay,
        }
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
    let state = section.flag(
        "state",
        false,
        "Keep the whole state in the run folder at every output and at the end, also of an interrupted run, so that \
         tidewall resume can go on from it; without fields_every there are 20 outputs.",
    );
    section.finish();
    Output { fields_every, series_every, state }
}
