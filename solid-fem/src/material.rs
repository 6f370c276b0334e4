//! St.Venant-Kirchhoff elasticity: S = lambda tr(E) I + 2 mu E.
//!
//! Linear between Green-Lagrange strain and second Piola-Kirchhoff stress; right for large rotation with small strain.
//! It collapses in compression below a stretch of 0.577 (Ogden, Non-linear Elastic Deformations, 1984). In 2-D plane
//! strain, with the same two constants. Voigt order xx yy xy in 2-D, xx yy zz xy yz zx in 3-D, engineering shear.

/// Lamé's constants of the law, and the density.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StVenantKirchhoff {
    /// kg/m3.
    pub density: f64,
    /// First Lamé constant, Pa.
    pub lambda: f64,
    /// Shear modulus, Pa.
    pub mu: f64,
}

impl StVenantKirchhoff {
    /// From the engineering constants: `density` kg/m3, `young_modulus` Pa, `poisson_ratio` in (-1, 0.5).
    pub fn new(density: f64, young_modulus: f64, poisson_ratio: f64) -> Self {
        let mu = young_modulus / (2.0 * (1.0 + poisson_ratio));
        let lambda = 2.0 * mu * poisson_ratio / (1.0 - 2.0 * poisson_ratio);
        Self { density, lambda, mu }
    }

    /// Second Piola-Kirchhoff stress of a Green-Lagrange strain, both in Voigt order, Pa.
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

    /// Strain energy per volume, J/m3: S : E / 2.
    #[inline]
    pub fn energy_density<const D: usize, const S: usize>(&self, strain: &[f64; S]) -> f64 {
        let stress = self.second_pk_stress::<D, S>(strain);
        let mut sum = 0.0;
        for component in 0..S {
            sum += stress[component] * strain[component];
        }
        0.5 * sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniaxial_stress_has_young_modulus_and_poisson_ratio() {
        let (e, nu) = (2.0e5, 0.3);
        let law = StVenantKirchhoff::new(1.0, e, nu);
        let stress = law.second_pk_stress::<3, 6>(&[1e-3, -nu * 1e-3, -nu * 1e-3, 0.0, 0.0, 0.0]);
        assert!((stress[0] - e * 1e-3).abs() < 1e-10 * e);
        assert!(stress[1].abs() < 1e-12 * e && stress[2].abs() < 1e-12 * e);
    }
}
