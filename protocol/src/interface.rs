//! What the programs know about each other's side of the interface, and the layout of what travels at each step.
//!
//! All arrays are flat, node after node, `D` components each. In 2-D everything is per metre of depth.
//!
//! | message | from -> to | payload |
//! |---|---|---|
//! | [`Surface`] | solid -> coupler, once | nodes, facets, areal mass |
//! | [`BodyMesh`] | coupler -> fluid, once | nodes, cells, facets, response mass |
//! | [`Points`] | fluid -> coupler, once, in place of the dummy mesh | points, area of each |
//! | [`PointWall`] | coupler -> fluid, once, in answer | response mass |
//! | motion | solid -> coupler | displacement `[n, D]` m, velocity `[n, D]` m/s, acceleration `[n, D]` m/s2 |
//! | motion | coupler -> fluid | for [`Response::Robin`] whether the wall gives way in this step (1) or moves as given (0); position `[n, D]` m, velocity `[n, D]` m/s; for [`Response::Prescribed`] acceleration; at points the structure's outward unit normal `[n, D]` |
//! | load | fluid -> coupler | marker pressure `[m]` Pa (at points: of those with an area), pair force `[n, D]` N |
//! | load | coupler -> solid | which acts (0 nodal force, 1 traction), nodal force `[n, D]` N, traction `[m, D]` Pa |

mod contract;
mod encoding;
mod points;
mod traction;

pub use contract::Contract;
pub use points::{PointWall, Points};
pub use traction::add_traction_forces;

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

    /// Number of the marker at each corner of each facet, `[f, nodes_per_facet]`, into [`Facets::markers`].
    pub fn corner_markers(&self) -> Vec<usize> {
        let markers = self.markers();
        let corner = |(corner, &node): (usize, &usize)| {
            let face = self.face[corner / self.nodes_per_facet];
            let marker = markers.binary_search(&InterfaceMarker { face, node });
            marker.expect("every facet node has a marker of its face")
        };
        self.nodes.iter().enumerate().map(corner).collect()
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
    /// Robin wall: the velocity given is v_n + dt a_n at the true position, and the wall gives way by dt/m_r (p1 - p0);
    /// in steps of which the message says so it moves as given.
    Robin = 0,
    /// The position at the start of the step and the velocity over it are given (conventional serial staggered).
    Given = 1,
    /// As given, of a motion known beforehand; the acceleration travels too and shifts the wall pressure.
    Prescribed = 2,
}

impl Response {
    /// Number of values of a motion message without normals; `block` is that of one value per node and axis.
    pub(crate) fn motion_len(self, block: usize) -> usize {
        match self {
            Self::Robin => 1 + 2 * block,
            Self::Given => 2 * block,
            Self::Prescribed => 3 * block,
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_node_has_one_marker_per_face() {
        let markers = Facets { nodes_per_facet: 2, nodes: vec![0, 1, 1, 2], face: vec![0, 1] }.markers();
        let pairs: Vec<_> = markers.iter().map(|marker| (marker.face, marker.node)).collect();
        assert_eq!(pairs, [(0, 0), (0, 1), (1, 1), (1, 2)]);
    }
}
