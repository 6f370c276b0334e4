//! Fields of velocity the water may start with, added to the velocities of its boxes.
//!
//! All are free of divergence, so the first pressure solve has nothing to repair.

use std::f64::consts::TAU;

use crate::vector::Vector;

/// A velocity field at time 0; it lies in the x-y plane.
#[derive(Debug, Clone, PartialEq)]
pub enum Flow<const D: usize> {
    /// Rigid rotation about an axis through `centre`: (-rate y, rate x).
    Rotation {
        /// m.
        centre: Vector<D>,
        /// rad/s, anticlockwise.
        rate: f64,
    },
    /// Stretching along y, shrinking along x: (-rate x, rate y) about `centre`.
    Stretching {
        /// m.
        centre: Vector<D>,
        /// 1/s.
        rate: f64,
    },
    /// Vortices of Taylor & Green (1937): speed (-cos kx sin ky, sin kx cos ky), k = 2 pi/length, from `origin`.
    TaylorGreen {
        /// Where a pattern starts, m.
        origin: Vector<D>,
        /// Largest speed, m/s.
        speed: f64,
        /// Length of one pattern of four vortices, m.
        length: f64,
    },
    /// Linear standing wave passing through its flat state (Airy 1845): eta = amplitude sin(omega t) cos k(x - x0) with
    /// omega^2 = g k tanh(k depth).
    StandingWave {
        /// Foot of the left wall, m.
        origin: Vector<D>,
        /// Largest elevation, m.
        amplitude: f64,
        /// k, 1/m.
        wave_number: f64,
        /// Depth of the water, m.
        depth: f64,
        /// |g|, m/s2.
        gravity: f64,
    },
}

impl<const D: usize> Flow<D> {
    /// Velocity at a point, m/s.
    pub fn velocity(&self, x: &Vector<D>) -> Vector<D> {
        let mut v = [0.0; D];
        match self {
            Self::Rotation { centre, rate } => {
                (v[0], v[1]) = (-rate * (x[1] - centre[1]), rate * (x[0] - centre[0]));
            }
            Self::Stretching { centre, rate } => {
                (v[0], v[1]) = (-rate * (x[0] - centre[0]), rate * (x[1] - centre[1]));
            }
            Self::TaylorGreen { origin, speed, length } => {
                let (sx, cx) = (TAU * (x[0] - origin[0]) / length).sin_cos();
                let (sy, cy) = (TAU * (x[1] - origin[1]) / length).sin_cos();
                (v[0], v[1]) = (-speed * cx * sy, speed * sx * cy);
            }
            Self::StandingWave { origin, amplitude, wave_number, depth, gravity } => {
                let k = *wave_number;
                let speed = amplitude * (gravity * k * (k * depth).tanh()).sqrt() / (k * depth).sinh();
                let ((sine, cosine), y) = ((k * (x[0] - origin[0])).sin_cos(), k * (x[1] - origin[1]));
                (v[0], v[1]) = (-speed * y.cosh() * sine, speed * y.sinh() * cosine);
            }
        }
        v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_field_is_free_of_divergence() {
        let fields: [Flow<2>; 4] = [
            Flow::Rotation { centre: [0.1, 0.2], rate: 3.0 },
            Flow::Stretching { centre: [0.1, 0.2], rate: 3.0 },
            Flow::TaylorGreen { origin: [0.0; 2], speed: 1.5, length: 0.7 },
            Flow::StandingWave {
                origin: [0.0; 2],
                amplitude: 0.1,
                wave_number: 3.0,
                depth: 0.5,
                gravity: 9.81,
            },
        ];
        let (x, step) = ([0.33, 0.41], 1e-5);
        for field in fields {
            let along = |k: usize| {
                let shifted = |sign: f64| {
                    let mut there = x;
                    there[k] += sign * step;
                    field.velocity(&there)[k]
                };
                (shifted(1.0) - shifted(-1.0)) / (2.0 * step)
            };
            assert!((along(0) + along(1)).abs() < 1e-6, "{field:?}");
            assert!(crate::vector::norm(&field.velocity(&x)) > 0.0);
        }
    }

    /// The surface rises with the wave: v = amplitude omega cos k x at y = depth.
    #[test]
    fn the_standing_wave_has_the_speed_of_its_surface() {
        let wave: Flow<2> = Flow::StandingWave {
            origin: [0.0; 2],
            amplitude: 0.01,
            wave_number: 3.0,
            depth: 0.5,
            gravity: 9.81,
        };
        let omega = (9.81f64 * 3.0 * 1.5f64.tanh()).sqrt();
        assert!((wave.velocity(&[0.0, 0.5])[1] - 0.01 * omega).abs() < 1e-12);
        assert!(wave.velocity(&[0.0, 0.5])[0].abs() < 1e-12);
    }
}
