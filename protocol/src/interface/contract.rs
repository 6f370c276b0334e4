//! What both ends of a data link must agree on before the first step.

use super::encoding::Reader;
use crate::link::LinkError;

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
        let mut reader = Reader::new(values, peer);
        let (dimension, node_count) = (reader.whole()?, reader.whole()?);
        let end_time = reader.floats(1)?[0];
        let scene = reader.whole()? as u32;
        reader.finish()?;
        Ok(Self { dimension, node_count, end_time, scene })
    }
}
