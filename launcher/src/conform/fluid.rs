//! The coupler's end of the line to a fluid: a wall that stands still at first and then moves a little.

use protocol::case::{BoxFace, SolidOutline};
use protocol::control::StepTime;
use protocol::header::{Header, Kind};
use protocol::interface::{BodyMesh, Facets, PointWall, Points, Response};
use protocol::link::{Expect, Link, LinkError};

use super::line::{Line, Terms};

/// Steps before the wall begins to move.
const STILL: u64 = 3;
/// How far its acceleration takes it within the square of a time step, in its thickness.
const JERK: f64 = 1e-5;
/// m_r of the wall, kg/m2; any wall would do.
const RESPONSE_MASS: f64 = 10.0;

/// A fluid on the line.
pub(super) struct FluidLine<'l> {
    link: Box<dyn Link<f64> + 'l>,
    dimension: usize,
    response: Response,
    /// Where the wall has its nodes, or the fluid its points, `[n, D]` m.
    reference: Vec<f64>,
    /// Outward unit normal at each point, `[n, D]`; none at the nodes of a dummy mesh.
    normals: Vec<f64>,
    /// The axis the wall moves along.
    across: usize,
    /// Its acceleration times the square of the step, m.
    stride: f64,
    load_len: usize,
    fault: Option<String>,
    /// Pressures, then forces.
    load: Vec<f64>,
}

impl<'l> FluidLine<'l> {
    /// Gives a dummy mesh of one cell over the body.
    pub(super) fn with_mesh(mut link: Box<dyn Link<f64> + 'l>, terms: &Terms<'_>) -> Result<Self, LinkError> {
        let mesh = one_cell(terms.outline, terms.response);
        let values = mesh.encode();
        send(&mut *link, Kind::BodyMesh, &values)?;
        let load_len = mesh.facets.markers().len() + mesh.reference_position.len();
        Ok(Self::new(link, terms, (mesh.reference_position, Vec::new(), load_len)))
    }

    /// Takes the fluid's points and tells it of the wall behind them.
    pub(super) fn with_points(
        mut link: Box<dyn Link<f64> + 'l>,
        terms: &Terms<'_>,
    ) -> Result<Self, LinkError> {
        let mut points = None;
        let expect = Expect { kind: Kind::Points, step: 0, count: None };
        link.receive(expect, &mut |_, values| points = Some(Points::decode(values, "fluid")))?;
        let points = points.expect("a message that was received was read")?;
        let wall = PointWall { response: terms.response, response_mass: vec![RESPONSE_MASS; points.len()] };
        send(&mut *link, Kind::PointWall, &wall.encode())?;
        let (planned, dimension) = (terms.contract.node_count, terms.contract.dimension);
        let faults = [
            (points.dimension != dimension, format!("points in {} dimensions", points.dimension)),
            (points.len() != planned, format!("{} points, {planned} were planned", points.len())),
            (points.markers().is_empty(), "no point has an area".to_owned()),
        ];
        let fault = faults.into_iter().find(|(is_fault, _)| *is_fault).map(|(_, what)| what);
        let positions = points.reference_position.chunks_exact(points.dimension);
        let normals = positions.flat_map(|position| normal(terms.outline, position)).collect();
        let load_len = points.load_len();
        Ok(Self { fault, ..Self::new(link, terms, (points.reference_position, normals, load_len)) })
    }

    fn new(
        link: Box<dyn Link<f64> + 'l>,
        terms: &Terms<'_>,
        (reference, normals, load_len): (Vec<f64>, Vec<f64>, usize),
    ) -> Self {
        let across = terms.outline.thickness_axis();
        Self {
            link,
            dimension: terms.contract.dimension,
            response: terms.response,
            reference,
            normals,
            across,
            stride: JERK * terms.outline.region.length(across),
            load_len,
            fault: None,
            load: Vec::new(),
        }
    }

    /// The message of a step, as the response asks for it.
    fn motion(&self, at: StepTime) -> Vec<f64> {
        let begun = at.step.saturating_sub(STILL);
        let moves = begun > 0;
        let strides = begun.saturating_sub(1) as f64;
        let acceleration = if moves { self.stride / at.dt.powi(2) } else { 0.0 };
        // A Robin wall is told where it would be at the end of the step, the others how fast they go in it.
        let velocity = if moves { self.stride / at.dt * (strides + 1.0) } else { 0.0 };
        let shift = 0.5 * self.stride * strides.powi(2);
        let along = |value: f64| {
            let axes = 0..self.reference.len();
            axes.map(move |index| if index % self.dimension == self.across { value } else { 0.0 })
        };
        let mut values = Vec::new();
        if self.response == Response::Robin {
            values.push(f64::from(u8::from(moves)));
        }
        values.extend(self.reference.iter().zip(along(shift)).map(|(position, shift)| position + shift));
        values.extend(along(velocity));
        if self.response == Response::Prescribed {
            values.extend(along(acceleration));
        }
        values.extend(&self.normals);
        values
    }
}

impl Line for FluidLine<'_> {
    fn give(&mut self, at: StepTime) -> Result<(), LinkError> {
        let values = self.motion(at);
        let header = Header::new(Kind::Motion, at.step, at.time, at.dt);
        self.link.send(header, values.len(), &mut |out| out.copy_from_slice(&values))
    }

    fn take(&mut self, step: u64) -> Result<(), LinkError> {
        let load = &mut self.load;
        load.clear();
        let expect = Expect { kind: Kind::Load, step, count: Some(self.load_len) };
        self.link.receive(expect, &mut |_, values| load.extend(values))
    }

    fn answer(&self) -> &[f64] {
        &self.load
    }

    fn fault(&self) -> Option<String> {
        self.fault.clone()
    }
}

fn send(link: &mut dyn Link<f64>, kind: Kind, values: &[f64]) -> Result<(), LinkError> {
    link.send(Header::new(kind, 0, 0.0, 0.0), values.len(), &mut |out| out.copy_from_slice(values))
}

/// Nodes of [`one_cell`].
pub(super) fn mesh_nodes(dimension: usize) -> usize {
    1 << dimension
}

/// The smallest dummy mesh: one cell over the body, its first axis across the wall.
fn one_cell(outline: &SolidOutline, response: Response) -> BodyMesh {
    let dimension = outline.region.min.len();
    let mut axes = vec![outline.thickness_axis()];
    axes.extend((0..dimension).filter(|&axis| axis != axes[0]).collect::<Vec<_>>());
    // Bit k of a node's number says at which end of the k-th axis it lies.
    let bit = |axis: usize| 1 << axes.iter().position(|&a| a == axis).expect("the cell has all axes");
    let nodes = mesh_nodes(dimension);
    let place = |node: usize, axis: usize| {
        let corner = if node & bit(axis) == 0 { &outline.region.min } else { &outline.region.max };
        corner[axis]
    };
    let reference_position =
        (0..nodes).flat_map(|node| (0..dimension).map(move |axis| (node, axis))).map(|(n, a)| place(n, a));
    let mut facets = Facets { nodes_per_facet: nodes / 2, ..Facets::default() };
    for face in outline.interface_faces() {
        let base = if face.sign() > 0.0 { bit(face.axis()) } else { 0 };
        let (u, v) = ((face.axis() + 1) % dimension, (face.axis() + 2) % dimension);
        // Around the face of a cell, or along it, so that the normal points along its axis.
        let mut corners = match dimension {
            2 if face.axis() == 0 => vec![base, base | bit(u)],
            2 => vec![base | bit(u), base],
            _ => vec![base, base | bit(u), base | bit(u) | bit(v), base | bit(v)],
        };
        if face.sign() < 0.0 {
            corners.reverse();
        }
        facets.nodes.extend(corners);
        facets.face.push(face as usize);
    }
    BodyMesh {
        dimension,
        reference_position: reference_position.collect(),
        cells: (0..nodes).collect(),
        facets,
        response_mass: vec![RESPONSE_MASS; nodes],
        response,
    }
}

/// Outward normal of the face of the body that is nearest to a point.
fn normal(outline: &SolidOutline, position: &[f64]) -> Vec<f64> {
    let region = &outline.region;
    let distance = |face: &BoxFace| {
        let corner = if face.sign() < 0.0 { &region.min } else { &region.max };
        position.get(face.axis()).map_or(f64::INFINITY, |place| (place - corner[face.axis()]).abs())
    };
    let mut faces = outline.interface_faces();
    faces.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    let mut normal = vec![0.0; position.len()];
    if let Some(face) = faces.first().filter(|face| face.axis() < normal.len()) {
        normal[face.axis()] = face.sign();
    }
    normal
}

#[cfg(test)]
mod tests {
    use protocol::case::BoxRegion;

    use super::*;

    fn outline(dimension: usize) -> SolidOutline {
        let (min, max) = ([0.2, 0.0, -1.0], [0.3, 0.5, 1.0]);
        SolidOutline {
            model: "fem".to_owned(),
            mesh: None,
            region: BoxRegion { min: min[..dimension].to_vec(), max: max[..dimension].to_vec() },
            elements: vec![1; dimension],
            has_middle_nodes: false,
            wet: BoxFace::ALL[..2 * dimension].to_vec(),
            clamped: Vec::new(),
            density: None,
            young_modulus: None,
            prescribed: false,
        }
    }

    /// Normal of a facet by the rule of `Facets`, not normalised.
    fn facet_normal(mesh: &BodyMesh, facet: usize) -> Vec<f64> {
        let node = |corner: usize| {
            let first = mesh.facets.facet(facet)[corner] * mesh.dimension;
            &mesh.reference_position[first..first + mesh.dimension]
        };
        let edge = |to: usize| -> Vec<f64> { node(to).iter().zip(node(0)).map(|(b, a)| b - a).collect() };
        let a = edge(1);
        if mesh.dimension == 2 {
            return vec![a[1], -a[0]];
        }
        let b = edge(3);
        (0..3).map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]).collect()
    }

    #[test]
    fn the_faces_of_the_cell_point_outwards() {
        for dimension in [2, 3] {
            let mesh = one_cell(&outline(dimension), Response::Given);
            assert_eq!(mesh.facets.len(), 2 * dimension);
            for facet in 0..mesh.facets.len() {
                let face = BoxFace::ALL[mesh.facets.face[facet]];
                assert!(
                    facet_normal(&mesh, facet)[face.axis()] * face.sign() > 0.0,
                    "{dimension}-D, {face:?}"
                );
            }
        }
    }

    #[test]
    fn a_point_has_the_normal_of_the_face_next_to_it() {
        assert_eq!(normal(&outline(2), &[0.2, 0.25]), [-1.0, 0.0]);
        assert_eq!(normal(&outline(2), &[0.25, 0.49]), [0.0, 1.0]);
        assert_eq!(normal(&outline(3), &[0.24, 0.25, 0.99]), [0.0, 0.0, 1.0]);
    }
}
