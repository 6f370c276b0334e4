//! `tidewall run`: folder, room, processes, time loop, report.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use protocol::control::{Account, Start, StepReport, StepTime};
use protocol::failure::{Failure, FailureClass};
use protocol::names::{RunId, RunNames};
use protocol::phases::PhaseTime;
use protocol::shm::{self, ChannelNeed};

use crate::check::{Checked, Program};
use crate::compare::{self, ErrorEntry};
use crate::conduct::{self, Ending, Observer};
use crate::processes::{Interrupt, Launch, ProcessSpec, Processes};
use crate::progress::Progress;
use crate::resume::{self, Resumption};
use crate::run_json::{Continued, RunJson, Status};
use crate::time_step::Moment;
use crate::{folder, report};

/// Largest order or reply, bytes.
const CONTROL_BYTES: u64 = 64 * 1024;

/// Options of one run.
#[derive(Debug, Clone)]
pub struct RunOptions {
    /// Run folder; the next free one under `runs/` if not given.
    pub out: Option<PathBuf>,
    /// Threads each solver computes with.
    pub threads: usize,
    /// What it goes on from, if it is not to begin at time 0.
    pub resumed: Option<Resumption>,
}

/// How a run ended.
#[derive(Debug)]
pub struct Outcome {
    /// Its folder.
    pub folder: PathBuf,
    /// Its last `run.json`.
    pub json: RunJson,
    /// The first cause, if it did not reach its end.
    pub failure: Option<Failure>,
}

impl Outcome {
    /// A few lines for the terminal.
    pub fn summary(&self) -> String {
        let json = &self.json;
        let mut lines = vec![format!(
            "{:?} at t = {:.6} s, step {}; {:.1} s of wall time, {:.1} s of CPU",
            json.status, json.simulated_s, json.steps, json.wall_s, json.cpu_s
        )];
        for error in &json.errors {
            let verdict = match error.passed {
                Some(true) => "  kept",
                Some(false) => "  MISSED",
                None => "",
            };
            let (name, column) = (&error.gauge, &error.column);
            lines.push(format!(
                "  {name}.{column} {} against {}: error {:.4e} {}, measured {:.4e}{verdict}",
                error.norm, error.reference, error.value, error.unit, error.measured
            ));
        }
        lines.extend(json.verdicts.iter().map(|verdict| format!("  verdict: {verdict}")));
        lines.push(format!("  {}", self.folder.join("report.html").display()));
        lines.join("\n")
    }
}

/// Runs a checked case. Once the folder stands, every ending is an [`Outcome`] with `run.json` and report written.
///
/// # Errors
/// The folder cannot be made, or there is no room in shared memory: nothing was started.
pub fn run(checked: &Checked, options: &RunOptions) -> Result<Outcome, Failure> {
    let free = shm::free_bytes(Path::new(shm::SHM_DIR)).map_err(|error| {
        Failure::new(
            FailureClass::Resource,
            "tidewall",
            "launch",
            format!("cannot look at {}: {error}", shm::SHM_DIR),
        )
    })?;
    check_room(checked, free)?;
    let out = options.out.as_deref();
    let folder = folder::make(out, &checked.shared.header.name)?;
    let mut lock = checked.lock.clone();
    folder::keep_curves(&mut lock, &folder)?;
    let lock = toml::to_string(&lock).expect("the resolved case is plain TOML");
    folder::write(&folder.join("case.lock.toml"), &lock)?;
    if let Some(resumed) = &options.resumed {
        resumed.copy_into(&folder, checked.programs.iter().map(|program| program.role))?;
    }
    let mut watch = Watch::new(checked, options, &folder);
    watch.json.write(&folder)?;
    let ending = carry_out(checked, options, &mut watch);
    watch.progress.finish();
    let failure = watch.end(ending);
    report::write(&folder)
        .or_else(|error| if failure.is_some() { Ok(PathBuf::new()) } else { Err(error) })?;
    let json = watch.json;
    Ok(Outcome { folder, json, failure })
}

/// Refuses a run that would overflow shared memory; `free` is the room there is, bytes.
///
/// # Errors
/// [`FailureClass::Resource`].
pub fn check_room(checked: &Checked, free: u64) -> Result<(), Failure> {
    let dimension = checked.shared.header.dimension;
    let Start { surface_nodes, fluid_nodes } = checked.interface();
    let (solid, fluid) =
        (surface_nodes.unwrap_or_default() as usize, fluid_nodes.unwrap_or_default() as usize);
    // Orders and replies of every process; motion and load on both sides, with room for the handshake's meshes.
    let mut needs = vec![ChannelNeed { message_bytes: CONTROL_BYTES }; 2 * checked.programs.len()];
    if fluid > 0 {
        let values = |nodes: usize| 64 + nodes * (3 + 4 * dimension + dimension * dimension);
        let need = |nodes: usize| ChannelNeed { message_bytes: 8 * values(nodes) as u64 };
        needs.extend([need(solid), need(solid), need(fluid), need(fluid)]);
    }
    shm::check_room(&needs, free).map(drop).map_err(|error| {
        Failure::new(FailureClass::Resource, "tidewall", "launch", error.to_string())
            .with_hint("Enlarge /dev/shm (in a container: --shm-size), or remove what fills it.")
    })
}

fn carry_out(checked: &Checked, options: &RunOptions, watch: &mut Watch<'_>) -> Result<Ending, Failure> {
    let resource = |what: String| Failure::new(FailureClass::Resource, "tidewall", "launch", what);
    let interrupt =
        Interrupt::install().map_err(|error| resource(format!("cannot handle signals: {error}")))?;
    watch.interrupt = Some(interrupt);
    let id = RunId::random().map_err(|error| resource(format!("cannot draw a run id: {error}")))?;
    let names = RunNames::of(id);
    let log = watch.folder.join("log");
    std::fs::create_dir_all(&log).map_err(|error| protocol::series::unwritable(&log, &error))?;
    let timeout = Duration::from_secs_f64(checked.shared.time.silence_limit);
    let specs: Vec<_> =
        checked.programs.iter().map(|program| spec(program, watch.folder, options, timeout)).collect();
    let mut processes = Processes::start(Launch { names: &names, log: &log, timeout }, &specs)?;
    let start = checked.interface();
    let (crew, shared) = (&mut processes, &checked.shared);
    let ending = match &options.resumed {
        Some(resumed) => conduct::resume(crew, shared, (start, resumed.moment), watch)?,
        None => conduct::conduct(crew, shared, start, watch)?,
    };
    processes.finish()?;
    Ok(ending)
}

fn spec(program: &Program, folder: &Path, options: &RunOptions, timeout: Duration) -> ProcessSpec {
    let path = |name: &str| folder.join(name).into_os_string();
    let arguments = [
        "--run".into(),
        path("case.lock.toml"),
        "--folder".into(),
        folder.as_os_str().to_owned(),
        "--threads".into(),
        options.threads.to_string().into(),
        "--silence".into(),
        // The launcher, who sees all of them, is to lose patience first.
        (2.0 * timeout.as_secs_f64()).to_string().into(),
    ];
    ProcessSpec {
        name: program.role.to_owned(),
        program: program.path.clone(),
        arguments: arguments.into(),
        environment: Vec::new(),
    }
}

/// What the launcher keeps while the run goes: progress and `run.json`.
struct Watch<'a> {
    checked: &'a Checked,
    folder: &'a Path,
    json: RunJson,
    start: Instant,
    progress: Progress,
    interrupt: Option<Interrupt>,
}

impl<'a> Watch<'a> {
    fn new(checked: &'a Checked, options: &RunOptions, folder: &'a Path) -> Self {
        let health = checked.figure("added_mass_ratio").map(|ratio| ("added_mass_ratio".to_owned(), ratio));
        let json = RunJson {
            case: checked.shared.header.name.clone(),
            case_file: checked
                .case
                .canonicalize()
                .unwrap_or_else(|_| checked.case.clone())
                .display()
                .to_string(),
            tidewall: env!("CARGO_PKG_VERSION").to_owned(),
            status: Status::Running,
            exit_code: 0,
            dimension: checked.shared.header.dimension,
            counts: BTreeMap::new(),
            continued: options.resumed.as_ref().map(Continued::from),
            steps: 0,
            simulated_s: 0.0,
            wall_s: 0.0,
            cpu_s: 0.0,
            threads: options.threads,
            time_loop: Vec::new(),
            processes: Vec::new(),
            left_out: checked.left_out.clone(),
            errors: Vec::new(),
            health: health.into_iter().collect(),
            verdicts: Vec::new(),
            failure: None,
        };
        let progress = Progress::new(checked.shared.time.end);
        Self { checked, folder, json, start: Instant::now(), progress, interrupt: None }
    }

    /// People know the processes by the names of their programs.
    fn display_name(&self, role: &str) -> String {
        let program = self.checked.programs.iter().find(|program| program.role == role);
        program.map_or(role, |program| &program.name).to_owned()
    }

    fn errors(&self) -> Vec<ErrorEntry> {
        let begin = self.json.continued.as_ref().map_or(0.0, |continued| continued.time_s);
        compare::errors(self.folder, &self.checked.shared, &self.checked.case, begin)
    }

    /// Books how the run ended; gives the failure its process's name.
    fn end(&mut self, ending: Result<Ending, Failure>) -> Option<Failure> {
        self.json.wall_s = self.start.elapsed().as_secs_f64();
        self.json.errors = self.errors();
        let failure = match ending {
            Ok(Ending::Completed) => None,
            Ok(Ending::Interrupted) => Some(interrupted(self.json.steps, self.json.simulated_s)),
            Err(failure) => Some(Failure { process: self.display_name(&failure.process), ..failure }),
        };
        self.json.status = match &failure {
            None => Status::Completed,
            Some(failure) if failure.class == FailureClass::Interrupted => Status::Interrupted,
            Some(_) => Status::Failed,
        };
        self.json.exit_code = failure.as_ref().map_or(0, |failure| failure.class.exit_code());
        self.json.failure = failure.clone().filter(|failure| failure.class != FailureClass::Interrupted);
        let written = self.json.write(self.folder);
        failure.or(written.err())
    }
}

fn interrupted(step: u64, time: f64) -> Failure {
    Failure::new(
        FailureClass::Interrupted,
        "tidewall",
        "time loop",
        "interrupted by the user; the step was finished",
    )
    .at(step, time)
}

impl Observer for Watch<'_> {
    fn ready(&mut self, counts: &BTreeMap<String, u64>) {
        self.json.counts = counts.clone();
    }

    fn stepped(&mut self, at: StepTime, done: &StepReport) {
        (self.json.steps, self.json.simulated_s) = (at.step, at.time);
        self.progress.show(at, done);
    }

    fn output(
        &mut self,
        _at: StepTime,
        accounts: &[(String, Account)],
        loop_phases: Vec<PhaseTime>,
    ) -> Result<(), Failure> {
        self.json.time_loop = loop_phases;
        let wall_s = self.start.elapsed().as_secs_f64();
        self.json.wall_s = wall_s;
        let named: Vec<_> =
            accounts.iter().map(|(role, account)| (self.display_name(role), account.clone())).collect();
        self.json.take_accounts(wall_s, named.into_iter());
        self.json.errors = self.errors();
        self.json.write(self.folder)
    }

    fn kept(&mut self, at: Moment) -> Result<(), Failure> {
        resume::complete(self.folder, at)
    }

    fn is_stopped(&self) -> bool {
        self.interrupt.as_ref().is_some_and(Interrupt::is_requested)
    }
}
