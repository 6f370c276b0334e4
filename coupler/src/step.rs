//! One coupling step as the coupler sees it: one line a phase. The launcher says which part comes when; within a part
//! the phases follow each other.

use protocol::case::Scheme;
use protocol::control::{Part, StepReport, StepTime};
use protocol::failure::Failure;
use protocol::participant::not_my_part;

use crate::coupled::Coupled;

impl Coupled {
    /// One part of a step.
    pub(crate) fn part(&mut self, part: Part, at: StepTime) -> Result<StepReport, Failure> {
        match part {
            Part::Predict => {
                self.timed("predict_motion", |c| c.predict_motion(at)); // from the solid's state at the start
                self.timed("send_motion", |c| c.send_motion(at))?;
                self.timed("keep_displacement", Self::keep_displacement);
                self.while_water_moves();
            }
            Part::Correct => {
                self.timed("correct_motion", |c| c.correct_motion(at)); // from the passes so far
                self.timed("send_motion", |c| c.send_motion(at))?;
                self.while_water_moves();
            }
            Part::TakeLoad => {
                self.timed("receive_load", |c| c.receive_load(at))?;
                self.timed("make_traction", Self::make_traction);
                self.timed("map_load", Self::map_load);
            }
            Part::SendLoad => {
                self.timed("send_load", |c| c.send_load(at))?;
                self.while_structure_moves();
            }
            Part::TakeMotion => {
                self.timed("receive_motion", |c| c.receive_motion(at))?;
                return Ok(self.compare_motion()); // strong: does it agree with what the fluid was given?
            }
            Part::Book => {
                self.timed("book_ledger", |c| c.book_ledger(at))?;
                if self.recorder.is_some() {
                    self.timed("record", |c| c.record(at))?;
                }
                return Ok(self.report(at)); // restless loads: another scheme from here on
            }
            other => return Err(not_my_part(other)),
        }
        Ok(StepReport::unlimited())
    }

    /// What only the motion decides is done once the motion is sent.
    fn while_water_moves(&mut self) {
        if self.scheme != Scheme::Parallel && self.motion.is_moving() {
            self.timed("place_markers", Self::place_markers);
        }
    }

    /// What only the load decides is done once the load is sent. In the parallel scheme the load sent was the last step's,
    /// and the water moves at the same time.
    fn while_structure_moves(&mut self) {
        if self.scheme != Scheme::Parallel {
            self.timed("sum_loads", Self::sum_loads);
        } else if self.motion.is_moving() {
            self.timed("place_markers", Self::place_markers);
        }
    }
}
