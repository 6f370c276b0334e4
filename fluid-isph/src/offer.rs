//! The points the fluid offers where the structure's side needs no dummy mesh: the particles of the body, laid out by the
//! fluid itself, and a grid of interface markers on the wet faces.
//!
//! The particles come first, columns across the wall one after the other, and take the forces; they have no area. The
//! markers have the area of the wet faces between them, and a pressure each.

use protocol::case::{BoxFace, BoxRegion, SolidOutline};
use protocol::interface::{BodyMesh, Facets, Points, Response};

use crate::body_layout::{Embedded, LayoutRules, embed_particles};
use crate::error::SetupError;
use crate::lattice::{for_each_point, layer_centres};
use crate::vector::Vector;

/// Points of the unloaded body.
#[derive(Debug, Clone, PartialEq)]
pub struct Offer<const D: usize> {
    /// Particles, then markers, `[n, D]` m.
    pub position: Vec<Vector<D>>,
    /// Volume of the unloaded body each particle stands for, `[b]` m^D.
    pub volume: Vec<f64>,
    /// Wet area each marker stands for, `[m]` m2 (2-D: m).
    pub area: Vec<f64>,
    /// Particles in a column across the wall.
    pub layers: usize,
}

impl<const D: usize> Offer<D> {
    /// Fills the box of the body with particles and covers its wet faces with markers.
    ///
    /// # Errors
    /// [`SetupError::BodyTooThin`].
    pub fn lay_out(outline: &SolidOutline, rules: LayoutRules<'_, D>) -> Result<Self, SetupError> {
        // Rows run at one pitch whatever the cells' lengths: one cell gives what any mesh of the box does.
        let cell = spanning_cell(outline);
        let particles = embed_particles(&cell, rules)?;
        let mut offer = Self {
            position: particles.iter().map(|particle| particle.position(&cell)).collect(),
            volume: particles.iter().map(|particle| particle.volume).collect(),
            area: Vec::new(),
            layers: column_len(&particles),
        };
        for face in BoxFace::ALL.into_iter().filter(|face| outline.wet.contains(face)) {
            offer.cover(&outline.region, face, rules.spacing);
        }
        Ok(offer)
    }

    /// Markers at the centres of as many equal cells of a face as bring their edges nearest to the spacing.
    fn cover(&mut self, region: &BoxRegion, face: BoxFace, spacing: f64) {
        let plane = if face.sign() > 0.0 { &region.max } else { &region.min }[face.axis()];
        let axes: [Vec<f64>; D] = std::array::from_fn(|k| match k == face.axis() {
            true => vec![plane],
            false => layer_centres(region.min[k], region.max[k], spacing),
        });
        let area: f64 = (0..D).filter(|&k| k != face.axis()).map(|k| region.length(k)).product();
        let count: usize = axes.iter().map(Vec::len).product();
        for_each_point(&axes, |x, _| self.position.push(x));
        self.area.extend(std::iter::repeat_n(area / count as f64, count));
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Number of particles, which come before the markers.
    pub fn particle_count(&self) -> usize {
        self.volume.len()
    }

    /// What the coupler gets in the handshake.
    pub fn points(&self) -> Points {
        let mut area = vec![0.0; self.particle_count()];
        area.extend(&self.area);
        Points { dimension: D, reference_position: self.position.as_flattened().to_vec(), area }
    }
}

/// The box of the body as one cell, first local axis across the wall.
fn spanning_cell(outline: &SolidOutline) -> BodyMesh {
    let region = &outline.region;
    let (dimension, across) = (region.min.len(), outline.thickness_axis());
    let mut axes = vec![across];
    axes.extend((0..dimension).filter(|&axis| axis != across));
    let mut reference_position = Vec::new();
    for corner in 0..1usize << dimension {
        let mut x = region.min.clone();
        for (local, &axis) in axes.iter().enumerate() {
            if corner >> local & 1 == 1 {
                x[axis] = region.max[axis];
            }
        }
        reference_position.extend(x);
    }
    BodyMesh {
        dimension,
        reference_position,
        cells: (0..1 << dimension).collect(),
        facets: Facets::default(),
        response_mass: Vec::new(),
        response: Response::Given,
    }
}

/// Particles in the first column: those that differ in depth only. All columns of a cell are alike.
fn column_len<const D: usize>(particles: &[Embedded<D>]) -> usize {
    let Some(first) = particles.first() else { return 0 };
    let along = |particle: &Embedded<D>| particle.local[1..] == first.local[1..];
    particles.iter().take_while(|particle| along(particle) && particle.offset == first.offset).count()
}
