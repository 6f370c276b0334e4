//! `[coupling] scheme`: the part of it the launcher must know, as it gives the turns of a step.

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
