//! From one pass over a step to the next: the interface displacement x is given to the fluid, the solid answers with
//! x~ = S(F(x)), and the residual r = x~ - x is driven to zero.

mod aitken;
mod change;
mod imvj;
mod iqn_ils;

use serde::{Deserialize, Serialize};

pub use aitken::Aitken;
pub use imvj::Imvj;
pub use iqn_ils::{IqnIls, Reuse};

/// How the next guess follows from the passes so far.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum Acceleration {
    /// x + omega r.
    Fixed {
        /// omega.
        relaxation: f64,
    },
    /// x + omega r with a changing omega.
    Aitken(Aitken),
    /// Interface quasi-Newton, least squares over the last steps.
    IqnIls(IqnIls),
    /// Interface quasi-Newton, a Jacobian that grows from step to step.
    Imvj(Imvj),
}

impl Acceleration {
    /// Replaces the guess `x`, `[n]`, by a better one, from what the solid answered, `found`.
    pub fn improve(&mut self, guess: &mut [f64], found: &[f64]) {
        match self {
            Self::Fixed { relaxation } => relax(guess, found, *relaxation),
            Self::Aitken(aitken) => aitken.improve(guess, found),
            Self::IqnIls(newton) => newton.improve(guess, found),
            Self::Imvj(newton) => newton.improve(guess, found),
        }
    }

    /// Takes over what another one of its kind has learnt.
    pub fn take_up(&mut self, kept: Self) {
        match (self, kept) {
            (Self::Aitken(aitken), Self::Aitken(kept)) => aitken.take_up(kept),
            (Self::IqnIls(newton), Self::IqnIls(kept)) => newton.take_up(kept),
            (Self::Imvj(newton), Self::Imvj(kept)) => newton.take_up(kept),
            _ => (),
        }
    }

    /// The step stands; the next call of [`Self::improve`] belongs to another one.
    pub fn end_step(&mut self) {
        match self {
            Self::Fixed { .. } => (),
            Self::Aitken(aitken) => aitken.end_step(),
            Self::IqnIls(newton) => newton.end_step(),
            Self::Imvj(newton) => newton.end_step(),
        }
    }
}

/// x += omega (x~ - x).
fn relax(guess: &mut [f64], found: &[f64], relaxation: f64) {
    for (x, found) in guess.iter_mut().zip(found) {
        *x += relaxation * (found - *x);
    }
}

/// r = x~ - x into `residual`.
fn residual_of(guess: &[f64], found: &[f64], residual: &mut Vec<f64>) {
    residual.clear();
    residual.extend(found.iter().zip(guess).map(|(found, x)| found - x));
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Passes until a linear problem x~ = A x + b with a full matrix of these eigenvalues is solved to 1e-10.
    fn passes(acceleration: &mut Acceleration, eigenvalues: &[f64], shift: f64) -> usize {
        let n = eigenvalues.len();
        // A Householder reflection turns the diagonal matrix.
        let axis: Vec<f64> = (0..n).map(|i| 1.0 / (1.0 + i as f64)).collect();
        let reflect = |v: &[f64]| -> Vec<f64> {
            let share = 2.0 * dot(&axis, v) / dot(&axis, &axis);
            v.iter().zip(&axis).map(|(v, a)| v - share * a).collect()
        };
        let mut x = vec![0.0; n];
        for pass in 1..1000 {
            let inner: Vec<f64> = reflect(&x).iter().zip(eigenvalues).map(|(v, l)| v * l).collect();
            let found: Vec<f64> =
                reflect(&inner).iter().enumerate().map(|(i, v)| v + shift + i as f64).collect();
            let rest = x.iter().zip(&found).map(|(x, f)| (x - f).powi(2)).sum::<f64>().sqrt();
            if rest < 1e-10 {
                acceleration.end_step();
                return pass;
            }
            acceleration.improve(&mut x, &found);
        }
        usize::MAX
    }

    const REUSE: Reuse = Reuse { steps: 10, first_relaxation: 0.1 };

    fn quasi_newton() -> [Acceleration; 2] {
        [Acceleration::IqnIls(IqnIls::new(REUSE)), Acceleration::Imvj(Imvj::new(REUSE))]
    }

    #[test]
    fn quasi_newton_solves_what_relaxation_cannot_in_about_as_many_passes_as_there_are_modes() {
        // Added mass: eigenvalues -r of the fixed-point map; beyond -1 plain passes diverge.
        let modes = [-50.0, -5.0, -1.4, -0.5, -0.1, 0.0, 0.0, 0.0];
        for mut newton in quasi_newton() {
            assert!(passes(&mut newton, &modes, 1.0) <= modes.len() + 2);
        }
        assert_eq!(passes(&mut Acceleration::Fixed { relaxation: 1.0 }, &modes, 1.0), usize::MAX);
        assert!(passes(&mut Acceleration::Fixed { relaxation: 0.03 }, &modes, 1.0) > 100);
    }

    #[test]
    fn aitken_finds_the_one_mode_there_is() {
        let mut aitken = Acceleration::Aitken(Aitken::new(0.1));
        assert!(passes(&mut aitken, &[-7.0], 1.0) <= 4);
        // A positive and a negative mode: slower, but there.
        let mut aitken = Acceleration::Aitken(Aitken::new(0.1));
        assert!(passes(&mut aitken, &[-3.0, -0.5, -0.2], 1.0) < 60);
    }

    #[test]
    fn what_was_learnt_in_one_step_serves_the_next() {
        let modes = [-20.0, -5.0, -2.0, -1.0, -0.5];
        for mut newton in quasi_newton() {
            let first = passes(&mut newton, &modes, 1.0);
            let second = passes(&mut newton, &modes, 2.0);
            // A linear problem is solved by the first correction then.
            assert!(first > 4 && second <= 3, "{first} {second}");
        }
    }

    #[test]
    fn directions_that_say_nothing_new_do_no_harm() {
        for mut newton in quasi_newton() {
            for shift in 0..30 {
                let passes = passes(&mut newton, &[-3.0, -3.0, -3.0], f64::from(shift));
                assert!(passes <= 5, "{passes}");
            }
        }
    }

    #[test]
    fn a_jacobian_forgets_the_oldest_steps() {
        let mut newton = Acceleration::Imvj(Imvj::new(Reuse { steps: 0, ..REUSE }));
        let modes = [-20.0, -5.0, -2.0];
        let counts = [1.0, 2.0, 3.0].map(|shift| passes(&mut newton, &modes, shift));
        assert!(counts.iter().all(|&count| count > 4), "each step learns anew: {counts:?}");
    }
}
