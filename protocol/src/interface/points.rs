//! The fluid's side of the interface without a mesh: points, each with a position and an area.

use super::Response;
use super::encoding::Reader;
use crate::link::LinkError;

/// The points a fluid offers in place of a dummy mesh.
///
/// Each moves with the structure's surface under it, and turns with it if it lies off that: particles inside the body may be
/// among them. A force can act at every point; a pressure belongs to those that have an area.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Points {
    /// 2 or 3.
    pub dimension: usize,
    /// Places at the unloaded body, `[n, D]` m.
    pub reference_position: Vec<f64>,
    /// Wet area each stands for, `[n]` m2 (in 2-D length, m); 0 where the fluid has no pressure to give.
    pub area: Vec<f64>,
}

/// What the fluid is told of the wall behind its points.
#[derive(Debug, Clone, PartialEq)]
pub struct PointWall {
    /// How the fluid must treat the motion.
    pub response: Response,
    /// m_r of the Robin wall, `[n]` kg/m2; not used by the other responses.
    pub response_mass: Vec<f64>,
}

impl Points {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.area.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.area.is_empty()
    }

    /// The points that have an area: the order of every array of pressures, `[m]`.
    pub fn markers(&self) -> Vec<usize> {
        (0..self.len()).filter(|&point| self.area[point] > 0.0).collect()
    }

    /// Number of values of the fluid's load message: a pressure per area, a force per point.
    pub fn load_len(&self) -> usize {
        self.markers().len() + self.reference_position.len()
    }

    /// The numbers that travel.
    pub fn encode(&self) -> Vec<f64> {
        let mut out = vec![self.dimension as f64, self.len() as f64];
        out.extend_from_slice(&self.reference_position);
        out.extend_from_slice(&self.area);
        out
    }

    /// Reads the numbers back.
    ///
    /// # Errors
    /// [`LinkError::Garbled`] when the numbers are no points: another dimension, an area below zero.
    pub fn decode(values: &[f64], peer: &str) -> Result<Self, LinkError> {
        let mut reader = Reader::new(values, peer);
        let dimension = reader.whole()?;
        if !(2..=3).contains(&dimension) {
            return Err(reader.garbled("points are in 2 or 3 dimensions"));
        }
        let count = reader.whole()?;
        let reference_position = reader.floats(count.saturating_mul(dimension))?;
        let area = reader.floats(count)?;
        if area.iter().any(|&area| area < 0.0) {
            return Err(reader.garbled("an area below zero before"));
        }
        reader.finish()?;
        Ok(Self { dimension, reference_position, area })
    }
}

impl PointWall {
    /// Number of values of one motion message from the coupler to the fluid; the normals come last.
    pub fn motion_len(&self, dimension: usize) -> usize {
        let block = self.response_mass.len() * dimension;
        self.response.motion_len(block) + block
    }

    /// The numbers that travel.
    pub fn encode(&self) -> Vec<f64> {
        let mut out = vec![self.response as usize as f64, self.response_mass.len() as f64];
        out.extend_from_slice(&self.response_mass);
        out
    }

    /// Reads the numbers back.
    ///
    /// # Errors
    /// [`LinkError::Garbled`] when the numbers are none of these.
    pub fn decode(values: &[f64], peer: &str) -> Result<Self, LinkError> {
        let mut reader = Reader::new(values, peer);
        let response = reader.response()?;
        let count = reader.whole()?;
        let response_mass = reader.floats(count)?;
        reader.finish()?;
        Ok(Self { response, response_mass })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points() -> Points {
        Points {
            dimension: 2,
            reference_position: vec![0.1, 0.0, 0.1, 0.2, 0.3, 0.4],
            area: vec![0.0, 0.5, 0.25],
        }
    }

    #[test]
    fn points_and_the_wall_behind_them_survive_the_journey() {
        let points = points();
        assert_eq!(Points::decode(&points.encode(), "fluid").unwrap(), points);
        assert_eq!((points.markers(), points.load_len()), (vec![1, 2], 2 + 6));
        for (response, values) in
            [(Response::Robin, 1 + 18), (Response::Given, 18), (Response::Prescribed, 24)]
        {
            let wall = PointWall { response, response_mass: vec![1.0, 2.0, 3.0] };
            assert_eq!(PointWall::decode(&wall.encode(), "coupler").unwrap(), wall);
            assert_eq!(wall.motion_len(2), values);
        }
    }

    #[test]
    fn an_area_below_zero_and_a_flat_land_are_refused() {
        let mut values = points().encode();
        *values.last_mut().unwrap() = -0.25;
        assert!(matches!(Points::decode(&values, "fluid"), Err(LinkError::Garbled { .. })));
        let mut values = points().encode();
        values[0] = 1.0;
        assert!(matches!(Points::decode(&values, "fluid"), Err(LinkError::Garbled { .. })));
    }
}
