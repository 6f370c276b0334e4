//! A law in space brought to an element's dimension: space itself, plane strain, or plane stress.

use super::{History, Law, Material, Moduli, Unsolvable};

/// Places of xx, yy, xy among the components in space.
const PLACES: [usize; 3] = [0, 1, 3];

/// Iterations for the strain across a plate.
const ITERATIONS: usize = 40;

/// S, dS/dE and E in space.
type Whole = ([f64; 6], [[f64; 6]; 6], [f64; 6]);

/// A law for an element.
pub struct InSpace {
    law: Box<dyn Law>,
    /// The plate is free of stress across its plane.
    is_plane_stress: bool,
}

impl InSpace {
    /// The law; plane stress only matters to elements in 2-D.
    pub fn new(law: Box<dyn Law>, is_plane_stress: bool) -> Self {
        Self { law, is_plane_stress }
    }

    /// Response at a strain in the plane, and the strain in space: in plane stress that across is found by Newton's
    /// method on S_zz = 0 and condensed out of the moduli.
    fn plane(&self, strain: &[f64; 3], history: History<'_>) -> Result<Whole, Unsolvable> {
        let History { old, new } = history;
        let mut whole = [strain[0], strain[1], 0.0, strain[2], 0.0, 0.0];
        let (mut stress, mut moduli) = self.law.response(&whole, History { old, new })?;
        if !self.is_plane_stress {
            return Ok((stress, moduli, whole));
        }
        for _ in 0..ITERATIONS {
            // No step may turn the plate inside out.
            whole[2] = (whole[2] - stress[2] / moduli[2][2]).max(0.5 * (whole[2] - 0.5));
            (stress, moduli) = self.law.response(&whole, History { old, new })?;
            if stress[2].abs() <= 1e-13 * moduli[2][2] {
                let column: [f64; 6] = std::array::from_fn(|s| moduli[s][2]);
                for s in 0..6 {
                    for t in 0..6 {
                        moduli[s][t] -= column[s] * column[t] / column[2];
                    }
                }
                return Ok((stress, moduli, whole));
            }
        }
        Err(Unsolvable)
    }
}

impl Material<2, 3> for InSpace {
    fn history_len(&self) -> usize {
        self.law.history_len()
    }

    fn stress(&self, strain: &[f64; 3], history: History<'_>) -> Result<[f64; 3], Unsolvable> {
        let (stress, _, _) = self.plane(strain, history)?;
        Ok(PLACES.map(|place| stress[place]))
    }

    fn response(&self, strain: &[f64; 3], history: History<'_>) -> Result<([f64; 3], Moduli<3>), Unsolvable> {
        let (stress, moduli, _) = self.plane(strain, history)?;
        let moduli = PLACES.map(|row| PLACES.map(|column| moduli[row][column]));
        Ok((PLACES.map(|place| stress[place]), Moduli::Full(moduli)))
    }

    fn energy_density(&self, strain: &[f64; 3], old: &[f64]) -> f64 {
        let mut new = old.to_vec();
        match self.plane(strain, History { old, new: &mut new }) {
            Ok((_, _, whole)) => self.law.energy_density(&whole, old),
            Err(Unsolvable) => f64::NAN,
        }
    }

    fn in_space(&self, strain: &[f64; 3], old: &[f64]) -> ([f64; 6], f64) {
        let mut new = old.to_vec();
        match self.plane(strain, History { old, new: &mut new }) {
            Ok((stress, _, whole)) => (stress, (1.0 + 2.0 * whole[2]).sqrt()),
            Err(Unsolvable) => ([f64::NAN; 6], f64::NAN),
        }
    }
}

impl Material<3, 6> for InSpace {
    fn history_len(&self) -> usize {
        self.law.history_len()
    }

    fn stress(&self, strain: &[f64; 6], history: History<'_>) -> Result<[f64; 6], Unsolvable> {
        Ok(self.law.response(strain, history)?.0)
    }

    fn response(&self, strain: &[f64; 6], history: History<'_>) -> Result<([f64; 6], Moduli<6>), Unsolvable> {
        let (stress, moduli) = self.law.response(strain, history)?;
        Ok((stress, Moduli::Full(moduli)))
    }

    fn energy_density(&self, strain: &[f64; 6], old: &[f64]) -> f64 {
        self.law.energy_density(strain, old)
    }

    fn in_space(&self, strain: &[f64; 6], old: &[f64]) -> ([f64; 6], f64) {
        let mut new = old.to_vec();
        match self.law.response(strain, History { old, new: &mut new }) {
            Ok((stress, _)) => (stress, 1.0),
            Err(Unsolvable) => ([f64::NAN; 6], 1.0),
        }
    }
}
