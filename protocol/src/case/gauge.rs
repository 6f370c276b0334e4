//! `[[gauge]]`: what is recorded while the run goes; each becomes `series/<name>.csv`.

use super::file::CaseFile;

/// What a gauge records.
#[derive(Debug, Clone, PartialEq)]
pub enum GaugeKind {
    /// Solid: displacement of the material point that was at `point` in the unloaded body (`ux_m`, `uy_m`, `uz_m`).
    Displacement {
        /// `[D]` m.
        point: Vec<f64>,
    },
    /// Solid: force (and moment about the origin) the support exerts (`fx_n`, ..., in 2-D per metre of depth).
    Reaction,
    /// Solid: natural frequency of the mode of each step (`f_hz`), for analysis = "modes".
    Frequency,
    /// Fluid: mean pressure over points, also of a wall (`p_pa`).
    Pressure {
        /// `[points, D]` m.
        points: Vec<Vec<f64>>,
    },
    /// Fluid: farthest water along an axis (`x_m`).
    Front {
        /// 0, 1 or 2.
        axis: usize,
    },
    /// Fluid: height of the water over the floor near a vertical line (`level_m`).
    WaterLevel {
        /// `[D]` m; its height does not matter.
        point: Vec<f64>,
    },
    /// Fluid: force and moment about the origin on a face of the tank, on the body or on all obstacles (`fx_n`, ...,
    /// `mz_nm`).
    Force {
        /// Name of a tank face, `body` or `obstacles`.
        on: String,
    },
    /// Both: kinetic, potential and (solid) strain energy (`kinetic_j`, ...).
    Energy {
        /// `fluid` or `solid`.
        of: String,
    },
    /// Fluid: volume of the water (`volume_m3`, in 2-D per metre of depth).
    Volume,
    /// Fluid: departure from the hydrostatic pressure over all particles, relative to that at the floor (`l2_relative`).
    HydrostaticError,
    /// Fluid: centre of mass (`cx_m`, `cy_m`, `cz_m`).
    Centre,
    /// Fluid: momentum, and moment of momentum about the origin (`px_ns`, ..., `lz_nms`, in 2-D per metre of depth).
    Momentum,
}

impl GaugeKind {
    /// Whether the fluid records it; the solid records the others.
    pub fn is_of_fluid(&self) -> bool {
        match self {
            Self::Displacement { .. } | Self::Reaction | Self::Frequency => false,
            Self::Energy { of } => of == "fluid",
            _ => true,
        }
    }
}

/// One gauge.
#[derive(Debug, Clone, PartialEq)]
pub struct Gauge {
    /// Its name, also of its file.
    pub name: String,
    /// What it records.
    pub kind: GaugeKind,
}

const KINDS: [&str; 12] = [
    "displacement",
    "reaction",
    "frequency",
    "pressure",
    "front",
    "water_level",
    "force",
    "energy",
    "volume",
    "hydrostatic_error",
    "centre",
    "momentum",
];

impl Gauge {
    /// Reads all gauges of the case.
    pub fn read_all(case: &CaseFile, dimension: usize) -> Vec<Self> {
        let mut gauges: Vec<Self> = Vec::new();
        for section in case.list("gauge") {
            let name = section.text("name").about("Name of the gauge, also of its series file.").required();
            let mistakes = case.diagnostics().len();
            let kind = section.choice("kind", &KINDS).about("What it records.").required();
            if case.diagnostics().len() > mistakes {
                // What else the gauge needs depends on its kind: nothing more can be said.
                gauges.push(Self { name, kind: GaugeKind::Volume });
                continue;
            }
            let point = || {
                section.required_vector("point", dimension, "m", "Where it is taken, in the unloaded body.")
            };
            let kind = match kind.as_str() {
                "displacement" => GaugeKind::Displacement { point: point() },
                "reaction" => GaugeKind::Reaction,
                "frequency" => GaugeKind::Frequency,
                "pressure" => {
                    let about = "pressure: points over which a sensor takes the mean; replaces point.";
                    let points = section.rows("points", dimension, "m", about);
                    GaugeKind::Pressure { points: points.unwrap_or_else(|| vec![point()]) }
                }
                "front" => {
                    let axis =
                        section.choice("axis", &["x", "y", "z"][..dimension]).about("Along which axis.");
                    let axis = axis.default("x");
                    GaugeKind::Front { axis: (axis.as_bytes()[0] - b'x') as usize }
                }
                "water_level" => GaugeKind::WaterLevel { point: point() },
                "force" => {
                    let choices: Vec<_> = super::domain::face_names(dimension)
                        .iter()
                        .copied()
                        .chain(["body", "obstacles"])
                        .collect();
                    let on = section
                        .choice("on", &choices)
                        .about("Tank face, the body, or all obstacles.")
                        .required();
                    GaugeKind::Force { on }
                }
                "energy" => {
                    let of =
                        section.choice("of", &["fluid", "solid"]).about("Of which part.").default("fluid");
                    GaugeKind::Energy { of }
                }
                "volume" => GaugeKind::Volume,
                "centre" => GaugeKind::Centre,
                "momentum" => GaugeKind::Momentum,
                _ => GaugeKind::HydrostaticError,
            };
            section.finish();
            let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c));
            if name.is_empty() || !plain {
                section.complain(
                    "name",
                    format!("\"{name}\" cannot name a file"),
                    "letters, digits, - and _",
                    "",
                );
            }
            if name == "interface" || gauges.iter().any(|gauge| gauge.name == name) {
                section.complain("name", format!("\"{name}\" is taken"), "a name of its own", "");
            }
            gauges.push(Self { name, kind });
        }
        gauges
    }
}
