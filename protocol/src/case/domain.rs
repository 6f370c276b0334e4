//! `[domain]`: the tank, and the boxes and faces everything is told by.

use serde::{Deserialize, Serialize};

use super::prescribed::Prescribed;
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

pub(super) fn faces(words: &[String]) -> Vec<BoxFace> {
    words.iter().filter_map(|word| BoxFace::from_name(word)).collect()
}

/// The names of the faces a box of this dimension has.
pub fn face_names(dimension: usize) -> &'static [&'static str] {
    &BoxFace::NAMES[..2 * dimension]
}

pub(super) fn read_domain(section: &Section<'_>, dimension: usize) -> Domain {
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
