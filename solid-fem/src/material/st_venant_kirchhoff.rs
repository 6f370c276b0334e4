//! St.Venant-Kirchhoff elasticity: S = lambda tr(E) I + 2 mu E.
//!
//! Linear between Green-Lagrange strain and second Piola-Kirchhoff stress; right for large rotation with small strain.
//! It collapses in compression below a stretch of 0.577 (Ogden, Non-linear Elastic Deformations, 1984). In plane strain
//! with the same two constants, in plane stress with lambda' = 2 lambda mu / (lambda + 2 mu).

use super::{History, Material, Moduli, Unsolvable};

/// Lamé's constants of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StVenantKirchhoff {
    /// First Lamé constant as it acts, Pa.
    pub lambda: f64,
    /// Shear modulus, Pa.
    pub mu: f64,
    /// Strain across the plane over the trace within it; 0 in plane strain and in space.
    across: f64,
}

impl StVenantKirchhoff {
    /// From the engineering constants: `young_modulus` Pa, `poisson_ratio` in (-1, 0.5).
    pub fn new(young_modulus: f64, poisson_ratio: f64) -> Self {
        let mu = young_modulus / (2.0 * (1.0 + poisson_ratio));
        let lambda = 2.0 * mu * poisson_ratio / (1.0 - 2.0 * poisson_ratio);
        Self { lambda, mu, across: 0.0 }
    }

    /// The law of a plate free of stress across its plane.
    pub fn in_plane_stress(self) -> Self {
        let stiffness = self.lambda + 2.0 * self.mu;
        Self { lambda: 2.0 * self.lambda * self.mu / stiffness, across: -self.lambda / stiffness, ..self }
    }

    /// S of E, both in Voigt order, Pa.
    #[inline]
    pub fn second_pk_stress<const D: usize, const S: usize>(&self, strain: &[f64; S]) -> [f64; S] {
        let mut trace = 0.0;
        for axis in 0..D {
            trace += strain[axis];
        }
        let mut stress = [0.0; S];
        for axis in 0..D {
            stress[axis] = self.lambda * trace + 2.0 * self.mu * strain[axis];
        }
        for shear in D..S {
            stress[shear] = self.mu * strain[shear];
        }
        stress
    }
}

impl<const D: usize, const S: usize> Material<D, S> for StVenantKirchhoff {
    #[inline]
    fn stress(&self, strain: &[f64; S], _: History<'_>) -> Result<[f64; S], Unsolvable> {
        Ok(self.second_pk_stress::<D, S>(strain))
    }

    #[inline]
    fn response(&self, strain: &[f64; S], _: History<'_>) -> Result<([f64; S], Moduli<S>), Unsolvable> {
        Ok((self.second_pk_stress::<D, S>(strain), Moduli::Lame(self.lambda, self.mu)))
    }

    #[inline]
    fn energy_density(&self, strain: &[f64; S], _: &[f64]) -> f64 {
        let stress = self.second_pk_stress::<D, S>(strain);
        let mut sum = 0.0;
        for component in 0..S {
            sum += stress[component] * strain[component];
        }
        0.5 * sum
    }

    fn in_space(&self, strain: &[f64; S], _: &[f64]) -> ([f64; 6], f64) {
        let stress = self.second_pk_stress::<D, S>(strain);
        if D == 3 {
            return (std::array::from_fn(|s| stress[s.min(S - 1)]), 1.0);
        }
        let trace = strain[0] + strain[1];
        let across = if self.across == 0.0 { self.lambda * trace } else { 0.0 };
        let stretch = (1.0 + 2.0 * self.across * trace).max(0.0).sqrt();
        ([stress[0], stress[1], across, stress[2], 0.0, 0.0], stretch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniaxial_stress_has_young_modulus_and_poisson_ratio() {
        let (e, nu) = (2.0e5, 0.3);
        let law = StVenantKirchhoff::new(e, nu);
        let stress = law.second_pk_stress::<3, 6>(&[1e-3, -nu * 1e-3, -nu * 1e-3, 0.0, 0.0, 0.0]);
        assert!((stress[0] - e * 1e-3).abs() < 1e-10 * e);
        assert!(stress[1].abs() < 1e-12 * e && stress[2].abs() < 1e-12 * e);
        let plate = law.in_plane_stress();
        let stress = plate.second_pk_stress::<2, 3>(&[1e-3, -nu * 1e-3, 0.0]);
        assert!((stress[0] - e * 1e-3).abs() < 1e-10 * e && stress[1].abs() < 1e-12 * e);
    }
}
