//! From a scheme whose loads have become restless to one that bears the mass of the water: from a staggered scheme to
//! the Robin wall, and from there to passes over the steps that need them.
//!
//! The launcher begins with the scheme the case names. Where passes are chosen for all steps from the start, the first
//! step is the Robin wall's.

use protocol::case::Scheme;
use serde::{Deserialize, Serialize};

/// Steps that are passed over at first before the single pass is tried again; every return to the passes doubles them. A
/// single pass that is restless again sooner than they took is not tried any more.
const FIRST_STRETCH: u64 = 50;

/// The scheme of the steps to come, and what it took.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Escalation {
    scheme: Scheme,
    chosen: Scheme,
    /// Steps of the present stretch of passes, done and wanted.
    stretch: (u64, u64),
    /// Steps of the Robin wall since it was taken up.
    single: u64,
    is_final: bool,
    to_robin: u64,
    to_passes: u64,
    passed_steps: u64,
}

impl Escalation {
    /// Begins with one scheme, to go on with the one chosen.
    pub fn new(scheme: Scheme, chosen: Scheme) -> Self {
        Self {
            scheme,
            chosen,
            stretch: (0, FIRST_STRETCH),
            single: 0,
            is_final: false,
            to_robin: 0,
            to_passes: 0,
            passed_steps: 0,
        }
    }

    /// Takes a step that stands and whether the load is restless now; gives the scheme of the steps after the next if that
    /// changes.
    pub fn book(&mut self, is_restless: bool) -> Option<Scheme> {
        self.single += u64::from(self.scheme == Scheme::Robin);
        let next = match self.scheme {
            Scheme::Robin if self.chosen == Scheme::Strong => Scheme::Strong,
            Scheme::Css | Scheme::Parallel if is_restless => {
                self.to_robin += 1;
                Scheme::Robin
            }
            Scheme::Robin if is_restless => {
                // The stretch to come is twice as long as the last.
                self.is_final = self.to_passes > 0 && self.single < self.stretch.1 / 2;
                self.to_passes += 1;
                Scheme::Strong
            }
            Scheme::Strong if self.to_passes > 0 => {
                self.passed_steps += 1;
                self.stretch.0 += 1;
                if self.is_final || self.stretch.0 < self.stretch.1 || is_restless {
                    return None;
                }
                self.stretch = (0, 2 * self.stretch.1);
                self.single = 0;
                Scheme::Robin
            }
            _ => return None,
        };
        self.scheme = next;
        Some(next)
    }

    /// For the health table: changes to the Robin wall, changes to passes, steps passed over because of them.
    pub fn health(&self) -> [(&'static str, f64); 3] {
        [
            ("escalations_to_robin", self.to_robin as f64),
            ("escalations_to_passes", self.to_passes as f64),
            ("escalated_steps", self.passed_steps as f64),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_staggered_scheme_gives_way_to_the_robin_wall_for_good() {
        for scheme in [Scheme::Css, Scheme::Parallel] {
            let mut escalation = Escalation::new(scheme, scheme);
            assert_eq!(escalation.book(false), None);
            assert_eq!(escalation.book(true), Some(Scheme::Robin));
            assert!((0..1000).all(|_| escalation.book(false).is_none()));
            assert_eq!(escalation.health().map(|entry| entry.1), [1.0, 0.0, 0.0]);
        }
    }

    #[test]
    fn passes_last_for_a_stretch_that_doubles_with_every_return() {
        let mut escalation = Escalation::new(Scheme::Robin, Scheme::Robin);
        for stretch in [50, 100] {
            assert_eq!(escalation.book(true), Some(Scheme::Strong));
            assert!((1..stretch).all(|_| escalation.book(false).is_none()));
            assert_eq!(escalation.book(false), Some(Scheme::Robin));
            assert!((0..stretch).all(|_| escalation.book(false).is_none()));
        }
        assert_eq!(escalation.health().map(|entry| entry.1), [0.0, 2.0, 150.0]);
    }

    #[test]
    fn a_single_pass_that_is_restless_again_at_once_is_given_up() {
        let mut escalation = Escalation::new(Scheme::Robin, Scheme::Robin);
        assert_eq!(escalation.book(true), Some(Scheme::Strong));
        assert!((1..50).all(|_| escalation.book(false).is_none()));
        assert_eq!(escalation.book(false), Some(Scheme::Robin));
        assert!((0..9).all(|_| escalation.book(false).is_none()));
        assert_eq!(escalation.book(true), Some(Scheme::Strong));
        assert!((0..1000).all(|_| escalation.book(false).is_none()));
    }

    #[test]
    fn passes_that_are_chosen_begin_with_the_second_step_and_stay() {
        let mut escalation = Escalation::new(Scheme::Robin, Scheme::Strong);
        assert_eq!(escalation.book(false), Some(Scheme::Strong));
        assert!((0..1000).all(|step| escalation.book(step % 2 == 0).is_none()));
        assert_eq!(escalation.health().map(|entry| entry.1), [0.0; 3]);
    }

    #[test]
    fn the_strong_scheme_of_the_case_has_nothing_above_it() {
        let mut escalation = Escalation::new(Scheme::Strong, Scheme::Strong);
        assert!((0..1000).all(|step| escalation.book(step % 2 == 0).is_none()));
    }
}
