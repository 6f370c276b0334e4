//! Watches the coupling for the instability that added mass brings: loads that change sign at every step.

use serde::{Deserialize, Serialize};

/// Wet steps the running load jump looks back on.
const WINDOW: usize = 50;
/// Running load jump above which the step is counted as restless.
pub const RESTLESS: f64 = 0.5;
/// Running load jump above which the verdict is `unstable_coupling`.
pub const UNSTABLE: f64 = 1.0;
/// Work mismatch above which the verdict is `unstable_coupling`.
pub const MISMATCH: f64 = 0.1;
/// Difference of the works, of the hydrostatic load times the depth of the water, below which no mismatch is worth speaking of.
pub const LEAST_WORK: f64 = 1e-6;
/// Loads below this share of the hydrostatic one are splashes: what they jump by is measured against the share.
const SPLASH: f64 = 0.05;
/// Growth of the load per step that, with alternating sign, counts towards divergence.
const GROWTH: f64 = 1.3;
/// Steps of alternating growth after which the run cannot be saved.
const GROWING_STEPS: u32 = 3;
/// Wet steps from which on the running load jump, and the works, say something.
const LEAST: usize = 20;
/// Changes of the load as large as half of it, one against the other, after which another scheme is called for. Water
/// bears no tension: an unstable load alternates with none at all and need not change its sign.
const SWINGS: u32 = 4;

/// Load jump J = rms(F_n - F_n-1) / rms(F_n) of the total load, running over the last wet steps and over a window; rms(F_n)
/// at least that of a splash.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct LoadJump {
    floor: f64,
    splash: f64,
    last: Option<[f64; 3]>,
    ring: Vec<(f64, f64)>,
    next: usize,
    window: (f64, f64),
    sums: (f64, f64),
    summed: usize,
    wet_steps: u64,
    growing: u32,
    last_jump: [f64; 3],
    swings: u32,
    greatest: f64,
    restless_steps: u64,
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl LoadJump {
    /// `hydrostatic` is rho_f g H times the wetted area, N: loads below a thousandth of it are dry; `window` is the
    /// time over which the mean is taken, s.
    pub fn new(hydrostatic: f64, window: (f64, f64)) -> Self {
        let ring = Vec::with_capacity(WINDOW);
        let floor = 1e-3 * hydrostatic;
        Self {
            floor,
            splash: SPLASH * hydrostatic,
            last: None,
            ring,
            next: 0,
            window,
            sums: (0.0, 0.0),
            summed: 0,
            wet_steps: 0,
            growing: 0,
            last_jump: [0.0; 3],
            swings: 0,
            greatest: 0.0,
            restless_steps: 0,
        }
    }

    /// Takes the total load of one step, N.
    pub fn book(&mut self, time: f64, load: [f64; 3]) {
        let square = dot(load, load);
        self.count_swings(load);
        if square <= self.floor * self.floor {
            self.last = Some(load);
            return;
        }
        self.wet_steps += 1;
        let Some(last) = self.last.replace(load) else { return };
        let jump: [f64; 3] = std::array::from_fn(|axis| load[axis] - last[axis]);
        let entry = (dot(jump, jump), square);
        if self.ring.len() < WINDOW {
            self.ring.push(entry);
        } else {
            self.ring[self.next] = entry;
            self.next = (self.next + 1) % WINDOW;
        }
        if self.window.0 <= time && time <= self.window.1 {
            self.sums = (self.sums.0 + entry.0, self.sums.1 + entry.1);
            self.summed += 1;
        }
        // Loads below the hydrostatic ones cannot be a divergence yet.
        let alternates = dot(load, last) < 0.0 && square > (1e3 * self.floor).powi(2);
        let grows = square > GROWTH * GROWTH * dot(last, last);
        self.growing = if alternates && grows { self.growing + 1 } else { 0 };
        if self.ring.len() == WINDOW {
            self.greatest = self.greatest.max(self.running());
            self.restless_steps += u64::from(self.running() > RESTLESS);
        }
    }

    /// Counts changes of the load against the one before, each as large as half of the greater load.
    fn count_swings(&mut self, load: [f64; 3]) {
        let Some(last) = self.last else { return };
        let jump: [f64; 3] = std::array::from_fn(|axis| load[axis] - last[axis]);
        let size = dot(load, load).max(dot(last, last));
        let swings = dot(jump, self.last_jump) < 0.0
            && dot(jump, jump) > 0.25 * size
            && size > self.floor * self.floor;
        self.swings = if swings { self.swings + 1 } else { 0 };
        self.last_jump = jump;
    }

    /// J over the last wet steps.
    pub fn running(&self) -> f64 {
        let sums = self.ring.iter().fold((0.0, 0.0), |sum, entry| (sum.0 + entry.0, sum.1 + entry.1));
        self.ratio(sums, self.ring.len())
    }

    /// J over the window of time.
    pub fn mean(&self) -> f64 {
        self.ratio(self.sums, self.summed)
    }

    fn ratio(&self, (jump, load): (f64, f64), steps: usize) -> f64 {
        let load = load.max(steps as f64 * self.splash * self.splash);
        if load > 0.0 { (jump / load).sqrt() } else { 0.0 }
    }

    /// Greatest running J so far, over full windows.
    pub fn greatest(&self) -> f64 {
        self.greatest
    }

    /// Steps with a running J above [`RESTLESS`].
    pub fn restless_steps(&self) -> u64 {
        self.restless_steps
    }

    /// Whether another scheme is called for: the running load jump is too large, or the load swings to and fro from step
    /// to step.
    pub fn is_restless(&self) -> bool {
        let is_known = self.ring.len() >= LEAST;
        (is_known && self.running() > RESTLESS) || self.swings >= SWINGS
    }

    /// Whether there have been enough wet steps for a verdict while the run goes on.
    pub fn is_known(&self) -> bool {
        self.wet_steps >= LEAST as u64
    }

    /// Goes on from what another run has seen; scale and window stay its own.
    pub fn take_up(&mut self, kept: Self) {
        let Self { floor, splash, window, .. } = *self;
        *self = Self { floor, splash, window, ..kept };
    }

    /// Forgets the last steps: those to come are another scheme's.
    pub fn forget(&mut self) {
        self.ring.clear();
        self.next = 0;
        (self.growing, self.swings) = (0, 0);
    }

    /// Whether the load grows with alternating sign and the run cannot be saved.
    pub fn diverges(&self) -> bool {
        self.growing >= GROWING_STEPS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jump_of(load: impl Fn(usize) -> f64) -> LoadJump {
        let mut jump = LoadJump::new(1.0, (0.0, 1e9));
        (0..200).for_each(|step| jump.book(step as f64, [load(step), 0.0, 0.0]));
        jump
    }

    #[test]
    fn a_smooth_load_is_calm_and_an_alternating_one_is_not() {
        let smooth = jump_of(|step| 10.0 + (step as f64 * 0.05).sin());
        assert!(smooth.greatest() < 0.01, "{}", smooth.greatest());
        // F = (-1)^n: every jump is twice the load.
        let alternating = jump_of(|step| if step % 2 == 0 { 1.0 } else { -1.0 });
        assert!((alternating.mean() - 2.0).abs() < 1e-12 && alternating.greatest() > UNSTABLE);
        assert!(!alternating.diverges());
        assert!(alternating.is_restless() && !smooth.is_restless());
        let mut forgetful = alternating;
        forgetful.forget();
        assert!(!forgetful.is_restless() && forgetful.greatest() > UNSTABLE);
        // A splash is not judged by what little it weighs.
        assert!(jump_of(|step| 5e-3 * (-1.0_f64).powi(step as i32)).greatest() < 0.25);
        // Water that bears no tension pushes at every other step: seen after a few.
        let mut slapping = LoadJump::new(1.0, (0.0, 1e9));
        (0..6).for_each(|step| slapping.book(f64::from(step), [f64::from(step % 2), 0.0, 0.0]));
        assert!(slapping.is_restless());
    }

    #[test]
    fn alternating_growth_is_a_divergence_and_dry_steps_are_not_counted() {
        assert!(jump_of(|step| (-1.5_f64).powi(step as i32 % 100)).diverges());
        let dry = jump_of(|step| 1e-4 * (-1.0_f64).powi(step as i32));
        assert!(dry.mean() == 0.0 && !dry.is_known());
    }

    #[test]
    fn a_verdict_needs_twenty_wet_steps() {
        let mut jump = LoadJump::new(1.0, (0.0, 1e9));
        let known: Vec<bool> = (0..30)
            .map(|step| {
                jump.book(f64::from(step), [f64::from(u8::from(step >= 5)), 0.0, 0.0]);
                jump.is_known()
            })
            .collect();
        assert_eq!(known.iter().position(|&is_known| is_known), Some(24), "{known:?}");
    }
}
