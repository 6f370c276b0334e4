//! One coupling step as the coupler sees it: one line a phase. The launcher gives the three orders in this turn, with the
//! fluid's advance between `predict` and `transfer` and the solid's between `transfer` and `book`.

use protocol::control::{StepReport, StepTime};
use protocol::failure::Failure;

use crate::coupled::Coupled;

impl Coupled {
    /// The interface motion over the coming step, from the solid's state at its start.
    pub(crate) fn predict_step(&mut self, at: StepTime) -> Result<StepReport, Failure> {
        self.timed("predict_motion", |c| c.motion.predict(at.dt, &c.solid, &c.mapping));
        self.timed("send_motion", |c| c.send_motion(at))?;
        Ok(self.report())
    }

    /// The fluid's pressures and forces become the solid's load.
    pub(crate) fn transfer_step(&mut self, at: StepTime) -> Result<StepReport, Failure> {
        self.timed("receive_load", |c| c.receive_load(at))?;
        self.timed("make_traction", Self::make_traction);
        self.timed("map_load", Self::map_load);
        self.timed("send_load", |c| c.send_load(at))?;
        Ok(self.report())
    }

    /// The solid's motion comes back and the step is booked on both sides.
    pub(crate) fn book_step(&mut self, at: StepTime) -> Result<StepReport, Failure> {
        self.timed("receive_motion", |c| c.receive_motion(at))?;
        self.timed("book_ledger", |c| c.book_ledger(at))?;
        Ok(self.report())
    }
}
