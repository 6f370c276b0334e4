//! The loads on both sides of the interface: from marker pressures to tractions to nodal forces.

use protocol::interface::{Surface, add_traction_forces};

use crate::case::LoadForm;
use crate::fluid_side::FluidSide;
use crate::mapping::{Mapping, Sparse, marker_rows};
use crate::marker_place::MarkerPlace;
use crate::parallel;
use crate::point_place::PointPlace;
use crate::resultant::total;

/// Loads of one step, reused at every step.
pub struct Load {
    dimension: usize,
    /// From the fluid's markers to the solid's.
    rows: Sparse,
    /// Where the markers are.
    pub place: Place,
    /// Marker pressures, `[m]` Pa.
    pub pressure: Vec<f64>,
    /// Tractions at the fluid's markers, `[m, D]` Pa.
    traction: Vec<f64>,
    /// Pair reaction on the fluid's nodes, `[n, D]` N.
    pub pair: Vec<f64>,
    /// Where the tractions are what acts: their nodal forces.
    integrated: Option<Integrated>,
    /// The acting load on the solid's nodes, `[n, D]` N.
    pub on_solid: Vec<f64>,
    /// Tractions at the solid's markers, `[m, D]` Pa.
    pub traction_on_solid: Vec<f64>,
}

/// Tractions as nodal forces.
struct Integrated {
    /// Over facets: number of the marker at each corner of each; points have each an area of their own.
    corner_markers: Vec<usize>,
    /// On the fluid's nodes, `[n, D]` N.
    force: Vec<f64>,
}

/// Normals and areas of the markers, as the fluid's side has them.
pub enum Place {
    /// Of the dummy mesh's own facets.
    DummyMesh(MarkerPlace),
    /// Of the structure's surface at the fluid's points.
    Points(PointPlace),
}

impl Place {
    /// Unit normal and area, m2, of each marker.
    pub fn markers(&self) -> &[[f64; 4]] {
        match self {
            Self::DummyMesh(place) => place.markers(),
            Self::Points(place) => place.markers(),
        }
    }

    /// What goes to the fluid behind the motion: the structure's normals at its points, `[n, D]`.
    pub fn normals(&self) -> &[f64] {
        match self {
            Self::DummyMesh(_) => &[],
            Self::Points(place) => place.normals(),
        }
    }

    /// Wet area, m2 (in 2-D length, m).
    pub fn total_area(&self) -> f64 {
        match self {
            Self::DummyMesh(place) => place.total_area(),
            Self::Points(place) => place.markers().iter().map(|marker| marker[3]).sum(),
        }
    }
}

impl Load {
    /// Room for the loads between these two sides.
    pub fn new(form: LoadForm, side: &FluidSide, surface: &Surface) -> Self {
        let dimension = surface.dimension;
        let (place, rows, corner_markers) = match side {
            FluidSide::DummyMesh(mesh) => {
                let place = MarkerPlace::new(mesh.facets(), mesh.reference_position());
                (Place::DummyMesh(place), marker_rows(mesh, surface), mesh.facets().corner_markers())
            }
            FluidSide::Points(points) => {
                let place = PointPlace::new(points, surface);
                let rows = place.traction_rows(points, surface);
                (Place::Points(place), rows, Vec::new())
            }
        };
        let marker_count = place.markers().len();
        let zeros = |count: usize| vec![0.0; count];
        Self {
            dimension,
            place,
            pressure: zeros(marker_count),
            traction: zeros(marker_count * dimension),
            pair: zeros(side.node_count() * dimension),
            integrated: (form == LoadForm::Markers)
                .then(|| Integrated { corner_markers, force: zeros(side.node_count() * dimension) }),
            on_solid: zeros(surface.node_count() * dimension),
            traction_on_solid: zeros(rows.len() * dimension),
            rows,
        }
    }

    /// Number of interface markers on the fluid's side.
    pub fn marker_count(&self) -> usize {
        self.pressure.len()
    }

    /// Number of values of the fluid's load message.
    pub fn message_len(&self) -> usize {
        self.pressure.len() + self.pair.len()
    }

    /// Takes the fluid's load message: marker pressures, pair forces.
    pub fn read(&mut self, values: &[f64]) {
        let (pressure, pair) = values.split_at(self.pressure.len());
        self.pressure.copy_from_slice(pressure);
        self.pair.copy_from_slice(pair);
    }

    /// t = -p n at the markers; where it acts, as nodal forces of the fluid's side in its current place.
    pub fn make_traction(&mut self, side: &FluidSide, position: &[f64]) {
        if self.dimension == 2 {
            self.tractions::<2>();
        } else {
            self.tractions::<3>();
        }
        let Some(Integrated { corner_markers, force }) = &mut self.integrated else { return };
        force.fill(0.0);
        match (side, &self.place) {
            (FluidSide::DummyMesh(mesh), _) => {
                add_traction_forces(mesh.facets(), corner_markers, position, &self.traction, force);
            }
            (_, Place::Points(place)) => add_point_forces(place, self.dimension, &self.traction, force),
            _ => unreachable!("the place is that of the side"),
        }
    }

    /// Carries the acting load to the solid's nodes, and the tractions to its markers.
    pub fn map_to_solid(&mut self, mapping: &Mapping) {
        let acting = self.integrated.as_ref().map_or(&self.pair, |integrated| &integrated.force);
        mapping.gather_load(acting, &mut self.on_solid);
        let traction = |component: usize| self.traction[component];
        self.rows.spread(self.dimension, |_| 0.0, traction, &mut self.traction_on_solid);
    }

    /// The load that acts, on the fluid's nodes, `[n, D]` N.
    pub fn acting(&self) -> &[f64] {
        self.integrated.as_ref().map_or(&self.pair, |integrated| &integrated.force)
    }

    /// Total of the load that does not act, N.
    pub fn other_total(&self) -> [f64; 3] {
        let markers = self.place.markers();
        match self.integrated {
            Some(_) => total(self.dimension, &self.pair, |_| 1.0),
            None => total(self.dimension, &self.traction, |marker| markers[marker][3]),
        }
    }

    fn tractions<const D: usize>(&mut self) {
        let (pressure, markers) = (&self.pressure, self.place.markers());
        parallel::fill::<D>(&mut self.traction, |marker| {
            std::array::from_fn(|axis| -pressure[marker] * markers[marker][axis])
        });
    }
}

/// Forces `[n, D]` N of tractions `[m, D]` Pa at the points that have an area.
fn add_point_forces(place: &PointPlace, dimension: usize, traction: &[f64], force: &mut [f64]) {
    let points = place.with_area().iter().zip(place.markers());
    for ((&point, marker), traction) in points.zip(traction.chunks_exact(dimension)) {
        let force = &mut force[point * dimension..][..dimension];
        force.iter_mut().zip(traction).for_each(|(force, stress)| *force += marker[3] * stress);
    }
}
