//! The launcher's end of one control link: orders are numbered, and each has one answer, in their turn. The order of the
//! next step may be given before the present one is answered.

use std::collections::VecDeque;

use protocol::control::{Order, Part, Reply, StepTime, decode, encode};
use protocol::failure::Failure;
use protocol::header::{Header, Kind};
use protocol::link::{Expect, Link, LinkError};

use super::Call;

/// What a participant is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Task {
    /// Name of the order.
    pub(super) phase: &'static str,
    /// Step it belongs to, 0 before the first.
    pub(super) step: u64,
    /// Simulated time at its end, s.
    pub(super) time_s: f64,
}

impl Task {
    fn of(order: &Order) -> Self {
        let (phase, at) = match order {
            Order::Start(_) => ("start", None),
            Order::Step { at, parts } if parts.contains(&Part::Advance) => ("advance", Some(at)),
            Order::Step { at, .. } => ("step", Some(at)),
            Order::Output { at, .. } => ("output", Some(at)),
            Order::Stop => ("stop", None),
        };
        let StepTime { step, time, .. } = at.copied().unwrap_or(StepTime { step: 0, time: 0.0, dt: 0.0 });
        Self { phase, step, time_s: time }
    }

    /// The failure of `process` in this task.
    pub(super) fn failure(&self, process: &str, error: LinkError) -> Failure {
        error.into_failure(process, self.step, self.time_s, self.phase)
    }
}

/// One participant on the control channel.
pub(super) struct Control {
    pub(super) process: String,
    link: Box<dyn Link<u8>>,
    sequence: u64,
    /// Orders without an answer, the oldest first.
    outstanding: VecDeque<Task>,
    last: Task,
}

impl Control {
    /// A participant whose first word is outstanding.
    pub(super) fn new(process: &str, link: Box<dyn Link<u8>>) -> Self {
        let task = Task { phase: "launch", step: 0, time_s: 0.0 };
        Self {
            process: process.to_owned(),
            link,
            sequence: 0,
            outstanding: VecDeque::from([task]),
            last: task,
        }
    }

    pub(super) fn is_outstanding(&self) -> bool {
        !self.outstanding.is_empty()
    }

    /// What the participant is doing, or has done last.
    pub(super) fn task(&self) -> Task {
        self.outstanding.front().copied().unwrap_or(self.last)
    }

    pub(super) fn order(&mut self, order: &Order, call: Call) -> Result<(), LinkError> {
        let task = Task::of(order);
        // Orders without a step of their own keep the place of the last one.
        let (step, time_s) =
            if task.step > 0 { (task.step, task.time_s) } else { (self.last.step, self.last.time_s) };
        self.last = Task { phase: task.phase, step, time_s };
        self.sequence += 1;
        let bytes = encode(order);
        let header = Header::new(Kind::Order, self.sequence, time_s, 0.0);
        let fill = &mut |target: &mut [u8]| target.copy_from_slice(&bytes);
        match call {
            Call::Now => self.link.send(header, bytes.len(), fill)?,
            Call::WithData => self.link.leave(header, bytes.len(), fill)?,
        }
        self.outstanding.push_back(self.last);
        Ok(())
    }

    /// Waits for the answer to the oldest order without one.
    pub(super) fn answer(&mut self) -> Result<Reply, LinkError> {
        let later_orders = self.outstanding.len().saturating_sub(1) as u64;
        let expect = Expect { kind: Kind::Reply, step: self.sequence - later_orders, count: None };
        let mut reply = None;
        let process = &self.process;
        self.link.receive(expect, &mut |_, bytes| reply = Some(decode(bytes, process)))?;
        self.outstanding.pop_front();
        reply.expect("a message that was received was read")
    }
}
