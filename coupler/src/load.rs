//! The loads on both sides of the interface: from marker pressures to tractions to nodal forces.

use protocol::interface::{Surface, add_traction_forces};

use crate::case::LoadForm;
use crate::dummy_mesh::DummyMesh;
use crate::mapping::{Mapping, Sparse, marker_rows};
use crate::marker_place::MarkerPlace;
use crate::parallel;
use crate::resultant::total;

/// Loads of one step, reused at every step.
pub struct Load {
    dimension: usize,
    /// From the fluid's markers to the solid's.
    rows: Sparse,
    /// Where the markers are.
    pub place: MarkerPlace,
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

/// Tractions integrated over the facets.
struct Integrated {
    /// Number of the marker at each corner of each facet.
    corner_markers: Vec<usize>,
    /// On the fluid's nodes, `[n, D]` N.
    force: Vec<f64>,
}

impl Load {
    /// Room for the loads between these two sides.
    pub fn new(form: LoadForm, dummy: &DummyMesh, surface: &Surface) -> Self {
        let dimension = surface.dimension;
        let place = MarkerPlace::new(dummy.facets(), dummy.reference_position());
        let marker_count = place.markers().len();
        let rows = marker_rows(dummy, surface);
        let zeros = |count: usize| vec![0.0; count];
        Self {
            dimension,
            place,
            pressure: zeros(marker_count),
            traction: zeros(marker_count * dimension),
            pair: zeros(dummy.node_count() * dimension),
            integrated: (form == LoadForm::Markers).then(|| Integrated {
                corner_markers: dummy.facets().corner_markers(),
                force: zeros(dummy.node_count() * dimension),
            }),
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

    /// t = -p n at the markers; where it acts, integrated to nodal forces over the facets in their current place.
    pub fn make_traction(&mut self, dummy: &DummyMesh, position: &[f64]) {
        if self.dimension == 2 {
            self.tractions::<2>();
        } else {
            self.tractions::<3>();
        }
        if let Some(Integrated { corner_markers, force }) = &mut self.integrated {
            force.fill(0.0);
            add_traction_forces(dummy.facets(), corner_markers, position, &self.traction, force);
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
