//! The whole state of the interface in a file, and a run that goes on from it.

use protocol::case::Scheme;
use protocol::control::{StepReport, StepTime};
use protocol::failure::Failure;
use protocol::participant::Context;
use protocol::state::{self, Stamp};
use serde::{Deserialize, Serialize};

use crate::case::OnGuard;
use crate::coupled::{Coupled, begin_record};
use crate::escalation::Escalation;
use crate::guard::LoadJump;
use crate::ledger::Totals;
use crate::motion::{DisplacementPredictor, SolidMotion};
use crate::participant::NAME;
use crate::passes::Passes;

/// What the next step follows from, and what is counted over the whole run.
#[derive(Serialize, Deserialize)]
struct Whole {
    /// What the case asks for: with other wishes the run goes on with the scheme they lead to.
    wishes: (Scheme, OnGuard),
    /// In force, and of the steps after the next, where the guard changes it.
    scheme: Scheme,
    next_scheme: Option<Scheme>,
    escalation: Option<Escalation>,
    solid: SolidMotion,
    /// The load on the solid, forces and tractions: the parallel scheme sends it one step later.
    load: (Vec<f64>, Vec<f64>),
    predictor: Option<DisplacementPredictor>,
    passes: Option<Passes>,
    jump: LoadJump,
    totals: Totals,
    due: f64,
}

impl Coupled {
    fn stamp(&self, at: StepTime) -> Stamp {
        let sizes = [
            ("dimension", self.surface.dimension),
            (self.side.count_name(), self.node_count()),
            ("markers", self.marker_count()),
            ("interface_nodes", self.surface.node_count()),
        ];
        Stamp::new(at.step, at.time, &sizes)
    }

    /// Writes the state at the end of a step.
    pub(crate) fn keep(&self, context: &Context, at: StepTime) -> Result<(), Failure> {
        let whole = Whole {
            wishes: (self.settings.scheme, self.settings.on_guard),
            scheme: self.scheme,
            next_scheme: self.next_scheme,
            escalation: self.escalation.clone(),
            solid: self.solid.clone(),
            load: (self.load.on_solid.clone(), self.load.traction_on_solid.clone()),
            predictor: self.motion.predictor().cloned(),
            passes: self.passes.clone(),
            jump: self.jump.clone(),
            totals: self.ledger.totals().clone(),
            due: self.ledger.due(),
        };
        state::write(&context.folder, NAME, &self.stamp(at), &whole)
    }

    /// Goes on from the state of a step; the answer carries the scheme in force, where a guard may have changed it.
    pub(crate) fn take_up(&mut self, context: &Context, at: StepTime) -> Result<StepReport, Failure> {
        let whole: Whole = state::read(&context.folder, NAME, &self.stamp(at))?;
        self.solid = whole.solid;
        (self.load.on_solid, self.load.traction_on_solid) = whole.load;
        self.jump.take_up(whole.jump);
        self.ledger.take_up(whole.totals, whole.due);
        if let (Some(passes), Some(kept)) = (&mut self.passes, whole.passes) {
            passes.take_up(kept);
        }
        self.turn();
        self.motion.begin_at(&self.solid, &self.mapping, whole.predictor);
        let is_same = whole.wishes == (self.settings.scheme, self.settings.on_guard);
        if is_same {
            if whole.scheme != self.scheme {
                self.motion.escalate(whole.scheme);
            }
            (self.scheme, self.escalation) = (whole.scheme, whole.escalation);
            self.next_scheme = whole.next_scheme;
        } else {
            self.jump.forget();
        }
        if self.recorder.is_some() {
            self.recorder = Some(begin_record(context, at, (&self.surface, &self.side), &self.solid)?);
        }
        let admitted_dt = self.admitted_dt(at.time);
        let next_scheme = is_same.then_some(self.scheme).filter(|_| self.escalation.is_some());
        Ok(StepReport { admitted_dt, next_scheme, ..StepReport::default() })
    }
}
