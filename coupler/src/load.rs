//! The loads on both sides of the interface: from marker pressures to tractions to nodal forces.

use protocol::interface::{Facets, Surface, add_traction_forces};

use crate::case::LoadForm;
use crate::dummy_mesh::DummyMesh;
use crate::mapping::{Mapping, Sparse, marker_rows};

/// Loads of one step, reused at every step.
pub struct Load {
    /// Number of the marker at each corner of each facet.
    corner_markers: Vec<usize>,
    /// From the fluid's markers to the solid's.
    rows: Sparse,
    /// Marker pressures, `[m]` Pa.
    pub pressure: Vec<f64>,
    normal: Vec<f64>,
    traction: Vec<f64>,
    /// Pair reaction on the fluid's nodes, `[n, D]` N.
    pub pair: Vec<f64>,
    /// Marker tractions integrated to the fluid's nodes, `[n, D]` N.
    pub marker: Vec<f64>,
    /// The acting load on the solid's nodes, `[n, D]` N.
    pub on_solid: Vec<f64>,
    /// Tractions at the solid's markers, `[m, D]` Pa.
    pub traction_on_solid: Vec<f64>,
}

impl Load {
    /// Room for the loads between these two sides.
    pub fn new(dummy: &DummyMesh, surface: &Surface) -> Self {
        let dimension = surface.dimension;
        let marker_count = dummy.facets().markers().len();
        let rows = marker_rows(dummy, surface);
        let zeros = |count: usize| vec![0.0; count];
        Self {
            pressure: zeros(marker_count),
            normal: zeros(marker_count * dimension),
            traction: zeros(marker_count * dimension),
            pair: zeros(dummy.node_count() * dimension),
            marker: zeros(dummy.node_count() * dimension),
            on_solid: zeros(surface.node_count() * dimension),
            traction_on_solid: zeros(rows.len() * dimension),
            corner_markers: dummy.facets().corner_markers(),
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

    /// t = -p n at the markers, integrated to nodal forces over the facets in their current place.
    pub fn make_traction(&mut self, facets: &Facets, position: &[f64]) {
        marker_normals(facets, &self.corner_markers, position, &mut self.normal);
        tractions(&self.pressure, &self.normal, &mut self.traction);
        self.marker.fill(0.0);
        add_traction_forces(facets, &self.corner_markers, position, &self.traction, &mut self.marker);
    }

    /// Carries the acting load to the solid's nodes, and the tractions to its markers.
    pub fn map_to_solid(&mut self, form: LoadForm, mapping: &Mapping) {
        let acting = if form == LoadForm::Pair { &self.pair } else { &self.marker };
        mapping.gather_load(acting, &mut self.on_solid);
        let dimension = self.normal.len() / self.pressure.len().max(1);
        self.rows.spread(dimension, &self.traction, &mut self.traction_on_solid);
    }
}

/// Unit outward normals at the markers, `[m, D]`: the area-weighted mean over the marker's facets in their current place;
/// `corner_markers` are those of [`Facets::corner_markers`].
pub fn marker_normals(facets: &Facets, corner_markers: &[usize], position: &[f64], normal: &mut [f64]) {
    let dimension = if facets.nodes_per_facet == 2 { 2 } else { 3 };
    normal.fill(0.0);
    for (facet, markers) in corner_markers.chunks_exact(facets.nodes_per_facet).enumerate() {
        let area = area_vector(facets.facet(facet), position, dimension);
        for marker in markers {
            (0..dimension).for_each(|axis| normal[marker * dimension + axis] += area[axis]);
        }
    }
    for normal in normal.chunks_exact_mut(dimension) {
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        normal.iter_mut().for_each(|x| *x /= length);
    }
}

/// Tractions `t = -p n` at the markers, `[m, D]` Pa, from pressures `[m]` Pa.
pub fn tractions(pressure: &[f64], normal: &[f64], traction: &mut [f64]) {
    let dimension = normal.len() / pressure.len().max(1);
    for (marker, pressure) in pressure.iter().enumerate() {
        for axis in marker * dimension..(marker + 1) * dimension {
            traction[axis] = -pressure * normal[axis];
        }
    }
}

/// Total wet area, m2 (in 2-D length, m).
pub fn total_area(facets: &Facets, position: &[f64]) -> f64 {
    let dimension = if facets.nodes_per_facet == 2 { 2 } else { 3 };
    let size = |facet| {
        area_vector(facets.facet(facet), position, dimension).iter().map(|x| x * x).sum::<f64>().sqrt()
    };
    (0..facets.len()).map(size).sum()
}

/// Outward area vector of a facet: half the cross product of the diagonals of a quadrilateral.
fn area_vector(nodes: &[usize], position: &[f64], dimension: usize) -> [f64; 3] {
    let point = |corner: usize| -> [f64; 3] {
        let node = nodes[corner];
        std::array::from_fn(|axis| if axis < dimension { position[node * dimension + axis] } else { 0.0 })
    };
    let minus = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { std::array::from_fn(|axis| a[axis] - b[axis]) };
    if nodes.len() == 2 {
        let edge = minus(point(1), point(0));
        return [edge[1], -edge[0], 0.0];
    }
    let (first, second) = match nodes.len() {
        3 => (minus(point(1), point(0)), minus(point(2), point(0))),
        _ => (minus(point(2), point(0)), minus(point(3), point(1))),
    };
    [
        0.5 * (first[1] * second[2] - first[2] * second[1]),
        0.5 * (first[2] * second[0] - first[0] * second[2]),
        0.5 * (first[0] * second[1] - first[1] * second[0]),
    ]
}
