//! How long a sub-step may be.

use rayon::prelude::*;

use crate::parallel::{CHUNK, LIGHT};
use crate::vector::dot;

/// Longest step under gravity alone, over sqrt(spacing/|g|): water at rest must not fall a visible part of a spacing
/// before the speed limit takes hold.
const GRAVITY_FACTOR: f64 = 0.05;

/// Explicit viscosity: nu dt/spacing^2 at most this (Morris, Fox & Zhu 1997).
const VISCOUS_FACTOR: f64 = 0.125;

/// Water may never move further than this in one sub-step, in spacings.
pub const LARGEST_MOVE: f64 = 0.5;

/// What limits the step.
#[derive(Debug, Clone, Copy)]
pub struct StepLimits {
    /// max |v| dt/spacing.
    pub courant: f64,
    /// m.
    pub spacing: f64,
    /// Largest speed of water and body, m/s.
    pub speed: f64,
    /// |g|, m/s2.
    pub gravity: f64,
    /// Largest nu + nu_t, m2/s; 0 without viscosity.
    pub viscosity: f64,
}

impl StepLimits {
    /// The longest step allowed, s; infinite if nothing limits it.
    pub fn longest(self) -> f64 {
        let advective = self.courant * self.spacing / self.speed;
        let gravity = GRAVITY_FACTOR * (self.spacing / self.gravity).sqrt();
        let viscous = VISCOUS_FACTOR * self.spacing * self.spacing / self.viscosity;
        advective.min(gravity).min(viscous)
    }
}

/// Largest speed in a column, m/s, and the first particle that has it.
pub fn largest_speed<const D: usize>(velocity: &[crate::vector::Vector<D>]) -> (f64, usize) {
    let faster = |a: (f64, usize), b: (f64, usize)| {
        if b.0 > a.0 || (b.0 == a.0 && b.1 < a.1) { b } else { a }
    };
    let in_chunk = |(number, chunk): (usize, &[crate::vector::Vector<D>])| {
        let squares = chunk.iter().enumerate().map(|(k, v)| (dot(v, v), number * CHUNK + k));
        squares.fold((0.0, 0), faster)
    };
    let chunks = velocity.par_chunks(CHUNK).enumerate().with_min_len(LIGHT);
    let (square, particle) = chunks.map(in_chunk).reduce(|| (0.0, 0), faster);
    (square.sqrt(), particle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tightest_limit_holds_and_none_is_infinite() {
        let free = StepLimits { courant: 0.3, spacing: 0.01, speed: 0.0, gravity: 0.0, viscosity: 0.0 };
        assert_eq!(free.longest(), f64::INFINITY);
        assert!((StepLimits { speed: 3.0, ..free }.longest() - 1e-3).abs() < 1e-15);
        assert!((StepLimits { speed: 3.0, viscosity: 0.1, ..free }.longest() - 1.25e-4).abs() < 1e-15);
    }
}
