//! The coupler's end of the data link, as far as a participant can tell: one kind for a solid, one for a fluid.

use protocol::case::{FluidSide, SolidOutline};
use protocol::control::StepTime;
use protocol::header::{Header, Kind};
use protocol::interface::{ActingLoad, Contract, Response, Surface};
use protocol::link::{Expect, Link, LinkError, agree};

use super::fluid::FluidLine;

/// What the program under trial plays, and so what the coupler's end is to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// A solid: it gives its surface, gets loads, answers with its motion.
    Solid,
    /// A fluid: it gets the dummy mesh or gives points, gets motions, answers with its load.
    Fluid(FluidSide),
}

/// A participant on the line, after the handshake.
pub(super) trait Line {
    /// Sends what the coupler sends in a step.
    fn give(&mut self, at: StepTime) -> Result<(), LinkError>;

    /// Takes what comes back; of another size, or not finite, it is refused.
    fn take(&mut self, step: u64) -> Result<(), LinkError>;

    /// What came back last.
    fn answer(&self) -> &[f64];

    /// What is wrong with the side of the interface the participant has offered.
    fn fault(&self) -> Option<String>;

    /// Both.
    fn exchange(&mut self, at: StepTime) -> Result<(), LinkError> {
        self.give(at)?;
        self.take(at.step)
    }
}

/// What the coupler's end knows before it shakes hands.
#[derive(Debug, Clone, Copy)]
pub(super) struct Terms<'a> {
    pub(super) role: Role,
    pub(super) contract: Contract,
    pub(super) outline: &'a SolidOutline,
    /// How a fluid is to treat the motion.
    pub(super) response: Response,
}

impl Terms<'_> {
    /// Number of values of the largest message of the coupler's end.
    pub(super) fn capacity(&self) -> usize {
        // Nodes and markers of a solid, one marker per axis at most; mesh, motion and normals of a fluid.
        let Contract { dimension, node_count, .. } = self.contract;
        64 + node_count * (3 + 4 * dimension + dimension * dimension)
    }

    /// Shakes hands as the coupler does.
    pub(super) fn shake_hands<'l>(
        &self,
        mut link: Box<dyn Link<f64> + 'l>,
    ) -> Result<Box<dyn Line + 'l>, LinkError> {
        agree(&mut *link, &self.contract)?;
        Ok(match self.role {
            Role::Solid => Box::new(SolidLine::new(link, &self.contract)?),
            Role::Fluid(FluidSide::DummyMesh) => Box::new(FluidLine::with_mesh(link, self)?),
            Role::Fluid(FluidSide::Points) => Box::new(FluidLine::with_points(link, self)?),
        })
    }
}

impl Role {
    /// Its name on the channels.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Solid => "solid",
            Self::Fluid(_) => "fluid",
        }
    }

    /// What it must do in the handshake.
    pub(super) fn handshake(self) -> &'static str {
        match self {
            Self::Solid => "says hello, shakes hands, gives its surface and its motion",
            Self::Fluid(FluidSide::DummyMesh) => "says hello, shakes hands, takes the dummy mesh",
            Self::Fluid(FluidSide::Points) => "says hello, shakes hands, gives its points",
        }
    }

    /// What it must have offered there; a fluid with the dummy mesh offers nothing.
    pub(super) fn offer(self) -> Option<&'static str> {
        match self {
            Self::Solid => Some("has the surface it has planned"),
            Self::Fluid(FluidSide::DummyMesh) => None,
            Self::Fluid(FluidSide::Points) => Some("has the points it has planned, some with an area"),
        }
    }
}

/// A solid on the line.
struct SolidLine<'l> {
    link: Box<dyn Link<f64> + 'l>,
    surface: Surface,
    planned: usize,
    /// Displacement, velocity, acceleration, one block each.
    motion: Vec<f64>,
}

/// On every node along the first axis, N.
const FORCE: f64 = 0.01;

impl<'l> SolidLine<'l> {
    /// Takes the surface and the motion at the start.
    fn new(mut link: Box<dyn Link<f64> + 'l>, contract: &Contract) -> Result<Self, LinkError> {
        let mut surface = None;
        let expect = Expect { kind: Kind::Surface, step: 0, count: None };
        link.receive(expect, &mut |_, values| surface = Some(Surface::decode(values, "solid")))?;
        let surface = surface.expect("a message that was received was read")?;
        let mut line = Self { link, surface, planned: contract.node_count, motion: Vec::new() };
        line.take(0)?;
        Ok(line)
    }
}

impl Line for SolidLine<'_> {
    /// An even load.
    fn give(&mut self, at: StepTime) -> Result<(), LinkError> {
        let d = self.surface.dimension;
        let (nodes, markers) = (self.surface.node_count(), self.surface.facets.markers().len());
        let header = Header::new(Kind::Load, at.step, at.time, at.dt);
        self.link.send(header, 1 + (nodes + markers) * d, &mut |out| {
            out.fill(0.0);
            out[0] = f64::from(ActingLoad::NodalForce as u8);
            out[1..=nodes * d].iter_mut().step_by(d).for_each(|f| *f = FORCE);
        })
    }

    fn take(&mut self, step: u64) -> Result<(), LinkError> {
        let count = Some(3 * self.surface.node_count() * self.surface.dimension);
        let motion = &mut self.motion;
        motion.clear();
        self.link.receive(Expect { kind: Kind::Motion, step, count }, &mut |_, values| motion.extend(values))
    }

    fn answer(&self) -> &[f64] {
        &self.motion
    }

    fn fault(&self) -> Option<String> {
        let Surface { facets, areal_mass, .. } = &self.surface;
        let (nodes, planned) = (self.surface.node_count(), self.planned);
        let faults = [
            (nodes != planned, format!("{nodes} nodes, {planned} were planned")),
            (facets.is_empty(), "no facet".to_owned()),
            (facets.nodes.iter().any(|&node| node >= nodes), "a facet names a node that is none".to_owned()),
            (areal_mass.len() != nodes, "not one areal mass per node".to_owned()),
            (areal_mass.iter().any(|mass| *mass < 0.0), "a negative areal mass".to_owned()),
        ];
        faults.into_iter().find(|(is_fault, _)| *is_fault).map(|(_, what)| what)
    }
}
