//! The phases [`crate::step`] lists: what is received, made, mapped, sent and booked at each step.

use protocol::case::Scheme;
use protocol::control::{StepReport, StepTime};
use protocol::failure::Failure;
use protocol::header::{Header, Kind};
use protocol::interface::{ActingLoad, Contract, Points, Surface};
use protocol::link::{Expect, Link, LinkError};

use crate::coupled::Coupled;
use crate::fluid_side::FirstWord;
use crate::load::Place;
use crate::motion::SolidMotion;
use crate::participant::NAME;

pub(crate) fn refused(phase: &'static str) -> impl Fn(LinkError) -> Failure {
    move |error| error.into_failure(NAME, 0, 0.0, phase)
}

fn lost(at: StepTime, phase: &'static str) -> impl Fn(LinkError) -> Failure {
    move |error| error.into_failure(NAME, at.step, at.time, phase)
}

impl Coupled {
    pub(crate) fn predict_motion(&mut self, at: StepTime) {
        self.turn();
        match &mut self.passes {
            Some(passes) if self.scheme == Scheme::Strong => {
                passes.begin(at.dt, &self.solid);
                self.motion.follow(at.dt, (&passes.start, &passes.guess), &self.mapping);
            }
            _ => self.motion.predict(at.dt, &self.solid, &self.mapping),
        }
    }

    /// Points off the structure's surface, and its normals, go where it is.
    pub(crate) fn turn(&mut self) {
        let Self { turned, motion, solid, surface, mapping, load, .. } = self;
        if let Some(turned) = turned.as_mut().filter(|_| motion.is_moving()) {
            turned.turn(&solid.displacement, surface, mapping, load);
        }
    }

    pub(crate) fn correct_motion(&mut self, at: StepTime) {
        if let Some(passes) = &mut self.passes {
            passes.correct(&self.solid.displacement);
            self.motion.follow(at.dt, (&passes.start, &passes.guess), &self.mapping);
        }
    }

    pub(crate) fn compare_motion(&mut self) -> StepReport {
        let passes = self.passes.as_mut().filter(|_| self.scheme == Scheme::Strong);
        let is_open = passes.is_some_and(|passes| passes.compare(&self.solid.displacement));
        StepReport { is_open, ..StepReport::unlimited() }
    }

    pub(crate) fn send_motion(&mut self, at: StepTime) -> Result<(), Failure> {
        let header = Header::new(Kind::Motion, at.step, at.time, at.dt);
        let (motion, normals) = (&self.motion, self.load.place.normals());
        let sent = self.fluid_link.send(header, self.motion_len, &mut |out| {
            let (columns, normal) = out.split_at_mut(out.len() - normals.len());
            motion.write(columns);
            normal.copy_from_slice(normals);
        });
        sent.map_err(lost(at, "send_motion"))
    }

    pub(crate) fn receive_load(&mut self, at: StepTime) -> Result<(), Failure> {
        let expect = Expect { kind: Kind::Load, step: at.step, count: Some(self.load.message_len()) };
        let load = &mut self.load;
        self.fluid_link.receive(expect, &mut |_, values| load.read(values)).map_err(lost(at, "receive_load"))
    }

    /// The solid's displacement at the start of the step, before its answer comes.
    pub(crate) fn keep_displacement(&mut self) {
        self.displacement_before.clone_from(&self.solid.displacement);
    }

    /// The markers go along with the wall.
    pub(crate) fn place_markers(&mut self) {
        if let Place::DummyMesh(place) = &mut self.load.place {
            place.follow(&self.motion.position);
        }
        if let Some(turned) = &mut self.turned {
            turned.place_points(&self.displacement_before, &self.side, &self.mapping);
        }
    }

    /// Marker pressures become tractions, and where these act nodal forces, on the fluid's side in its current place.
    pub(crate) fn make_traction(&mut self) {
        self.load.make_traction(&self.side, &self.motion.position);
    }

    /// The acting load goes to the solid's nodes by the transpose of the mapping; the tractions go along.
    pub(crate) fn map_load(&mut self) {
        self.load.map_to_solid(&self.mapping);
    }

    pub(crate) fn send_load(&mut self, at: StepTime) -> Result<(), Failure> {
        let header = Header::new(Kind::Load, at.step, at.time, at.dt);
        let (forces, tractions) = (&self.load.on_solid, &self.load.traction_on_solid);
        let is_felt = self.scheme != Scheme::ToFluid;
        if self.scheme == Scheme::Parallel {
            self.acted.copy_from_slice(forces);
        }
        let count = 1 + forces.len() + tractions.len();
        let sent = self.solid_link.send(header, count, &mut |out| {
            out[0] = f64::from(ActingLoad::NodalForce as u8);
            if is_felt {
                out[1..=forces.len()].copy_from_slice(forces);
                out[1 + forces.len()..].copy_from_slice(tractions);
            } else {
                out[1..].fill(0.0);
            }
        });
        sent.map_err(lost(at, "send_load"))
    }

    pub(crate) fn receive_motion(&mut self, at: StepTime) -> Result<(), Failure> {
        let link = &mut *self.solid_link;
        receive_solid(link, at.step, &self.surface, &mut self.solid).map_err(lost(at, "receive_motion"))
    }

    pub(crate) fn record(&mut self, at: StepTime) -> Result<(), Failure> {
        let Some(recorder) = &mut self.recorder else { return Ok(()) };
        recorder.write(Kind::Load, at, &[&self.load.pressure, &self.load.pair])?;
        recorder.write(Kind::Motion, at, &self.solid.columns())
    }
}

pub(crate) fn receive_surface(link: &mut dyn Link<f64>) -> Result<Surface, LinkError> {
    let peer = link.peer().to_owned();
    let mut surface = None;
    let expect = Expect { kind: Kind::Surface, step: 0, count: None };
    link.receive(expect, &mut |_, values| surface = Some(Surface::decode(values, &peer)))?;
    surface.expect("a message that was received was read")
}

pub(crate) fn receive_solid(
    link: &mut dyn Link<f64>,
    step: u64,
    surface: &Surface,
    motion: &mut SolidMotion,
) -> Result<(), LinkError> {
    let count = 3 * surface.node_count() * surface.dimension;
    link.receive(Expect { kind: Kind::Motion, step, count: Some(count) }, &mut |_, values| {
        motion.read(values)
    })
}

pub(crate) fn receive_points(link: &mut dyn Link<f64>, contract: &Contract) -> Result<Points, LinkError> {
    let peer = link.peer().to_owned();
    let mut points = None;
    let expect = Expect { kind: Kind::Points, step: 0, count: None };
    link.receive(expect, &mut |_, values| points = Some(Points::decode(values, &peer)))?;
    let points = points.expect("a message that was received was read")?;
    let (found, expected) = ((points.dimension, points.len()), (contract.dimension, contract.node_count));
    if found == expected {
        return Ok(points);
    }
    let what = format!("{} points in {}-D, expected {} in {}-D", found.1, found.0, expected.1, expected.0);
    Err(LinkError::Garbled { peer, what })
}

pub(crate) fn send_first_word(link: &mut dyn Link<f64>, word: &FirstWord) -> Result<(), LinkError> {
    let (kind, values) = match word {
        FirstWord::DummyMesh(mesh) => (Kind::BodyMesh, mesh.encode()),
        FirstWord::Points(wall, _) => (Kind::PointWall, wall.encode()),
    };
    link.send(Header::new(kind, 0, 0.0, 0.0), values.len(), &mut |out| out.copy_from_slice(&values))
}
