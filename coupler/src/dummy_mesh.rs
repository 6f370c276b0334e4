//! The paper's dummy mesh: the fluid's own mesh of the interface, of which only the surface and the cells that carry the
//! fluid's obstacle particles are used.
//!
//! For a box-like body its cells span the wall from one face to the other, one across, so that every node lies on the
//! surface and position, velocity and (transposed) load go through one set of shape functions.

use protocol::case::{BoxFace, SolidOutline};
use protocol::interface::{BodyMesh, Facets, Response};

/// The fluid's side of the interface.
#[derive(Debug, Clone)]
pub struct DummyMesh {
    dimension: usize,
    reference_position: Vec<f64>,
    cells: Vec<usize>,
    facets: Facets,
}

/// A structured grid over the box whose axes are ordered: across the wall first.
struct Grid<'s> {
    solid: &'s SolidOutline,
    axes: Vec<usize>,
    counts: Vec<usize>,
}

impl DummyMesh {
    /// Spans the mesh over the unloaded body with `elements` cells along each axis, one across the wall.
    pub fn span(solid: &SolidOutline, elements: &[usize]) -> Self {
        let dimension = solid.region.min.len();
        let across = solid.thickness_axis();
        let mut axes = vec![across];
        axes.extend((0..dimension).filter(|&axis| axis != across));
        let counts = axes.iter().map(|&axis| if axis == across { 1 } else { elements[axis] }).collect();
        let grid = Grid { solid, axes, counts };
        Self { dimension, reference_position: grid.positions(), cells: grid.cells(), facets: grid.facets() }
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.reference_position.len() / self.dimension
    }

    /// Node positions of the unloaded body, `[n, D]` m.
    pub fn reference_position(&self) -> &[f64] {
        &self.reference_position
    }

    /// The surface.
    pub fn facets(&self) -> &Facets {
        &self.facets
    }

    /// What the fluid gets in the handshake; `response_mass` is m_r per node, `[n]` kg/m2.
    pub fn body_mesh(&self, response_mass: Vec<f64>, response: Response) -> BodyMesh {
        BodyMesh {
            dimension: self.dimension,
            reference_position: self.reference_position.clone(),
            cells: self.cells.clone(),
            facets: self.facets.clone(),
            response_mass,
            response,
        }
    }
}

impl Grid<'_> {
    fn node_counts(&self) -> Vec<usize> {
        self.counts.iter().map(|count| count + 1).collect()
    }

    /// Multi-index of the `number`-th item of a block, first axis fastest.
    fn unravel(counts: &[usize], mut number: usize) -> Vec<usize> {
        counts
            .iter()
            .map(|&count| {
                let index = number % count;
                number /= count;
                index
            })
            .collect()
    }

    fn node(&self, index: &[usize]) -> usize {
        index.iter().zip(self.node_counts()).rev().fold(0, |number, (&index, count)| number * count + index)
    }

    fn positions(&self) -> Vec<f64> {
        let counts = self.node_counts();
        let region = &self.solid.region;
        let mut positions = Vec::new();
        for number in 0..counts.iter().product() {
            let index = Self::unravel(&counts, number);
            let mut point = vec![0.0; self.axes.len()];
            for (local, &axis) in self.axes.iter().enumerate() {
                let share = index[local] as f64 / self.counts[local] as f64;
                point[axis] = region.min[axis] * (1.0 - share) + region.max[axis] * share;
            }
            positions.extend(point);
        }
        positions
    }

    fn cells(&self) -> Vec<usize> {
        let dimension = self.axes.len();
        let mut cells = Vec::new();
        for number in 0..self.counts.iter().product() {
            let base = Self::unravel(&self.counts, number);
            for corner in 0..1 << dimension {
                let index: Vec<_> = (0..dimension).map(|axis| base[axis] + (corner >> axis & 1)).collect();
                cells.push(self.node(&index));
            }
        }
        cells
    }

    fn facets(&self) -> Facets {
        let dimension = self.axes.len();
        let mut facets = Facets { nodes_per_facet: 1 << (dimension - 1), ..Facets::default() };
        for face in self.solid.interface_faces() {
            self.face_facets(face, &mut facets);
        }
        facets
    }

    /// Facets of one face, oriented outwards.
    fn face_facets(&self, face: BoxFace, facets: &mut Facets) {
        let normal =
            self.axes.iter().position(|&axis| axis == face.axis()).expect("the face belongs to the box");
        // Local axes of the face, ordered so that first x second points along +axis of the box.
        let others: Vec<usize> = match self.axes.len() {
            2 => vec![1 - normal],
            _ => {
                let box_axis = self.axes[normal];
                let local = |axis: usize| self.axes.iter().position(|&a| a == axis).expect("three axes");
                vec![local((box_axis + 1) % 3), local((box_axis + 2) % 3)]
            }
        };
        let layer = if face.sign() > 0.0 { self.counts[normal] } else { 0 };
        let counts: Vec<_> = others.iter().map(|&axis| self.counts[axis]).collect();
        for number in 0..counts.iter().product() {
            let base = Self::unravel(&counts, number);
            let node = |steps: &[usize]| {
                let mut index = vec![0; self.axes.len()];
                index[normal] = layer;
                for (position, &axis) in others.iter().enumerate() {
                    index[axis] = base[position] + steps[position];
                }
                self.node(&index)
            };
            let mut corners: Vec<usize> = match others.len() {
                1 => vec![node(&[0]), node(&[1])],
                _ => vec![node(&[0, 0]), node(&[1, 0]), node(&[1, 1]), node(&[0, 1])],
            };
            // In 2-D a segment along +y has its outward normal, on its right, along +x; one along +x has it along -y.
            let outward = match others.len() {
                1 => (face.sign() > 0.0) == (face.axis() == 0),
                _ => face.sign() > 0.0,
            };
            if !outward {
                corners.reverse();
            }
            facets.nodes.extend(corners);
            facets.face.push(face as usize);
        }
    }
}

#[cfg(test)]
mod tests {
    use protocol::case::BoxRegion;

    use super::*;
    use crate::marker_place::MarkerPlace;

    fn outline(dimension: usize) -> SolidOutline {
        let region = BoxRegion { min: vec![0.292, 0.0, 0.0], max: vec![0.304, 0.08, 0.292] };
        let region =
            BoxRegion { min: region.min[..dimension].to_vec(), max: region.max[..dimension].to_vec() };
        SolidOutline {
            model: "fem".to_owned(),
            mesh: None,
            region,
            elements: vec![2; dimension],
            has_middle_nodes: false,
            wet: vec![BoxFace::Left, BoxFace::Right, BoxFace::Top],
            clamped: vec![BoxFace::Bottom],
            density: None,
            young_modulus: None,
            prescribed: false,
        }
    }

    #[test]
    fn every_normal_points_outwards() {
        for dimension in [2, 3] {
            let mesh = DummyMesh::span(&outline(dimension), &[1, 4, 3]);
            let place = MarkerPlace::new(mesh.facets(), mesh.reference_position());
            for (marker, place) in mesh.facets().markers().iter().zip(place.markers()) {
                let face = BoxFace::ALL[marker.face];
                assert!((place[face.axis()] - face.sign()).abs() < 1e-12, "{face:?} {place:?}");
            }
        }
    }

    #[test]
    fn a_uniform_pressure_on_the_surface_pushes_down_with_the_area_of_the_top() {
        for (dimension, area) in [(2, 0.012), (3, 0.012 * 0.292)] {
            let mesh = DummyMesh::span(&outline(dimension), &[1, 4, 3]);
            let place = MarkerPlace::new(mesh.facets(), mesh.reference_position());
            let downward = |marker: &[f64; 4]| -1000.0 * marker[1] * marker[3];
            let total: f64 = place.markers().iter().map(downward).sum();
            assert!((total + 1000.0 * area).abs() < 1e-12, "{total}");
            assert!((place.total_area() - wet_area(dimension)).abs() < 1e-12);
        }
    }

    /// Left, right and top.
    fn wet_area(dimension: usize) -> f64 {
        let depth = if dimension == 2 { 1.0 } else { 0.292 };
        (2.0 * 0.08 + 0.012) * depth
    }

    #[test]
    fn cells_span_the_wall_with_their_first_axis() {
        let mesh = DummyMesh::span(&outline(3), &[1, 4, 3]);
        assert_eq!(mesh.node_count(), 2 * 5 * 4);
        let body = mesh.body_mesh(vec![0.0; mesh.node_count()], Response::Given);
        for cell in body.cells.chunks(8) {
            for edge in cell.chunks(2) {
                let x = |node: usize| body.reference_position[3 * node];
                assert!((x(edge[1]) - x(edge[0]) - 0.012).abs() < 1e-15);
            }
        }
    }
}
