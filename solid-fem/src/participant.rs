//! The elastic solid as a participant.

use std::collections::BTreeMap;

use protocol::case::{CaseFile, Shared};
use protocol::control::{Account, Part, Ready, Start, StepReport, StepTime};
use protocol::failure::{Failure, FailureClass};
use protocol::header::{Header, Kind};
use protocol::interface::{ActingLoad, Contract};
use protocol::link::{Expect, Link, LinkError, Transport, agree};
use protocol::participant::{Context, Participant, Program, not_my_part};
use protocol::state::{self, Stamp};

use crate::body::restart::Whole;
use crate::case::{Analysis, Settings, check};
use crate::linear::LinearMethod;
use crate::load::Load;
use crate::modes::Mode;
use crate::recorder::Recorder;
use crate::solid::Solid;

/// The solid's name in every message.
pub const NAME: &str = "solid";

/// The solid as a program.
pub const PROGRAM: Program = Program {
    name: "solid-fem",
    role: NAME,
    about: "Elastic solid by total-Lagrangian finite elements",
    check,
    build: |case, context| Ok(Box::new(FemSolid::new(case, context)?)),
};

/// The participant before and after the start.
pub struct FemSolid {
    shared: Shared,
    settings: Settings,
    context: Context,
    running: Option<Running>,
}

/// What a run holds.
struct Running {
    solid: Solid,
    recorder: Recorder,
    coupler: Option<CouplerLink>,
    /// The modes, for an analysis that asks for them.
    modes: Vec<Mode>,
    /// Energy at the start and at the last output, J.
    energy: [f64; 2],
}

/// The data link to the coupler and the last load that came over it.
struct CouplerLink {
    link: Box<dyn Link<f64>>,
    motion_len: usize,
    force_len: usize,
    load: Vec<f64>,
}

impl FemSolid {
    /// Reads the case; nothing is made yet.
    ///
    /// # Errors
    /// A case without an elastic solid, or one that did not pass the check.
    pub fn new(case: &CaseFile, context: &Context) -> Result<Self, Failure> {
        let shared = Shared::read(case);
        let settings = Settings::read(case, &shared);
        if let Some(diagnostic) = case.diagnostics().first() {
            return Err(Failure::new(FailureClass::Case, NAME, "start", diagnostic.to_string()));
        }
        let settings = settings.ok_or_else(|| {
            Failure::new(FailureClass::Case, NAME, "start", "the case has no elastic solid")
        })?;
        // Fails if a pool is there already, as in tests that run several participants in one process.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(context.threads).build_global();
        Ok(Self { shared, settings, context: context.clone(), running: None })
    }

    fn mode_count(&self) -> usize {
        self.shared.time.end.round().max(1.0) as usize
    }

    /// Says in the log how the linear systems are solved, and why.
    fn announce(&self, solid: &Solid) {
        let dt = self.shared.time.max_dt;
        let is_dynamic = self.settings.analysis == Analysis::Dynamic;
        let method = if is_dynamic { solid.linear_method(dt) } else { LinearMethod::Cholesky };
        let courant = solid.courant(dt);
        let unknowns = solid.displacement().len();
        tracing::info!(courant, unknowns, method = method.name(), "linear solver chosen by c dt / h");
    }

    fn running(&mut self) -> Result<&mut Running, Failure> {
        self.running.as_mut().ok_or_else(|| Failure::new(FailureClass::Bug, NAME, "order", "not started yet"))
    }
}

impl Participant for FemSolid {
    fn start(&mut self, start: &Start, transport: &mut dyn Transport) -> Result<Ready, Failure> {
        let scene = self.settings.scene.clone();
        let solid = match self.settings.analysis {
            Analysis::Dynamic if self.settings.starts_unloaded => Solid::new_unloaded(scene),
            Analysis::Dynamic => Solid::new(scene),
            Analysis::Static | Analysis::Modes => Solid::new_at_weight(scene),
        };
        let mut solid = solid.map_err(|error| error.into_failure("static_start"))?;
        let coupler = match start.surface_nodes.filter(|_| self.shared.fluid.is_some()) {
            None => None,
            Some(_) => {
                let contract = Contract {
                    dimension: self.shared.header.dimension,
                    node_count: solid.surface().node_count(),
                    end_time: self.shared.time.end,
                    scene: self.context.scene,
                };
                let link = CouplerLink::connect(&solid, &contract, transport);
                Some(link.map_err(|error| error.into_failure(NAME, 0, 0.0, "handshake"))?)
            }
        };
        let mut recorder = Recorder::create(&self.shared, &self.context.folder, &solid)?;
        let mut modes = Vec::new();
        if self.settings.analysis == Analysis::Modes {
            modes = solid.modes(self.mode_count()).map_err(|error| error.into_failure("modes"))?;
        } else {
            recorder.record(0.0, &mut solid)?;
        }
        self.announce(&solid);
        let count = |name: &str, count: usize| (name.to_owned(), count as u64);
        let counts = BTreeMap::from([
            count("solid_nodes", solid.mesh().node_count()),
            count("solid_elements", solid.mesh().element_count()),
        ]);
        let admitted_dt = solid.admitted_dt();
        let energy = [solid.energies().total(); 2];
        self.running = Some(Running { solid, recorder, coupler, modes, energy });
        Ok(Ready { counts, admitted_dt })
    }

    fn part(&mut self, part: Part, at: StepTime) -> Result<StepReport, Failure> {
        let running = self.running()?;
        match part {
            Part::Advance => return self.advance(at),
            Part::Keep => self.keep(at)?,
            Part::TakeUp => self.take_up(at)?,
            Part::Save => running.solid.save(),
            Part::Restore => running.solid.restore(),
            Part::Record => {
                let Running { solid, recorder, modes, .. } = running;
                match mode_of(modes, at.time) {
                    Some(mode) => recorder.record_mode(at.time.round(), mode, solid.mesh().dimension)?,
                    None => recorder.record(at.time, solid)?,
                }
                return Ok(StepReport { shown: running.recorder.shown(), ..StepReport::unlimited() });
            }
            other => return Err(not_my_part(other)),
        }
        Ok(StepReport::unlimited())
    }

    fn output(&mut self, frame: u32, at: StepTime) -> Result<(), Failure> {
        let Running { solid, recorder, modes, energy, .. } = self.running()?;
        energy[1] = solid.energies().total();
        match mode_of(modes, at.time) {
            Some(mode) => recorder.output_mode(at.time.round(), mode, solid),
            // Before the first mode there is nothing to show.
            None if !modes.is_empty() => Ok(()),
            None => recorder.output(frame, at.time, solid),
        }
    }

    fn account(&self) -> Account {
        let Some(Running { solid, energy, .. }) = &self.running else { return Account::default() };
        let counts = solid.counts();
        let per_step = |count: u64| count as f64 / counts.steps.max(1) as f64;
        let health = [
            ("solid_newton_iterations", per_step(counts.newton_iterations)),
            ("solid_linear_iterations", per_step(counts.linear_iterations)),
            ("solid_substeps", per_step(counts.substeps)),
            ("solid_halvings", counts.halvings as f64),
            ("solid_skipped_steps", counts.skipped as f64),
            ("solid_slept_steps", counts.slept as f64),
            ("solid_tangents", counts.tangents as f64),
            ("solid_factorizations", counts.factorizations as f64),
            ("solid_energy_start_j", energy[0]),
            ("solid_energy_j", energy[1]),
        ];
        let health = health.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        Account { phases: solid.phases(), health, ..Account::default() }
    }
}

impl FemSolid {
    fn keep(&mut self, at: StepTime) -> Result<(), Failure> {
        let folder = self.context.folder.clone();
        let Running { solid, recorder, energy, .. } = self.running()?;
        let stamp = Stamp::new(at.step, at.time, &solid.sizes());
        state::write(&folder, NAME, &stamp, &(solid.keep(), recorder.due(), energy[0]))
    }

    /// The series begin anew, at the state.
    fn take_up(&mut self, at: StepTime) -> Result<(), Failure> {
        let (folder, shared) = (self.context.folder.clone(), self.shared.clone());
        let Running { solid, recorder, modes, energy, .. } = self.running()?;
        let stamp = Stamp::new(at.step, at.time, &solid.sizes());
        let (whole, due, start): (Whole, Vec<f64>, f64) = state::read(&folder, NAME, &stamp)?;
        solid.take_up(whole);
        *energy = [start, solid.energies().total()];
        *recorder = Recorder::create(&shared, &folder, solid)?;
        if modes.is_empty() {
            recorder.record(at.time, solid)?;
        }
        recorder.wait_until(&due);
        Ok(())
    }

    /// Takes the load, advances, gives the motion back.
    fn advance(&mut self, at: StepTime) -> Result<StepReport, Failure> {
        let is_static = self.settings.analysis == Analysis::Static;
        let folder = self.context.folder.clone();
        let Running { solid, recorder, coupler, modes, .. } = self.running()?;
        if !modes.is_empty() {
            // The modes are known from the start.
            return Ok(StepReport::unlimited());
        }
        let lost = |error: LinkError| error.into_failure(NAME, at.step, at.time, "exchange");
        let load = match coupler {
            Some(coupler) => coupler.receive_load(at).map_err(lost)?,
            None => Load::None,
        };
        let done = if is_static { solid.advance_static(at.dt, load) } else { solid.advance(at.dt, load) };
        let done = match done {
            Ok(done) => done,
            Err(error) => {
                recorder.last_good(&folder, solid)?;
                return Err(error.into_failure("advance").at(at.step, at.time));
            }
        };
        if let Some(coupler) = coupler {
            coupler.send_motion(at, solid).map_err(lost)?;
        }
        let admitted_dt = solid.admitted_dt();
        Ok(StepReport { admitted_dt, substeps: done.substeps, ..StepReport::default() })
    }
}

/// The mode whose number the time is.
fn mode_of(modes: &[Mode], time: f64) -> Option<&Mode> {
    modes.get((time.round() as usize).checked_sub(1)?)
}

impl CouplerLink {
    /// Shakes hands with the coupler, gives it the surface and the motion at the start.
    fn connect(solid: &Solid, contract: &Contract, transport: &mut dyn Transport) -> Result<Self, LinkError> {
        let surface = solid.surface();
        let values = surface.encode();
        let force_len = surface.node_count() * surface.dimension;
        let load_len = 1 + force_len + surface.facets.markers().len() * surface.dimension;
        let motion_len = 3 * force_len;
        let mut link = transport.connect("coupler", values.len().max(motion_len))?;
        agree(&mut *link, contract)?;
        let header = Header::new(Kind::Surface, 0, 0.0, 0.0);
        link.send(header, values.len(), &mut |out| out.copy_from_slice(&values))?;
        let mut coupler = Self { link, motion_len, force_len, load: vec![0.0; load_len] };
        coupler.send_motion(StepTime { step: 0, time: 0.0, dt: 0.0 }, solid)?;
        Ok(coupler)
    }

    fn receive_load(&mut self, at: StepTime) -> Result<Load<'_>, LinkError> {
        let expect = Expect { kind: Kind::Load, step: at.step, count: Some(self.load.len()) };
        let load = &mut self.load;
        self.link.receive(expect, &mut |_, values| load.copy_from_slice(values))?;
        let (forces, tractions) = self.load[1..].split_at(self.force_len);
        let is_traction = self.load[0] == f64::from(ActingLoad::Traction as u8);
        Ok(if is_traction { Load::Traction(tractions) } else { Load::NodalForce(forces) })
    }

    fn send_motion(&mut self, at: StepTime, solid: &Solid) -> Result<(), LinkError> {
        let header = Header::new(Kind::Motion, at.step, at.time, at.dt);
        self.link.send(header, self.motion_len, &mut |out| solid.write_interface_motion(out))
    }
}
