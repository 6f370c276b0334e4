//! How long a sub-step may be.

use rayon::prelude::*;

use crate::parallel::{CHUNK, LIGHT};
use crate::vector::dot;

/// Longest step under an acceleration alone, over sqrt(spacing/|a|): water at rest must not fall, and a wall must not set
/// off, by a visible part of a spacing before the speed limit takes hold.
const ACCELERATION_FACTOR: f64 = 0.05;

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
    /// Largest speed of water, body and obstacles, m/s.
    pub speed: f64,
    /// Largest of the body force and the acceleration of obstacles, m/s2.
    pub acceleration: f64,
    /// Largest nu + nu_t, m2/s; 0 without viscosity.
    pub viscosity: f64,
}

impl StepLimits {
    /// The longest step allowed, s; infinite if nothing limits it.
    pub fn longest(self) -> f64 {
        self.each().into_iter().fold(f64::INFINITY, f64::min)
    }

    /// The steps speed, acceleration and viscosity allow, s.
    fn each(self) -> [f64; 3] {
        let advective = self.courant * self.spacing / self.speed;
        let driven = ACCELERATION_FACTOR * (self.spacing / self.acceleration).sqrt();
        let viscous = VISCOUS_FACTOR * self.spacing * self.spacing / self.viscosity;
        [advective, driven, viscous]
    }

    /// Which of speed (0), acceleration (1) and viscosity (2) holds a step of `dt` s down; `None` if it could be longer
    /// by half.
    pub fn binding(self, dt: f64) -> Option<usize> {
        let each = self.each();
        let tightest = (0..3).min_by(|&a, &b| each[a].total_cmp(&each[b]))?;
        (each[tightest] < 1.5 * dt).then_some(tightest)
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
        let free = StepLimits { courant: 0.3, spacing: 0.01, speed: 0.0, acceleration: 0.0, viscosity: 0.0 };
        assert_eq!((free.longest(), free.binding(1.0)), (f64::INFINITY, None));
        let fast = StepLimits { speed: 3.0, ..free };
        assert_eq!((fast.binding(1e-3), fast.binding(1e-4)), (Some(0), None));
        assert!((StepLimits { speed: 3.0, ..free }.longest() - 1e-3).abs() < 1e-15);
        assert!((StepLimits { speed: 3.0, viscosity: 0.1, ..free }.longest() - 1.25e-4).abs() < 1e-15);
    }
}
