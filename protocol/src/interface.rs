//! What the programs know about each other's side of the interface, and the layout of what travels at each step.
//!
//! All arrays are flat, node after node, `D` components each. In 2-D everything is per metre of depth.
//!
//! | message | from -> to | payload |
//! |---|---|---|
//! | [`Surface`] | solid -> coupler, once | nodes, facets, areal mass |
//! | [`BodyMesh`] | coupler -> fluid, once | nodes, cells, facets, response mass |
//! | motion | solid -> coupler | displacement `[n, D]` m, velocity `[n, D]` m/s, acceleration `[n, D]` m/s2 |
//! | motion | coupler -> fluid | position `[n, D]` m, velocity `[n, D]` m/s, and for [`Response::Prescribed`] acceleration |
//! | load | fluid -> coupler | marker pressure `[m]` Pa, pair force `[n, D]` N |
//! | load | coupler -> solid | which acts (0 nodal force, 1 traction), nodal force `[n, D]` N, traction `[m, D]` Pa |

use crate::link::LinkError;

/// Which of the two loads in a load message acts on the solid; its number is the first value of the message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActingLoad {
    /// The nodal forces.
    NodalForce = 0,
    /// The tractions at the markers, to be integrated over the facets in their current place.
    Traction = 1,
}

/// Facets of a surface: segments of two nodes in 2-D, triangles or quadrilaterals in 3-D.
///
/// The outward normal is on the right of a segment a -> b; facets in 3-D are counter-clockwise seen from outside.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Facets {
    /// Nodes per facet: 2 in 2-D, 3 or 4 in 3-D.
    pub nodes_per_facet: usize,
    /// Node numbers, facet after facet, `[f, nodes_per_facet]`.
    pub nodes: Vec<usize>,
    /// Smooth face each facet belongs to, `[f]`; a node at an edge has one marker for each face it belongs to.
    pub face: Vec<usize>,
}

/// A point of the fluid at a surface node where the pressure is taken from the particles around (the paper's
/// "interface marker"): one for every pair of face and node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct InterfaceMarker {
    /// The face it belongs to; decides its normal.
    pub face: usize,
    /// The surface node it sits on.
    pub node: usize,
}

impl Facets {
    /// Number of facets.
    pub fn len(&self) -> usize {
        self.face.len()
    }

    /// Whether there is no facet.
    pub fn is_empty(&self) -> bool {
        self.face.is_empty()
    }

    /// The nodes of one facet.
    pub fn facet(&self, facet: usize) -> &[usize] {
        &self.nodes[facet * self.nodes_per_facet..(facet + 1) * self.nodes_per_facet]
    }

    /// All markers, sorted by face, then node: the order of every marker array.
    pub fn markers(&self) -> Vec<InterfaceMarker> {
        let mut markers: Vec<_> = (0..self.len())
            .flat_map(|facet| {
                let face = self.face[facet];
                self.facet(facet).iter().map(move |&node| InterfaceMarker { face, node })
            })
            .collect();
        markers.sort_unstable();
        markers.dedup();
        markers
    }
}

/// The solid's surface that water may touch.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surface {
    /// 2 or 3.
    pub dimension: usize,
    /// Node positions of the unloaded body, `[n, D]` m.
    pub reference_position: Vec<f64>,
    /// The wet facets.
    pub facets: Facets,
    /// Mass of the wall behind each node per wet area: density times local thickness over the number of wet sides,
    /// `[n]` kg/m2; 0 for a body that does not respond (rigid).
    pub areal_mass: Vec<f64>,
}

/// How the interface moves, as the fluid must treat it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Response {
    /// Robin wall: the velocity given is v_n + dt a_n at the true position, and the wall gives way by dt/m_r (p1 - p0).
    Robin = 0,
    /// The position at the start of the step and the velocity over it are given (conventional serial staggered).
    Given = 1,
    /// As given, of a motion known beforehand; the acceleration travels too and shifts the wall pressure.
    Prescribed = 2,
}

/// The fluid's side of the interface, made by the coupler: the surface of the paper's dummy mesh and the cells the
/// fluid embeds its obstacle particles in.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyMesh {
    /// 2 or 3.
    pub dimension: usize,
    /// Node positions of the unloaded body, `[n, D]` m.
    pub reference_position: Vec<f64>,
    /// Cells spanned by the nodes, `[c, 2^D]`, first local axis across the wall, first axis fastest:
    /// (-,-,-) (+,-,-) (-,+,-) (+,+,-) (-,-,+) ...
    pub cells: Vec<usize>,
    /// The wet facets.
    pub facets: Facets,
    /// m_r of the Robin wall, `[n]` kg/m2; not used by the other responses.
    pub response_mass: Vec<f64>,
    /// How the fluid must treat the motion.
    pub response: Response,
}

/// What both ends of a data link must agree on before the first step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contract {
    /// 2 or 3.
    pub dimension: usize,
    /// Number of interface nodes.
    pub node_count: usize,
    /// End of the run, s.
    pub end_time: f64,
    /// CRC-32 of the resolved case both must have read.
    pub scene: u32,
}

impl std::fmt::Display for Contract {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { dimension, node_count, end_time, scene } = self;
        write!(f, "{dimension}-D, {node_count} interface nodes, end {end_time} s, scene {scene:08x}")
    }
}

impl Contract {
    /// The numbers that travel.
    pub fn encode(&self) -> [f64; 4] {
        [self.dimension as f64, self.node_count as f64, self.end_time, f64::from(self.scene)]
    }

    /// Reads the numbers back.
    ///
    /// # Errors
    /// [`LinkError::Garbled`] when they are no contract.
    pub fn decode(values: &[f64], peer: &str) -> Result<Self, LinkError> {
        let mut reader = Reader { values, at: 0, peer };
        let (dimension, node_count) = (reader.whole()?, reader.whole()?);
        let end_time = reader.floats(1)?[0];
        let scene = reader.whole()? as u32;
        reader.finish()?;
        Ok(Self { dimension, node_count, end_time, scene })
    }
}

impl Surface {
    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.areal_mass.len()
    }

    /// The numbers that travel.
    pub fn encode(&self) -> Vec<f64> {
        let mut out = vec![self.dimension as f64, self.node_count() as f64];
        out.extend_from_slice(&self.reference_position);
        out.extend_from_slice(&self.areal_mass);
        encode_facets(&self.facets, &mut out);
        out
    }

    /// Reads the numbers back; every index is checked.
    ///
    /// # Errors
    /// [`LinkError::Garbled`] when the numbers are no surface.
    pub fn decode(values: &[f64], peer: &str) -> Result<Self, LinkError> {
        let mut reader = Reader { values, at: 0, peer };
        let dimension = reader.whole()?;
        let node_count = reader.whole()?;
        let reference_position = reader.floats(node_count.saturating_mul(dimension))?;
        let areal_mass = reader.floats(node_count)?;
        let facets = reader.facets(node_count)?;
        reader.finish()?;
        Ok(Self { dimension, reference_position, facets, areal_mass })
    }
}

impl BodyMesh {
    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.response_mass.len()
    }

    /// Number of values of one motion message from the coupler to the fluid.
    pub fn motion_len(&self) -> usize {
        let blocks = if self.response == Response::Prescribed { 3 } else { 2 };
        blocks * self.node_count() * self.dimension
    }

    /// The numbers that travel.
    pub fn encode(&self) -> Vec<f64> {
        let mut out = vec![self.dimension as f64, self.node_count() as f64, self.response as usize as f64];
        out.extend_from_slice(&self.reference_position);
        out.extend_from_slice(&self.response_mass);
        out.push(self.cells.len() as f64);
        out.extend(self.cells.iter().map(|&node| node as f64));
        encode_facets(&self.facets, &mut out);
        out
    }

    /// Reads the numbers back; every index is checked.
    ///
    /// # Errors
    /// [`LinkError::Garbled`] when the numbers are no body mesh.
    pub fn decode(values: &[f64], peer: &str) -> Result<Self, LinkError> {
        let mut reader = Reader { values, at: 0, peer };
        let dimension = reader.whole()?;
        let node_count = reader.whole()?;
        let response = match reader.whole()? {
            0 => Response::Robin,
            1 => Response::Given,
            2 => Response::Prescribed,
            _ => return Err(reader.garbled("unknown response")),
        };
        let reference_position = reader.floats(node_count.saturating_mul(dimension))?;
        let response_mass = reader.floats(node_count)?;
        let cell_len = reader.whole()?;
        let cells = reader.indices(cell_len, node_count)?;
        let facets = reader.facets(node_count)?;
        reader.finish()?;
        Ok(Self { dimension, reference_position, cells, facets, response_mass, response })
    }
}

fn encode_facets(facets: &Facets, out: &mut Vec<f64>) {
    out.push(facets.nodes_per_facet as f64);
    out.push(facets.len() as f64);
    out.extend(facets.nodes.iter().map(|&node| node as f64));
    out.extend(facets.face.iter().map(|&face| face as f64));
}

/// Walks through a received message; never indexes with a number it has not checked.
struct Reader<'a> {
    values: &'a [f64],
    at: usize,
    peer: &'a str,
}

impl Reader<'_> {
    fn garbled(&self, what: &str) -> LinkError {
        LinkError::Garbled { peer: self.peer.to_owned(), what: format!("{what} at value {}", self.at) }
    }

    fn floats(&mut self, count: usize) -> Result<Vec<f64>, LinkError> {
        let end = self.at.checked_add(count).filter(|&end| end <= self.values.len());
        let end = end.ok_or_else(|| self.garbled("message too short"))?;
        let floats = self.values[self.at..end].to_vec();
        self.at = end;
        Ok(floats)
    }

    fn whole(&mut self) -> Result<usize, LinkError> {
        let value = self.floats(1)?[0];
        if value >= 0.0 && value.fract() == 0.0 && value <= u32::MAX as f64 {
            Ok(value as usize)
        } else {
            Err(self.garbled("no whole number"))
        }
    }

    fn indices(&mut self, count: usize, limit: usize) -> Result<Vec<usize>, LinkError> {
        let values = self.floats(count)?;
        let valid = |&value: &f64| value >= 0.0 && value.fract() == 0.0 && value < limit as f64;
        if values.iter().all(valid) {
            Ok(values.into_iter().map(|value| value as usize).collect())
        } else {
            Err(self.garbled("node number out of range before"))
        }
    }

    fn facets(&mut self, node_count: usize) -> Result<Facets, LinkError> {
        let nodes_per_facet = self.whole()?;
        let facet_count = self.whole()?;
        let nodes = self.indices(facet_count.saturating_mul(nodes_per_facet), node_count)?;
        let face = self.indices(facet_count, u32::MAX as usize)?;
        Ok(Facets { nodes_per_facet, nodes, face })
    }

    fn finish(&self) -> Result<(), LinkError> {
        if self.at == self.values.len() { Ok(()) } else { Err(self.garbled("message too long")) }
    }
}

/// Nodal forces `[n, D]` N of tractions `[m, D]` Pa at the markers, integrated over the facets in their current place
/// with the facets' own linear or bilinear shape functions. Added to `force`.
///
/// Exact for tractions linear on segments and triangles; 2 x 2 Gauss points on quadrilaterals. In 2-D per metre of depth.
pub fn add_traction_forces(
    facets: &Facets,
    markers: &[InterfaceMarker],
    position: &[f64],
    traction: &[f64],
    force: &mut [f64],
) {
    let dimension = if facets.nodes_per_facet == 2 { 2 } else { 3 };
    let marker_of = |face: usize, node: usize| {
        markers
            .binary_search(&InterfaceMarker { face, node })
            .expect("every facet node has a marker of its face")
    };
    for facet in 0..facets.len() {
        let nodes = facets.facet(facet);
        let mut points = [[0.0; 3]; 4];
        let mut stress = [[0.0; 3]; 4];
        for (corner, &node) in nodes.iter().enumerate() {
            let marker = marker_of(facets.face[facet], node);
            points[corner][..dimension].copy_from_slice(&position[node * dimension..][..dimension]);
            stress[corner][..dimension].copy_from_slice(&traction[marker * dimension..][..dimension]);
        }
        let nodal = facet_forces(&points[..nodes.len()], &stress[..nodes.len()]);
        for (corner, &node) in nodes.iter().enumerate() {
            for axis in 0..dimension {
                force[node * dimension + axis] += nodal[corner][axis];
            }
        }
    }
}

fn facet_forces(points: &[[f64; 3]], stress: &[[f64; 3]]) -> [[f64; 3]; 4] {
    let mut nodal = [[0.0; 3]; 4];
    let corners = points.len();
    if corners == 4 {
        let g = 1.0 / 3f64.sqrt();
        for (xi, eta) in [(-g, -g), (g, -g), (g, g), (-g, g)] {
            let shape = bilinear(xi, eta);
            let weight = norm(cross(tangent(points, eta, true), tangent(points, xi, false)));
            for (a, &na) in shape.iter().enumerate() {
                for (b, &nb) in shape.iter().enumerate() {
                    (0..3).for_each(|axis| nodal[a][axis] += weight * na * nb * stress[b][axis]);
                }
            }
        }
        return nodal;
    }
    // Mass matrix of linear shape functions: size / (n (n + 1)) (1 + delta_ab), n nodes.
    let edge = sub(points[1], points[0]);
    let size = if corners == 2 { norm(edge) } else { 0.5 * norm(cross(edge, sub(points[2], points[0]))) };
    let unit = size / (corners * (corners + 1)) as f64;
    for a in 0..corners {
        for b in 0..corners {
            let weight = if a == b { 2.0 * unit } else { unit };
            (0..3).for_each(|axis| nodal[a][axis] += weight * stress[b][axis]);
        }
    }
    nodal
}

/// Bilinear shape functions of a quadrilateral, counter-clockwise from (-1, -1).
fn bilinear(xi: f64, eta: f64) -> [f64; 4] {
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(a, b)| 0.25 * (1.0 + a * xi) * (1.0 + b * eta))
}

/// Derivative of a quadrilateral's position along its first (at fixed `other` = eta) or second local axis.
fn tangent(points: &[[f64; 3]], other: f64, first: bool) -> [f64; 3] {
    let (low, high) = if first {
        (sub(points[1], points[0]), sub(points[2], points[3]))
    } else {
        (sub(points[3], points[0]), sub(points[2], points[1]))
    };
    std::array::from_fn(|axis| 0.25 * ((1.0 - other) * low[axis] + (1.0 + other) * high[axis]))
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn norm(a: [f64; 3]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner() -> Surface {
        let facets = Facets { nodes_per_facet: 2, nodes: vec![0, 1, 1, 2], face: vec![0, 1] };
        Surface {
            dimension: 2,
            reference_position: vec![1.0, 0.0, 1.0, 1.0, 0.0, 1.0],
            facets,
            areal_mass: vec![1.0, 2.0, 3.0],
        }
    }

    #[test]
    fn a_corner_node_has_one_marker_per_face() {
        let markers = corner().facets.markers();
        let pairs: Vec<_> = markers.iter().map(|marker| (marker.face, marker.node)).collect();
        assert_eq!(pairs, [(0, 0), (0, 1), (1, 1), (1, 2)]);
    }

    #[test]
    fn surface_and_body_mesh_survive_the_journey() {
        let surface = corner();
        assert_eq!(Surface::decode(&surface.encode(), "solid").unwrap(), surface);
        let mesh = BodyMesh {
            dimension: 2,
            reference_position: surface.reference_position.clone(),
            cells: vec![0, 1, 2, 2],
            facets: surface.facets.clone(),
            response_mass: surface.areal_mass.clone(),
            response: Response::Prescribed,
        };
        assert_eq!(BodyMesh::decode(&mesh.encode(), "coupler").unwrap(), mesh);
        assert_eq!(mesh.motion_len(), 18);
    }

    #[test]
    fn a_uniform_traction_gives_the_area_times_it_shared_by_the_corners() {
        let quad = Facets { nodes_per_facet: 4, nodes: vec![0, 1, 2, 3], face: vec![0] };
        let position = [0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 3.0, 0.0, 0.0, 3.0, 0.0];
        let traction = [0.0, 0.0, 5.0].repeat(4);
        let mut force = vec![0.0; 12];
        add_traction_forces(&quad, &quad.markers(), &position, &traction, &mut force);
        assert!(force.chunks(3).all(|f| (f[2] - 7.5).abs() < 1e-12), "{force:?}");
        // Linear traction t = x on a segment from 0 to 2: nodal forces 2/3 and 4/3.
        let segment = Facets { nodes_per_facet: 2, nodes: vec![0, 1], face: vec![0] };
        let mut force = vec![0.0; 4];
        add_traction_forces(
            &segment,
            &segment.markers(),
            &[0.0, 0.0, 2.0, 0.0],
            &[0.0, 0.0, 0.0, 2.0],
            &mut force,
        );
        assert!((force[1] - 2.0 / 3.0).abs() < 1e-15 && (force[3] - 4.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn a_lying_node_number_is_refused() {
        let mut values = corner().encode();
        let last_node = values.len() - 3;
        values[last_node] = 3.0;
        assert!(matches!(Surface::decode(&values, "solid"), Err(LinkError::Garbled { .. })));
        values.truncate(last_node);
        assert!(matches!(Surface::decode(&values, "solid"), Err(LinkError::Garbled { .. })));
    }
}
