//! The fluid as a participant of a run: handshake, motion in, load out, gauges and fields.

use std::path::{Path, PathBuf};

use protocol::case::{CaseFile, FluidSide, Shared};
use protocol::control::{Account, Part, Ready, Start, StepReport, StepTime};
use protocol::failure::{Failure, FailureClass};
use protocol::interface::Contract;
use protocol::link::{LinkError, Transport};
use protocol::participant::{Context, Participant, Program, not_my_part};
use protocol::phases::PhaseClock;
use protocol::state::{self, Stamp};

use crate::body::Structure;
use crate::body_layout::LayoutRules;
use crate::case::{NAME, check, resolve};
use crate::fluid::Fluid;
use crate::interface::Interface;
use crate::kernel::Kernel;
use crate::lattice::fitting_spacing;
use crate::offer::Offer;
use crate::output::{Frames, GaugeSeries};
use crate::scene::Scene;
use crate::snapshot::{Snapshot, Whole};

/// Relative growth of the water's energy beyond the work put in that earns a verdict.
const ENERGY_GROWTH: f64 = 0.02;

/// The fluid as a program.
pub const PROGRAM: Program = Program {
    name: NAME,
    role: "fluid",
    about: "Stabilised incompressible SPH for water with a free surface",
    check,
    build: |case, context| {
        let shared = Shared::read(case);
        Ok(match shared.header.dimension {
            2 => Box::new(FluidParticipant::<2>::new(case, shared, context)?),
            _ => Box::new(FluidParticipant::<3>::new(case, shared, context)?),
        })
    },
};

/// The participant before and after the handshake.
pub struct FluidParticipant<const D: usize> {
    shared: Shared,
    scene: Scene<D>,
    context: Context,
    running: Option<Running<D>>,
}

/// Everything after the handshake.
struct Running<const D: usize> {
    fluid: Fluid<D>,
    snapshot: Snapshot,
    /// The step the snapshot belongs to.
    saved_step: u64,
    interface: Option<Interface>,
    /// Numbers of particles at the start, which a state must have too.
    sizes: [(&'static str, usize); 4],
    gauges: GaugeSeries<D>,
    frames: Option<Frames>,
    pool: rayon::ThreadPool,
    clock: PhaseClock,
}

impl<const D: usize> FluidParticipant<D> {
    /// Takes the scene of the case; nothing is made or connected yet.
    ///
    /// # Errors
    /// A case that does not pass the check.
    pub fn new(case: &CaseFile, shared: Shared, context: &Context) -> Result<Self, Failure> {
        let scene = resolve(case, &shared);
        let refuse = |what: String| Failure::new(FailureClass::Case, NAME, "start", what);
        if let Some(diagnostic) = case.diagnostics().first() {
            return Err(refuse(diagnostic.to_string()));
        }
        let scene = scene.ok_or_else(|| refuse("there is no water in the case".to_owned()))?;
        Ok(Self { shared, scene, context: context.clone(), running: None })
    }

    fn running(&mut self) -> Result<&mut Running<D>, Failure> {
        self.running.as_mut().ok_or_else(not_started)
    }

    fn shake_hands(
        &self,
        nodes: u64,
        transport: &mut dyn Transport,
    ) -> Result<(Interface, Structure<D>), Failure> {
        let (end_time, scene) = (self.shared.time.end, self.context.scene);
        let contract = Contract { dimension: D, node_count: nodes as usize, end_time, scene };
        let shaken = match self.shared.fluid_side {
            FluidSide::DummyMesh => Interface::to_mesh(contract, transport),
            FluidSide::Points => Interface::to_points(contract, self.lay_out_points()?, transport),
        };
        shaken.map_err(|error| error.into_failure(NAME, 0, 0.0, "handshake"))
    }

    fn lay_out_points(&self) -> Result<Offer<D>, Failure> {
        let missing = || Failure::new(FailureClass::Bug, NAME, "start", "no solid to lay out points for");
        let outline = self.shared.solid.as_ref().ok_or_else(missing)?;
        let laid_out = fitting_spacing(&self.scene).and_then(|spacing| {
            let kernel = Kernel::new(self.scene.kernel, spacing);
            Offer::lay_out(outline, LayoutRules::new(&self.scene, &kernel))
        });
        laid_out.map_err(|error| error.into_failure(NAME))
    }
}

impl<const D: usize> Participant for FluidParticipant<D> {
    fn start(&mut self, start: &Start, transport: &mut dyn Transport) -> Result<Ready, Failure> {
        let hands = start.fluid_nodes.map(|nodes| self.shake_hands(nodes, transport)).transpose()?;
        let (interface, structure) = hands.unzip();
        let pool = thread_pool(self.context.threads)?;
        let fluid = pool.install(|| Fluid::new(self.scene.clone(), structure.as_ref()));
        let fluid = fluid.map_err(|error| error.into_failure(NAME))?;
        let sizes = [
            ("water_particles", fluid.water().len()),
            ("wall_particles", fluid.walls().tank().len() + fluid.walls().obstacles().len()),
            ("body_particles", fluid.walls().body().len()),
            ("dimension", D),
        ];
        let counts = sizes[..3].iter().map(|(key, count)| ((*key).to_owned(), *count as u64)).collect();
        let admitted_dt = fluid.admitted_time_step();
        let output = &self.shared.output;
        let gauges = GaugeSeries::create(&self.context.folder, &self.shared.gauges, output.series_every)?;
        let frames = output.fields_every.map(|_| Frames::new(PathBuf::from(&self.context.folder)));
        let clock = PhaseClock::default();
        let (snapshot, saved_step) = (Snapshot::default(), 0);
        self.running =
            Some(Running { fluid, snapshot, saved_step, interface, sizes, gauges, frames, pool, clock });
        Ok(Ready { counts, admitted_dt })
    }

    fn part(&mut self, part: Part, at: StepTime) -> Result<StepReport, Failure> {
        let Self { context, running, .. } = self;
        let running = running.as_mut().ok_or_else(not_started)?;
        match part {
            Part::Advance => return running.advance(at),
            Part::Keep => running.keep(&context.folder, at)?,
            Part::TakeUp => running.take_up(&context.folder, at)?,
            Part::Save => {
                running.saved_step = at.step;
                running.clock.run("save", || running.fluid.save(&mut running.snapshot));
            }
            Part::Restore => running.clock.run("restore", || running.fluid.restore(&running.snapshot)),
            Part::Record if running.gauges.is_empty() => (),
            Part::Record => {
                let Running { fluid, gauges, clock, .. } = running;
                let shown = clock.run("gauges", || gauges.record(at.time, fluid))?;
                return Ok(StepReport { shown, ..StepReport::unlimited() });
            }
            other => return Err(not_my_part(other)),
        }
        Ok(StepReport::unlimited())
    }

    fn output(&mut self, frame: u32, at: StepTime) -> Result<(), Failure> {
        let Running { fluid, gauges, frames, clock, .. } = self.running()?;
        gauges.flush()?;
        match frames {
            Some(frames) => clock.run("fields", || frames.write(frame, at.time, fluid)),
            None => Ok(()),
        }
    }

    fn account(&self) -> Account {
        let Some(running) = &self.running else { return Account::default() };
        let mut phases = running.fluid.phases();
        phases.extend(running.clock.table());
        let health = running.fluid.health();
        let mut verdicts = Vec::new();
        if health.energy_error > ENERGY_GROWTH {
            verdicts.push("energy_growth".to_owned());
        }
        if health.escaped_particles + health.broken_particles > 0 {
            verdicts.push("lost_particles".to_owned());
        }
        let mut table = health.table();
        table.extend(energy(&running.fluid));
        Account { phases, health: table, verdicts, ..Account::default() }
    }
}

impl<const D: usize> Running<D> {
    fn keep(&mut self, folder: &Path, at: StepTime) -> Result<(), Failure> {
        let Self { fluid, gauges, sizes, clock, .. } = self;
        let stamp = Stamp::new(at.step, at.time, sizes);
        clock.run("keep", || state::write(folder, "fluid", &stamp, &(fluid.keep(), gauges.due())))
    }

    fn take_up(&mut self, folder: &Path, at: StepTime) -> Result<(), Failure> {
        let stamp = Stamp::new(at.step, at.time, &self.sizes);
        let (whole, due): (Whole, Vec<f64>) = state::read(folder, "fluid", &stamp)?;
        self.fluid.take_up(whole);
        self.gauges.wait_until(&due);
        Ok(())
    }

    /// Takes the motion, gives the load back, and lets the water follow while the structure moves.
    fn advance(&mut self, at: StepTime) -> Result<StepReport, Failure> {
        let Self { fluid, interface, pool, clock, saved_step, .. } = self;
        let lost = |phase| move |error: LinkError| error.into_failure(NAME, at.step, at.time, phase);
        if let Some(interface) = interface {
            clock.run("receive motion", || interface.receive(at)).map_err(lost("receive motion"))?;
        }
        if let Some(interface) = interface {
            fluid.let_wall_give_way(interface.gives_way());
        }
        fluid.expect_passes(*saved_step == at.step);
        let motion = interface.as_ref().map(Interface::motion);
        let last = pool.install(|| fluid.respond(at.dt, motion)).map_err(|error| error.into_failure(NAME))?;
        if let Some(interface) = interface {
            interface.knock();
            pool.install(|| fluid.load(last));
            clock.run("send load", || interface.send(at, fluid)).map_err(lost("send load"))?;
        }
        pool.install(|| fluid.follow(last)).map_err(|error| error.into_failure(NAME))?;
        let (admitted_dt, substeps) = (fluid.admitted_time_step(), fluid.last_substeps());
        Ok(StepReport { admitted_dt, substeps, ..StepReport::default() })
    }
}

fn not_started() -> Failure {
    Failure::new(FailureClass::Bug, NAME, "order", "not started yet")
}

/// The water's energy now and at the start, and the work done on it, J: for the balance of the whole system.
fn energy<const D: usize>(fluid: &Fluid<D>) -> [(String, f64); 3] {
    let (kinetic, potential, work) = fluid.energy();
    let entries = [
        ("water_energy_j", kinetic + potential),
        ("water_energy_start_j", fluid.start_energy()),
        ("water_work_j", work),
    ];
    entries.map(|(name, value)| (name.to_owned(), value))
}

/// The threads of the solver: this one and as many more as it takes, so that a step needs no hand-over to begin.
fn thread_pool(threads: usize) -> Result<rayon::ThreadPool, Failure> {
    let builder = || rayon::ThreadPoolBuilder::new().num_threads(threads);
    // A thread can belong to one pool only: in tests that start several participants on one, the others get their own.
    builder().use_current_thread().build().or_else(|_| builder().build()).map_err(|error| {
        Failure::new(FailureClass::Resource, NAME, "start", format!("cannot start threads: {error}"))
    })
}
