//! The coupler as a participant: it obeys the launcher's orders, each a function of `step.rs`.

use std::collections::BTreeMap;

use protocol::case::{CaseFile, Shared};
use protocol::control::{Account, Part, Ready, Start, StepReport, StepTime};
use protocol::failure::{Failure, FailureClass};
use protocol::link::Transport;
use protocol::participant::{Context, Participant, Program};

use crate::case::{Settings, check};
use crate::coupled::Coupled;
use crate::parallel::helpers;

/// The coupler's name in every message.
pub const NAME: &str = "coupler";

/// The coupler as a program.
pub const PROGRAM: Program = Program {
    name: NAME,
    role: NAME,
    about: "Ties the fluid to the solid: mapping, prediction, coupling scheme, interface ledger",
    check,
    build: |case, context| Ok(Box::new(Coupler::new(case, context))),
};

/// The participant before and after the handshake.
pub struct Coupler {
    shared: Shared,
    settings: Settings,
    context: Context,
    coupled: Option<Coupled>,
    /// Of the loops over nodes, once it is known how many there are.
    _helpers: Option<rayon::ThreadPool>,
}

impl Coupler {
    /// Reads the case; nothing is connected yet.
    pub fn new(case: &CaseFile, context: &Context) -> Self {
        let shared = Shared::read(case);
        let settings = Settings::read(case, &shared);
        Self { shared, settings, context: context.clone(), coupled: None, _helpers: None }
    }

    fn coupled(&mut self) -> Result<&mut Coupled, Failure> {
        self.coupled.as_mut().ok_or_else(not_started)
    }
}

fn not_started() -> Failure {
    Failure::new(FailureClass::Bug, NAME, "order", "not started yet")
}

impl Participant for Coupler {
    fn start(&mut self, start: &Start, transport: &mut dyn Transport) -> Result<Ready, Failure> {
        let coupled = Coupled::connect(&self.shared, &self.settings, &self.context, start, transport)?;
        let counts = BTreeMap::from([
            ("markers".to_owned(), coupled.marker_count() as u64),
            ("interface_nodes".to_owned(), coupled.node_count() as u64),
        ]);
        let nodes = coupled.node_count().max(coupled.surface.node_count());
        self._helpers = helpers(nodes, self.context.threads);
        let admitted_dt = coupled.admitted_dt(0.0);
        self.coupled = Some(coupled);
        Ok(Ready { counts, admitted_dt })
    }

    fn part(&mut self, part: Part, at: StepTime) -> Result<StepReport, Failure> {
        let Self { context, coupled, .. } = self;
        let coupled = coupled.as_mut().ok_or_else(not_started)?;
        match part {
            Part::Keep => coupled.keep(context, at).map(|()| StepReport::unlimited()),
            Part::TakeUp => coupled.take_up(context, at),
            other => coupled.part(other, at),
        }
    }

    fn output(&mut self, _frame: u32, _at: StepTime) -> Result<(), Failure> {
        self.coupled()?.flush()
    }

    fn account(&self) -> Account {
        self.coupled.as_ref().map(Coupled::account).unwrap_or_default()
    }
}
