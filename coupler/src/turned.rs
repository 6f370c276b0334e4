//! Points that turn with the structure: where it stands, how far it has turned, its normals at them.
//!
//! The dummy mesh of a body with flat faces needs none of this: all its nodes lie on the surface.

use protocol::interface::Surface;

use crate::fluid_side::FluidSide;
use crate::load::{Load, Place};
use crate::mapping::Mapping;

/// The place the mapping has been turned to: that of the structure at the start of the step.
pub(crate) struct Turned {
    /// The fluid's nodes, `[n, D]` m.
    pub(crate) points: Vec<f64>,
    /// The solid's nodes, `[N, D]` m.
    pub(crate) solid: Vec<f64>,
}

impl Turned {
    /// Room for it, where it is needed.
    pub(crate) fn new(side: &FluidSide, mapping: &Mapping, surface: &Surface) -> Option<Self> {
        let is_needed = matches!(side, FluidSide::Points(_)) || mapping.turns();
        let (points, solid) = (side.reference_position().to_vec(), surface.reference_position.clone());
        is_needed.then_some(Self { points, solid })
    }

    /// Turns everything to this displacement of the solid's nodes, `[N, D]` m, but for the points' places.
    pub(crate) fn turn(
        &mut self,
        displacement: &[f64],
        surface: &Surface,
        mapping: &mut Mapping,
        load: &mut Load,
    ) {
        let unloaded = surface.reference_position.iter().zip(displacement);
        self.solid.iter_mut().zip(unloaded).for_each(|(now, (x, u))| *now = x + u);
        mapping.turn(&self.solid);
        if let Place::Points(place) = &mut load.place {
            place.follow(&self.solid);
        }
    }

    /// The places of the points at the displacement they have been turned to.
    pub(crate) fn place_points(&mut self, displacement: &[f64], side: &FluidSide, mapping: &Mapping) {
        mapping.place(side.reference_position(), displacement, &mut self.points);
    }
}
