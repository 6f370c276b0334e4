//! The coupler's end of the data link, as far as a solid can tell.

use protocol::control::StepTime;
use protocol::header::{Header, Kind};
use protocol::interface::{ActingLoad, Contract, Surface};
use protocol::ipc::IpcTransport;
use protocol::link::{Expect, Link, LinkError, Transport, agree};
use protocol::names::RunNames;

use super::TIMEOUT;

/// A solid on the line.
pub(super) struct Line {
    link: Box<dyn Link<f64>>,
    pub(super) surface: Surface,
    /// Displacement, velocity, acceleration, one block each.
    pub(super) motion: Vec<f64>,
}

impl Line {
    /// Shakes hands as the coupler does; takes the surface and the motion at the start.
    pub(super) fn open(names: &RunNames, contract: &Contract) -> Result<Self, LinkError> {
        let capacity = 8 + contract.node_count * contract.dimension * (1 + contract.dimension);
        let mut link = IpcTransport::new(names, "coupler", TIMEOUT)?.connect("solid", capacity)?;
        agree(&mut *link, contract)?;
        let mut surface = None;
        let expect = Expect { kind: Kind::Surface, step: 0, count: None };
        link.receive(expect, &mut |_, values| surface = Some(Surface::decode(values, "solid")))?;
        let surface = surface.expect("a message that was received was read")?;
        let mut line = Self { link, surface, motion: Vec::new() };
        line.take_motion(0)?;
        Ok(line)
    }

    /// One exchange: an even load of `force` N on every node along the first axis, the motion back.
    pub(super) fn exchange(&mut self, at: StepTime, force: f64) -> Result<(), LinkError> {
        self.give_load(at, force)?;
        self.take_motion(at.step)
    }

    /// The load message of a step.
    pub(super) fn give_load(&mut self, at: StepTime, force: f64) -> Result<(), LinkError> {
        let d = self.surface.dimension;
        let (nodes, markers) = (self.surface.node_count(), self.surface.facets.markers().len());
        let header = Header::new(Kind::Load, at.step, at.time, at.dt);
        self.link.send(header, 1 + (nodes + markers) * d, &mut |out| {
            out.fill(0.0);
            out[0] = f64::from(ActingLoad::NodalForce as u8);
            out[1..=nodes * d].iter_mut().step_by(d).for_each(|f| *f = force);
        })
    }

    fn take_motion(&mut self, step: u64) -> Result<(), LinkError> {
        let count = Some(3 * self.surface.node_count() * self.surface.dimension);
        let motion = &mut self.motion;
        motion.clear();
        self.link.receive(Expect { kind: Kind::Motion, step, count }, &mut |_, values| motion.extend(values))
    }
}
