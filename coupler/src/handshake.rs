//! The start of a run: both data links are opened, or taken from a recording, and each side is told about the other.

use protocol::case::{FluidSide as Kind, Shared, Side, SolidOutline};
use protocol::control::Start;
use protocol::failure::{Failure, FailureClass};
use protocol::interface::{Contract, Response, Surface};
use protocol::link::{Link, Transport, agree};
use protocol::participant::Context;

use crate::case::{Settings, open_replay};
use crate::dummy_mesh::DummyMesh;
use crate::exchange::{receive_points, receive_solid, receive_surface, refused};
use crate::fluid_side::FluidSide;
use crate::motion::SolidMotion;
use crate::participant::NAME;
use crate::record::{Replay, unusable};

/// What both sides agree on, and how they are reached.
pub(crate) struct Handshake<'a> {
    pub(crate) outline: &'a SolidOutline,
    shared: &'a Shared,
    context: &'a Context,
    start: &'a Start,
    transport: &'a mut dyn Transport,
    replay: Option<(Replay, Side)>,
}

/// The solid's link, its surface and its motion at the start.
type Shaken = (Box<dyn Link<f64>>, Surface, SolidMotion);

impl<'a> Handshake<'a> {
    /// Opens the recording, if there is one.
    pub(crate) fn new(
        shared: &'a Shared,
        settings: &Settings,
        context: &'a Context,
        start: &'a Start,
        transport: &'a mut dyn Transport,
    ) -> Result<Self, Failure> {
        let outline = shared.solid.as_ref().ok_or_else(|| missing("solid"))?;
        let replay = match open_replay(settings) {
            Some((recording, side)) => Some((Replay::new(recording.map_err(unusable)?), side)),
            None => None,
        };
        Ok(Self { outline, shared, context, start, transport, replay })
    }

    /// Takes what the solid says of itself.
    pub(crate) fn with_solid(&mut self) -> Result<Shaken, Failure> {
        let contract = self.contract(self.start.surface_nodes)?;
        // A node has one marker per face it belongs to, at most one per axis.
        let capacity = 8 + contract.node_count * contract.dimension * (1 + contract.dimension);
        let mut link = self.connect(Side::Solid, capacity)?;
        agree(&mut *link, &contract).map_err(refused("handshake"))?;
        let surface = receive_surface(&mut *link).map_err(refused("handshake"))?;
        let mut solid = SolidMotion::default();
        receive_solid(&mut *link, 0, &surface, &mut solid).map_err(refused("handshake"))?;
        Ok((link, surface, solid))
    }

    /// The fluid's link and its side of the interface: the dummy mesh, or the points it offers.
    pub(crate) fn with_fluid(
        &mut self,
        elements: &[usize],
    ) -> Result<(Box<dyn Link<f64>>, FluidSide), Failure> {
        let contract = self.contract(self.start.fluid_nodes)?;
        let block = contract.node_count * contract.dimension;
        let (mesh, first_word) = match self.shared.fluid_side {
            Kind::Points => (None, 2 + contract.node_count),
            Kind::DummyMesh => {
                let mesh = DummyMesh::span(self.outline, elements);
                let unknown = vec![0.0; mesh.node_count()];
                let first_word = mesh.body_mesh(unknown, Response::Given).encode().len();
                (Some(mesh), first_word)
            }
        };
        // A flag, and at most position, velocity, acceleration and normal.
        let mut link = self.connect(Side::Fluid, first_word.max(1 + 4 * block))?;
        agree(&mut *link, &contract).map_err(refused("handshake"))?;
        let side = match mesh {
            Some(mesh) => FluidSide::DummyMesh(mesh),
            None => FluidSide::Points(receive_points(&mut *link, &contract).map_err(refused("handshake"))?),
        };
        Ok((link, side))
    }

    /// The recording that goes on in the place of one side.
    pub(crate) fn into_replay(self) -> Option<Replay> {
        self.replay.map(|(replay, _)| replay)
    }

    fn contract(&self, nodes: Option<u64>) -> Result<Contract, Failure> {
        let node_count = nodes.ok_or_else(|| missing("interface size"))? as usize;
        let (dimension, end_time) = (self.shared.header.dimension, self.shared.time.end);
        Ok(Contract { dimension, node_count, end_time, scene: self.context.scene })
    }

    fn connect(&mut self, peer: Side, capacity: usize) -> Result<Box<dyn Link<f64>>, Failure> {
        match &self.replay {
            Some((replay, side)) if *side == peer => Ok(replay.link(peer.role())),
            _ => self.transport.connect(peer.role(), capacity).map_err(refused("connect")),
        }
    }
}

fn missing(what: &str) -> Failure {
    Failure::new(FailureClass::Bug, NAME, "start", format!("no {what} in the order"))
}
