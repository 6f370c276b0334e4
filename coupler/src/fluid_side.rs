//! What the water's side of the interface is made of: the dummy mesh, or the points the fluid offers.

use protocol::interface::{BodyMesh, PointWall, Points, Response};

use crate::dummy_mesh::DummyMesh;

/// The fluid's side of the interface.
#[derive(Debug, Clone)]
pub enum FluidSide {
    /// Nodes, facets and cells, for a fluid with a mesh and for particles that hang on one.
    DummyMesh(DummyMesh),
    /// Points with areas, for a fluid without any mesh.
    Points(Points),
}

/// What the fluid is told of its side in the handshake.
pub(crate) enum FirstWord {
    DummyMesh(BodyMesh),
    Points(PointWall, usize),
}

impl FluidSide {
    /// Number of nodes or points.
    pub fn node_count(&self) -> usize {
        match self {
            Self::DummyMesh(mesh) => mesh.node_count(),
            Self::Points(points) => points.len(),
        }
    }

    /// Their places at the unloaded body, `[n, D]` m.
    pub fn reference_position(&self) -> &[f64] {
        match self {
            Self::DummyMesh(mesh) => mesh.reference_position(),
            Self::Points(points) => &points.reference_position,
        }
    }

    /// What they are counted as.
    pub fn count_name(&self) -> &'static str {
        match self {
            Self::DummyMesh(_) => "dummy_nodes",
            Self::Points(_) => "interface_points",
        }
    }

    /// What the fluid must be told before the first step; `response_mass` is m_r per node, `[n]` kg/m2.
    pub(crate) fn first_word(&self, response_mass: Vec<f64>, response: Response) -> FirstWord {
        match self {
            Self::DummyMesh(mesh) => FirstWord::DummyMesh(mesh.body_mesh(response_mass, response)),
            Self::Points(points) => {
                FirstWord::Points(PointWall { response, response_mass }, points.dimension)
            }
        }
    }
}

impl FirstWord {
    /// Number of values of a motion message to the fluid.
    pub(crate) fn motion_len(&self) -> usize {
        match self {
            Self::DummyMesh(mesh) => mesh.motion_len(),
            Self::Points(wall, dimension) => wall.motion_len(*dimension),
        }
    }
}
