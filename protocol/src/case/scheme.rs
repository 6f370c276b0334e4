//! `[coupling]` as far as others than the coupler must know it: the scheme, as it gives the turns of a step, what the
//! water's side is made of, and which side is a recording, as the launcher starts the others only.

use serde::{Deserialize, Serialize};

use super::CaseFile;

/// How the coupler ties the two solvers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Scheme {
    /// One pass, the wall gives way to the pressure it has not yet felt.
    #[default]
    Robin,
    /// Conventional serial staggered, the paper's.
    Css,
    /// Both solvers advance at the same time, on what the other had one step before.
    Parallel,
    /// Passes over the same step until both sides agree.
    Strong,
    /// The load goes to the solid; the water sees the body at rest.
    ToSolid,
    /// The motion goes to the fluid; the body feels no water.
    ToFluid,
}

const NAMES: [(&str, Scheme); 6] = [
    ("robin", Scheme::Robin),
    ("css", Scheme::Css),
    ("parallel", Scheme::Parallel),
    ("strong", Scheme::Strong),
    ("to_solid", Scheme::ToSolid),
    ("to_fluid", Scheme::ToFluid),
];

impl Scheme {
    /// Reads the key; the default where it is not written.
    pub(super) fn read(case: &CaseFile) -> Self {
        let section = case.section_or_default("coupling");
        let word = section
            .choice("scheme", &NAMES.map(|(name, _)| name))
            .about(
                "robin: single pass, stable at any mass ratio; css: conventional serial staggered (the paper's); \
                 parallel: both solvers at the same time, one step behind each other; strong: passes over a step until \
                 both sides agree; to_solid: the water sees the body at rest; to_fluid: the body feels no water.",
            )
            .default(Self::default().name());
        NAMES.iter().find(|(name, _)| *name == word).map_or(Self::default(), |(_, scheme)| *scheme)
    }

    /// Its word in the case file.
    pub fn name(self) -> &'static str {
        NAMES.iter().find(|(_, scheme)| *scheme == self).expect("every scheme has a name").0
    }
}

/// What the water's side of the interface is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FluidSide {
    /// The dummy mesh, which the coupler makes: nodes, facets and cells.
    #[default]
    DummyMesh,
    /// The fluid's own points, each with a position and an area, without any mesh.
    Points,
}

impl FluidSide {
    /// Reads the key.
    pub(super) fn read(case: &CaseFile) -> Self {
        let section = case.section_or_default("coupling");
        let word = section
            .choice("fluid_side", &["dummy_mesh", "points"])
            .about(
                "The water's side of the interface. dummy_mesh: nodes, facets and cells the coupler makes (the paper's); \
                 points: the fluid's own points, each with a position and an area; fluid-isph offers its wall particles \
                 and a grid of points on the wet faces.",
            )
            .default("dummy_mesh");
        if word == "points" { Self::Points } else { Self::DummyMesh }
    }
}

/// One side of the interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The water.
    Fluid,
    /// The structure.
    Solid,
}

impl Side {
    /// The role in whose place the recording stands.
    pub fn role(self) -> &'static str {
        match self {
            Self::Fluid => "fluid",
            Self::Solid => "solid",
        }
    }
}

/// `[coupling] replay`: a recording in the place of one side.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Replayed {
    /// The file, relative to the case.
    pub file: String,
    /// The side.
    pub side: Side,
}

impl Replayed {
    /// Reads the keys; `None` where there is no recording.
    pub(super) fn read(case: &CaseFile) -> Option<Self> {
        let section = case.section_or_default("coupling");
        let file = section
            .text("replay")
            .about("interface.rec of another run (relative to the case), in the place of one side, which is not started then.")
            .optional();
        let side = section
            .choice("replay_of", &["fluid", "solid"])
            .about("replay: the side that is a recording; fluid: its loads act on the solid; solid: its motion acts on the water.")
            .optional();
        match (file, side) {
            (Some(file), Some(side)) => {
                Some(Self { file, side: if side == "fluid" { Side::Fluid } else { Side::Solid } })
            }
            (None, None) => None,
            _ => {
                let hint = "Write both, or neither.";
                section.complain("replay", "replay and replay_of belong together", "both or neither", hint);
                None
            }
        }
    }
}
