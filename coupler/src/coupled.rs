//! The interface once both sides have shaken hands: its state, and the verdict on how it fares.

use std::collections::BTreeMap;

use protocol::case::{Scheme, Shared, SolidOutline};
use protocol::control::{Account, Start, StepReport, StepTime};
use protocol::failure::{Failure, FailureClass};
use protocol::header::Kind;
use protocol::interface::Surface;
use protocol::link::{Link, Transport};
use protocol::participant::Context;
use protocol::phases::PhaseClock;

use crate::case::{LoadForm, OnGuard, Settings};
use crate::escalation::Escalation;
use crate::exchange::{refused, send_first_word};
use crate::fluid_side::FluidSide;
use crate::guard::{self, LoadJump};
use crate::handshake::Handshake;
use crate::ledger::{Ledger, LoadSums};
use crate::load::Load;
use crate::mapping::Mapping;
use crate::motion::{FluidMotion, SolidMotion};
use crate::participant::NAME;
use crate::passes::Passes;
use crate::record::{Recorder, Replay};
use crate::turned::Turned;

/// Everything the coupler holds between two steps.
pub(crate) struct Coupled {
    pub(crate) settings: Settings,
    pub(crate) surface: Surface,
    pub(crate) side: FluidSide,
    pub(crate) mapping: Mapping,
    /// Where points of the fluid's side turn with the structure.
    pub(crate) turned: Option<Turned>,
    /// The fluid's side of the motion.
    pub(crate) motion: FluidMotion,
    /// The solid's side of the motion, and its displacement one step before.
    pub(crate) solid: SolidMotion,
    pub(crate) displacement_before: Vec<f64>,
    pub(crate) load: Load,
    /// The load the solid has got last where that is not the present one: that of the last step in the parallel scheme, and
    /// none where the solid is to feel none, `[n, D]` N.
    pub(crate) acted: Vec<f64>,
    /// The scheme of the present step.
    pub(crate) scheme: Scheme,
    /// Where the guard may choose another scheme.
    pub(crate) escalation: Option<Escalation>,
    /// The scheme it has chosen for the step after this one.
    pub(crate) next_scheme: Option<Scheme>,
    /// Of the strong scheme and of steps that are escalated.
    pub(crate) passes: Option<Passes>,
    /// What the loads of the step come to, once it is known.
    pub(crate) load_sums: Option<LoadSums>,
    pub(crate) ledger: Ledger,
    pub(crate) jump: LoadJump,
    least_work: f64,
    pub(crate) clock: PhaseClock,
    pub(crate) fluid_link: Box<dyn Link<f64>>,
    pub(crate) solid_link: Box<dyn Link<f64>>,
    pub(crate) motion_len: usize,
    /// Where the case asks for it.
    pub(crate) recorder: Option<Recorder>,
    /// Where one side is a recording.
    replay: Option<Replay>,
}

impl Coupled {
    /// Opens both data links, shakes hands, takes the solid's surface and gives the fluid its side.
    pub(crate) fn connect(
        shared: &Shared,
        settings: &Settings,
        context: &Context,
        start: &Start,
        transport: &mut dyn Transport,
    ) -> Result<Self, Failure> {
        let mut handshake = Handshake::new(shared, settings, context, start, transport)?;
        let (solid_link, surface, solid) = handshake.with_solid()?;
        let outline = handshake.outline;
        let (mut fluid_link, side) = handshake.with_fluid(&settings.dummy_elements)?;
        let refuse = |what: String| Failure::new(FailureClass::Case, NAME, "mapping", what);
        let mapping = match &side {
            FluidSide::DummyMesh(mesh) => Mapping::new(settings.mapping, mesh.reference_position(), &surface),
            FluidSide::Points(points) => Mapping::of_points(settings.mapping, points, &surface),
        };
        let mut mapping = mapping.map_err(|error| refuse(error.to_string()))?;
        let mut load = Load::new(settings.load, &side, &surface);
        if load.marker_count() == 0 && settings.load == LoadForm::Markers {
            return Err(refuse("load = \"markers\", but none of the fluid's points has an area".to_owned()));
        }
        let mut turned = Turned::new(&side, &mapping, &surface);
        if let Some(turned) = &mut turned {
            turned.turn(&solid.displacement, &surface, &mut mapping, &mut load);
            turned.place_points(&solid.displacement, &side, &mapping);
        }
        let first = first_scheme(settings, shared.scheme);
        let motion = first_motion((first, settings), outline, (&side, &mapping), &solid);
        let word = side.first_word(response_mass(settings, &surface, &mapping), motion.response());
        send_first_word(&mut *fluid_link, &word).map_err(refused("handshake"))?;
        let (is_rigid, replay) = (outline.model == "rigid", handshake.into_replay());
        let dimension = shared.header.dimension;
        let hydrostatic = hydrostatic_load(shared, load.place.total_area());
        Ok(Self {
            scheme: first,
            next_scheme: None,
            escalation: (settings.on_guard == OnGuard::Escalate && !is_rigid && replay.is_none())
                .then(|| Escalation::new(first, settings.scheme)),
            passes: settings.passes.clone().filter(|_| !is_rigid),
            settings: settings.clone(),
            acted: vec![0.0; surface.node_count() * dimension],
            load_sums: None,
            ledger: Ledger::create(&context.folder, &surface, shared.output.series_every)?,
            jump: LoadJump::new(hydrostatic, settings.ledger_window),
            least_work: guard::LEAST_WORK * hydrostatic * depth(shared),
            load,
            clock: PhaseClock::default(),
            displacement_before: solid.displacement.clone(),
            recorder: settings
                .record
                .then(|| begin_record(context, AT_START, (&surface, &side), &solid))
                .transpose()?,
            replay,
            surface,
            side,
            mapping,
            turned,
            motion,
            solid,
            fluid_link,
            solid_link,
            motion_len: word.motion_len(),
        })
    }

    /// Runs one phase and books its time.
    pub(crate) fn timed<T>(&mut self, name: &'static str, phase: impl FnOnce(&mut Self) -> T) -> T {
        let start = std::time::Instant::now();
        let result = phase(self);
        self.clock.add(name, start.elapsed().as_secs_f64());
        result
    }

    /// The answer to an order to book; carries the scheme of the steps to come when the guard changes it, and the verdict
    /// when the run must end on it.
    pub(crate) fn report(&mut self, at: StepTime) -> StepReport {
        // A change holds for the step after the next, which may have been ordered already; none is beyond the first.
        let mut next_scheme = None;
        if let Some(next) = self.next_scheme.take() {
            self.change_scheme(next, at);
        } else {
            let is_restless = self.jump.is_restless();
            next_scheme = self.escalation.as_mut().and_then(|escalation| escalation.book(is_restless));
            self.next_scheme = next_scheme;
        }
        if at.step == 1
            && let Some(next) = self.next_scheme.take()
        {
            self.change_scheme(next, at);
        }
        let is_wanted = self.settings.on_guard == OnGuard::Stop && self.jump.is_known();
        let stop = self.jump.diverges() || is_wanted;
        let verdict = if stop { self.verdict() } else { None };
        StepReport { admitted_dt: self.admitted_dt(at.time), next_scheme, verdict, ..StepReport::default() }
    }

    fn change_scheme(&mut self, next: Scheme, at: StepTime) {
        let (from, to, load_jump) = (self.scheme.name(), next.name(), self.jump.running());
        tracing::warn!(step = at.step, time = at.time, from, to, load_jump, "another scheme from here on");
        self.scheme = next;
        self.motion.escalate(next);
        self.jump.forget();
    }

    /// A recording is followed step by step; nothing else limits the coupler.
    pub(crate) fn admitted_dt(&self, time: f64) -> f64 {
        self.replay.as_ref().map_or(f64::INFINITY, |replay| replay.admitted_dt(time))
    }

    /// A one-way scheme, or one side alone, cannot become unstable, and its two works have nothing to do with each other.
    fn verdict(&self) -> Option<String> {
        if matches!(self.settings.scheme, Scheme::ToSolid | Scheme::ToFluid) || self.replay.is_some() {
            return None;
        }
        // Where both sides agree at the end of every step nothing is staggered, and a load that jumps is the water's own.
        let agrees =
            self.settings.scheme == Scheme::Strong && self.passes.as_ref().is_some_and(Passes::agrees);
        let jumps = self.jump.diverges() || (!agrees && self.jump.greatest() > guard::UNSTABLE);
        let is_large = self.ledger.work_difference() > self.least_work;
        let unstable = jumps || (is_large && self.ledger.work_mismatch() > guard::MISMATCH);
        unstable.then(|| "unstable_coupling".to_owned())
    }

    pub(crate) fn account(&self) -> Account {
        let totals = self.ledger.totals();
        let norm = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let passes = self.passes.iter().flat_map(Passes::health);
        let escalation = self.escalation.iter().flat_map(Escalation::health);
        let health = [
            ("load_jump_mean", self.jump.mean()),
            ("load_jump_greatest", self.jump.greatest()),
            ("load_jump_restless_steps", self.jump.restless_steps() as f64),
            ("work_mismatch", self.ledger.work_mismatch()),
            ("interface_work_fluid_j", totals.fluid_work),
            ("interface_work_solid_j", totals.solid_work),
            ("pair_impulse_ns", norm(totals.pair_impulse)),
            ("marker_impulse_ns", norm(totals.marker_impulse)),
            ("mapping_force_imbalance", totals.force_imbalance),
            ("mapping_moment_imbalance", totals.moment_imbalance),
            ("mapping_work_imbalance", totals.work_imbalance),
        ];
        let health: BTreeMap<_, _> = health
            .into_iter()
            .chain(passes)
            .chain(escalation)
            .map(|(name, value)| (name.to_owned(), value))
            .collect();
        Account {
            phases: self.clock.table(),
            health,
            verdicts: self.verdict().into_iter().collect(),
            ..Account::default()
        }
    }

    pub(crate) fn flush(&mut self) -> Result<(), Failure> {
        if let Some(recorder) = &mut self.recorder {
            recorder.flush()?;
        }
        self.ledger.flush()
    }

    pub(crate) fn marker_count(&self) -> usize {
        self.load.marker_count()
    }

    pub(crate) fn node_count(&self) -> usize {
        self.side.node_count()
    }
}

/// Before the first step.
const AT_START: StepTime = StepTime { step: 0, time: 0.0, dt: 0.0 };

/// A recording with the surface, the fluid's points if it offers any, and the motion at its start.
pub(crate) fn begin_record(
    context: &Context,
    at: StepTime,
    (surface, side): (&Surface, &FluidSide),
    solid: &SolidMotion,
) -> Result<Recorder, Failure> {
    let mut recorder = Recorder::create(&context.folder)?;
    recorder.write(Kind::Surface, at, &[&surface.encode()])?;
    if let FluidSide::Points(points) = side {
        recorder.write(Kind::Points, at, &[&points.encode()])?;
    }
    recorder.write(Kind::Motion, at, &solid.columns())?;
    Ok(recorder)
}

/// Passes are the launcher's to order: chosen ones begin after the first steps.
fn first_scheme(settings: &Settings, written: Scheme) -> Scheme {
    let is_chosen = settings.scheme == Scheme::Strong && written != Scheme::Strong;
    if is_chosen { Scheme::Robin } else { settings.scheme }
}

/// The motion of the fluid's side, before the first step.
fn first_motion(
    rule: (Scheme, &Settings),
    outline: &SolidOutline,
    (side, mapping): (&FluidSide, &Mapping),
    solid: &SolidMotion,
) -> FluidMotion {
    let reference = side.reference_position();
    let mut position = vec![0.0; reference.len()];
    mapping.place(reference, &solid.displacement, &mut position);
    let body = (outline.model == "rigid", outline.prescribed);
    FluidMotion::new(rule, body, reference, position)
}

/// m_r at the fluid's nodes, `[n]` kg/m2.
fn response_mass(settings: &Settings, surface: &Surface, mapping: &Mapping) -> Vec<f64> {
    let mut mass = mapping.spread_scalar(&surface.areal_mass);
    mass.iter_mut().for_each(|mass| *mass *= settings.robin_factor);
    mass
}

/// rho_f g H times the wetted area, N: the scale of the load of water at rest.
fn hydrostatic_load(shared: &Shared, wetted_area: f64) -> f64 {
    let Some(fluid) = &shared.fluid else { return 0.0 };
    let gravity =
        shared.gravity.as_ref().map_or(0.0, |g| g.acceleration.iter().map(|a| a * a).sum::<f64>().sqrt());
    fluid.density * gravity * depth(shared) * wetted_area
}

/// H, from the floor to the top of the water at the start, m.
fn depth(shared: &Shared) -> f64 {
    let regions = shared.fluid.iter().flat_map(|fluid| &fluid.regions);
    let top = regions.map(|region| region.max[1]).fold(0.0, f64::max);
    top - shared.domain.as_ref().map_or(0.0, |domain| domain.region.min[1])
}
