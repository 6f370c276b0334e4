//! The phases [`crate::step`] lists: what is received, made, mapped, sent and booked at each step.

use protocol::case::Scheme;
use protocol::control::{StepReport, StepTime};
use protocol::failure::Failure;
use protocol::header::{Header, Kind};
use protocol::interface::{ActingLoad, BodyMesh, Surface};
use protocol::link::{Expect, Link, LinkError};

use crate::case::LoadForm;
use crate::coupled::Coupled;
use crate::ledger::{Entry, sum};
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
        self.displacement_before.clone_from(&self.solid.displacement);
        match &mut self.passes {
            Some(passes) if self.scheme == Scheme::Strong => {
                passes.begin(at.dt, &self.solid);
                self.motion.follow(at.dt, (&passes.start, &passes.guess), &self.mapping);
            }
            _ => self.motion.predict(at.dt, &self.solid, &self.mapping),
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
        let motion = &self.motion;
        let sent = self.fluid_link.send(header, self.motion_len, &mut |out| motion.write(out));
        sent.map_err(lost(at, "send_motion"))
    }

    pub(crate) fn receive_load(&mut self, at: StepTime) -> Result<(), Failure> {
        let expect = Expect { kind: Kind::Load, step: at.step, count: Some(self.load.message_len()) };
        let load = &mut self.load;
        self.fluid_link.receive(expect, &mut |_, values| load.read(values)).map_err(lost(at, "receive_load"))
    }

    /// Marker pressures become tractions, and tractions nodal forces, on the fluid's side in its current place.
    pub(crate) fn make_traction(&mut self) {
        self.load.make_traction(self.dummy.facets(), &self.motion.position);
    }

    /// The acting load goes to the solid's nodes by the transpose of the mapping; the tractions go along.
    pub(crate) fn map_load(&mut self) {
        let form = self.settings.load;
        self.load.map_to_solid(form, &self.mapping);
    }

    pub(crate) fn send_load(&mut self, at: StepTime) -> Result<(), Failure> {
        let header = Header::new(Kind::Load, at.step, at.time, at.dt);
        let share = if self.scheme == Scheme::ToFluid { 0.0 } else { 1.0 };
        self.acted.iter_mut().zip(&self.load.on_solid).for_each(|(acted, load)| *acted = share * load);
        let (forces, traction) = (&self.acted, &self.load.traction_on_solid);
        let count = 1 + forces.len() + traction.len();
        let sent = self.solid_link.send(header, count, &mut |out| {
            out[0] = f64::from(ActingLoad::NodalForce as u8);
            out[1..=forces.len()].copy_from_slice(forces);
            let tractions = out[1 + forces.len()..].iter_mut().zip(traction);
            tractions.for_each(|(out, traction)| *out = share * traction);
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

    pub(crate) fn book_ledger(&mut self, at: StepTime) -> Result<(), Failure> {
        let passes = self.passes.as_mut().filter(|_| self.scheme == Scheme::Strong);
        for (component, step) in self.solid_step.iter_mut().enumerate() {
            let before = self.displacement_before[component];
            *step = self.solid.displacement[component] - before;
            self.solid_position[component] = self.surface.reference_position[component] + before;
        }
        self.mapping.spread_motion(&self.solid_step, &mut self.carried_step);
        let acting = if self.settings.load == LoadForm::Pair { &self.load.pair } else { &self.load.marker };
        self.jump.book(at.time, sum(acting, self.surface.dimension));
        let entry = Entry {
            time: at.time,
            dt: at.dt,
            fluid_position: &self.motion.position,
            fluid_velocity: &self.motion.velocity,
            carried_motion: &self.carried_step,
            fluid_load: acting,
            fluid_reference: self.dummy.reference_position(),
            solid_reference: &self.surface.reference_position,
            solid_position: &self.solid_position,
            solid_motion: &self.solid_step,
            solid_load: &self.load.on_solid,
            acted_load: &self.acted,
            pair_load: &self.load.pair,
            marker_load: &self.load.marker,
            passes: passes.map_or(1, |passes| passes.settle()),
        };
        self.ledger.book(&entry, self.jump.running())
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

pub(crate) fn send_body_mesh(link: &mut dyn Link<f64>, mesh: &BodyMesh) -> Result<(), LinkError> {
    let values = mesh.encode();
    let header = Header::new(Kind::BodyMesh, 0, 0.0, 0.0);
    link.send(header, values.len(), &mut |out| out.copy_from_slice(&values))
}
