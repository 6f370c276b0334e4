//! The once-sent meshes as numbers, and the way back, every number checked.

use super::{BodyMesh, Facets, Response, Surface};
use crate::link::LinkError;

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
        let mut reader = Reader::new(values, peer);
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
        self.response.motion_len(self.node_count() * self.dimension)
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
        let mut reader = Reader::new(values, peer);
        let dimension = reader.whole()?;
        let node_count = reader.whole()?;
        let response = reader.response()?;
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
pub(super) struct Reader<'a> {
    values: &'a [f64],
    at: usize,
    peer: &'a str,
}

impl<'a> Reader<'a> {
    pub(super) fn new(values: &'a [f64], peer: &'a str) -> Self {
        Self { values, at: 0, peer }
    }

    pub(super) fn garbled(&self, what: &str) -> LinkError {
        LinkError::Garbled { peer: self.peer.to_owned(), what: format!("{what} at value {}", self.at) }
    }

    pub(super) fn floats(&mut self, count: usize) -> Result<Vec<f64>, LinkError> {
        let end = self.at.checked_add(count).filter(|&end| end <= self.values.len());
        let end = end.ok_or_else(|| self.garbled("message too short"))?;
        let floats = self.values[self.at..end].to_vec();
        self.at = end;
        Ok(floats)
    }

    pub(super) fn whole(&mut self) -> Result<usize, LinkError> {
        let value = self.floats(1)?[0];
        if value >= 0.0 && value.fract() == 0.0 && value <= u32::MAX as f64 {
            Ok(value as usize)
        } else {
            Err(self.garbled("no whole number"))
        }
    }

    pub(super) fn response(&mut self) -> Result<Response, LinkError> {
        match self.whole()? {
            0 => Ok(Response::Robin),
            1 => Ok(Response::Given),
            2 => Ok(Response::Prescribed),
            _ => Err(self.garbled("unknown response")),
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

    pub(super) fn finish(&self) -> Result<(), LinkError> {
        if self.at == self.values.len() { Ok(()) } else { Err(self.garbled("message too long")) }
    }
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
    fn a_lying_node_number_is_refused() {
        let mut values = corner().encode();
        let last_node = values.len() - 3;
        values[last_node] = 3.0;
        assert!(matches!(Surface::decode(&values, "solid"), Err(LinkError::Garbled { .. })));
        values.truncate(last_node);
        assert!(matches!(Surface::decode(&values, "solid"), Err(LinkError::Garbled { .. })));
    }
}
