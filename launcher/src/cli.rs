//! The command line.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand, ValueEnum};
use protocol::case::Side;
use protocol::failure::{Failure, FailureClass};

use crate::check::{CheckError, Checked};
use crate::resume::{self, Resumption};
use crate::run::RunOptions;
use crate::stress::StressOptions;
use crate::study::{self, StudyOptions};
use crate::{check, conform, diagnostics, plan, report, run, stress};

/// Fluid-structure interaction with free surfaces: water by stabilised incompressible SPH, structures by finite
/// elements, each in a process of its own.
#[derive(Parser)]
#[command(name = "tidewall", version, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "Exit codes: 0 done; 2 case or usage rejected; 3 numerical failure; 4 a process died or fell \
silent; 5 files, disk or shared memory; 130 interrupted; 70 a bug in Tidewall.";

#[derive(Subcommand)]
enum Command {
    /// Checks a case, plans it, runs it and writes the report.
    ///
    /// Example: tidewall run cases/dam-break-elastic/plane.toml --set fluid.spacing=0.006 --until 0.41
    Run(RunArguments),
    /// Goes on from the last state another run has kept (output.state), into a run folder of its own.
    ///
    /// Example: tidewall resume runs/dam-break-elastic-plane-1 --until 0.8 --set coupling.scheme=css
    Resume(ResumeArguments),
    /// Finds everything that is wrong with a case before a run, and prints the plan.
    ///
    /// Example: tidewall check cases/dam-break-elastic/plane.toml
    Check(CaseArguments),
    /// Runs one case under several settings: error against run time, observed order, cheapest setting for an error.
    ///
    /// Finished runs are not repeated: the same command goes on where it was stopped. Writes study.csv, study.md and
    /// study.svg after every run. Example: tidewall study cases/studies/headline-spacing.toml
    Study {
        /// The study file (.toml), see docs/study-file.md.
        file: PathBuf,
        /// Folder of its runs and results. Default: runs/study-<name>.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Threads each solver computes with. Default: all cores.
        #[arg(long, value_name = "N")]
        threads: Option<usize>,
    },
    /// Plays launcher and coupler against the program of a solid or a fluid, and says which points of the contract it does
    /// not keep.
    ///
    /// Example: tidewall conform target/release/solid-rigid
    Conform(ConformArguments),
    /// Writes the solid of a case as an input deck for CalculiX, for an independent check.
    ///
    /// Example: tidewall export cases/cantilever/case.toml cantilever.inp
    Export {
        #[command(flatten)]
        case: CaseArguments,

        /// File to write (.inp).
        file: PathBuf,
    },
    /// Runs the stability suite: stiff, soft, fast, tiny and wrong scenes, each with a promise it must keep.
    ///
    /// Example: tidewall stress --short
    Stress(StressArguments),
    /// Writes report.html again, or one page comparing several runs.
    ///
    /// Example: tidewall report runs/dam-break-elastic-plane-1 runs/dam-break-elastic-plane-2
    Report {
        /// Run folders; the page goes into the first one (compare.html for several).
        #[arg(required = true)]
        runs: Vec<PathBuf>,
    },
}

#[derive(Args)]
struct CaseArguments {
    /// Case file (.toml).
    case: PathBuf,

    /// Overrides a key, such as fluid.spacing=0.006 or gauge[0].name=tip. May be given several times.
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    set: Vec<String>,

    /// Replaces the end time, s; also by a later one.
    #[arg(long, value_name = "SECONDS")]
    until: Option<f64>,
}

#[derive(Args)]
struct ConformArguments {
    /// The executable.
    program: PathBuf,

    /// What it plays.
    #[arg(long, value_enum, default_value_t = Role::Solid)]
    role: Role,

    /// A coupled case for it; without one a rigid wall beside water, for a fluid with points and with the dummy mesh.
    #[arg(long)]
    case: Option<PathBuf>,

    /// Starts the program with the case of this folder and leaves it without a parent: conform asks itself for it.
    #[arg(long, hide = true, value_name = "DIR", conflicts_with = "case")]
    orphan: Option<PathBuf>,
}

/// A side of the interface.
#[derive(Clone, Copy, ValueEnum)]
enum Role {
    /// It is loaded and moves.
    Solid,
    /// It is moved and loads.
    Fluid,
}

impl From<Role> for Side {
    fn from(role: Role) -> Self {
        match role {
            Role::Solid => Self::Solid,
            Role::Fluid => Self::Fluid,
        }
    }
}

#[derive(Args)]
struct RunArguments {
    #[command(flatten)]
    case: CaseArguments,

    /// Run folder; it must not hold a run already. Default: runs/<case>-<n>.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Threads each solver computes with; only one solver computes at a time. Default: all cores.
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
}

#[derive(Args)]
struct ResumeArguments {
    /// Folder of the run, whether it has ended, failed or was interrupted.
    run: PathBuf,

    /// Case to go on with, of the same particles and mesh. Default: that of the run, with the options it was given.
    #[arg(long, value_name = "CASE")]
    case: Option<PathBuf>,

    /// Overrides a key that leaves particles and mesh as they are. May be given several times.
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    set: Vec<String>,

    /// Replaces the end time, s.
    #[arg(long, value_name = "SECONDS")]
    until: Option<f64>,

    /// Run folder; it must not hold a run already. Default: runs/<case>-<n>.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Threads each solver computes with. Default: all cores.
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
}

#[derive(Args)]
struct StressArguments {
    /// Cases by the names of their files; all of them without one.
    names: Vec<String>,

    /// Only the short half.
    #[arg(long)]
    short: bool,

    /// Folder of the cases.
    #[arg(long, value_name = "DIR", default_value = "cases/stress")]
    cases: PathBuf,

    /// Folder of the report and the runs. Default: runs/stress-<n>.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Threads each solver computes with. Default: all cores.
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
}

impl CaseArguments {
    fn options(&self) -> Vec<String> {
        let until = self.until.map(|end| format!("time.end={end:?}"));
        self.set.iter().cloned().chain(until).collect()
    }
}

/// Parses the command line and carries it out.
pub fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Run(arguments) => run_command(arguments),
        Command::Resume(arguments) => resume_command(arguments),
        Command::Check(arguments) => {
            check_case(&arguments).map(|checked| print!("{}", plan::describe(&checked)))
        }
        Command::Study { file, out, threads } => {
            study::command(&StudyOptions { file, out, threads: threads.unwrap_or_else(cores).max(1) })
        }
        Command::Conform(arguments) => conform_command(arguments),
        Command::Export { case, file } => export(&case, &file),
        Command::Stress(arguments) => stress_command(arguments),
        Command::Report { runs } => report::command(&runs).map(|page| println!("{}", page.display())),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            match failure.class {
                FailureClass::Interrupted => eprintln!("tidewall: {} (step {})", failure.what, failure.step),
                _ if failure.what.is_empty() => {}
                _ if failure.process == "tidewall" => eprintln!("{failure}"),
                _ => eprintln!("tidewall: {failure}"),
            }
            ExitCode::from(failure.class.exit_code())
        }
    }
}

fn conform_command(arguments: ConformArguments) -> Result<(), Failure> {
    let ConformArguments { program, role, case, orphan } = arguments;
    let side = Side::from(role);
    if let Some(folder) = orphan {
        return conform::leave_orphan(side.role(), program, &folder);
    }
    let (text, result) = conform::tell(&conform::conform(&program, side, case.as_deref())?);
    print!("{text}");
    result
}

/// Has the solid write the deck; what it refuses it says itself.
fn export(arguments: &CaseArguments, file: &Path) -> Result<(), Failure> {
    let program = check::sibling("solid-fem");
    let options = arguments.options();
    let options = options.iter().flat_map(|option| ["--set", option]);
    let status = std::process::Command::new(&program)
        .arg("--export")
        .arg(&arguments.case)
        .arg(file)
        .args(options)
        .status()
        .map_err(|error| {
            let what = format!("cannot start {}: {error}", program.display());
            Failure::new(FailureClass::Resource, "tidewall", "export", what)
        })?;
    let failed = || Failure::new(FailureClass::Case, "tidewall", "export", String::new());
    if status.success() { Ok(()) } else { Err(failed()) }
}

/// Checks a case; mistakes are printed here, with the lines they stand in.
fn check_case(arguments: &CaseArguments) -> Result<Checked, Failure> {
    check::check(&arguments.case, &arguments.options()).map_err(|error| match error {
        CheckError::Mistakes { case, diagnostics } => {
            eprint!("{}", diagnostics::render(&case, &diagnostics, std::io::stderr().is_terminal()));
            Failure::new(FailureClass::Case, "tidewall", "check", String::new())
        }
        CheckError::Failed(failure) => failure,
    })
}

fn stress_command(arguments: StressArguments) -> Result<(), Failure> {
    let StressArguments { names, short, cases, out, threads } = arguments;
    stress::command(&StressOptions {
        names,
        short,
        cases,
        out,
        threads: threads.unwrap_or_else(cores).max(1),
    })
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn run_command(arguments: RunArguments) -> Result<(), Failure> {
    let checked = check_case(&arguments.case)?;
    let threads = arguments.threads.unwrap_or_else(cores).max(1);
    carry_out(&checked, &RunOptions { out: arguments.out, threads, resumed: None })
}

fn resume_command(arguments: ResumeArguments) -> Result<(), Failure> {
    let ResumeArguments { run, case, set, until, out, threads } = arguments;
    let resumed = Resumption::find(&run)?;
    let case = case.unwrap_or_else(|| resume::lock_of(&run));
    let checked = check_case(&CaseArguments { case, set, until })?;
    resumed.check(&checked)?;
    println!("from {}, step {}, t = {} s", run.display(), resumed.moment.step, resumed.moment.time);
    let threads = threads.unwrap_or_else(cores).max(1);
    carry_out(&checked, &RunOptions { out, threads, resumed: Some(resumed) })
}

fn carry_out(checked: &Checked, options: &RunOptions) -> Result<(), Failure> {
    print!("{}", plan::describe(checked));
    let outcome = run::run(checked, options)?;
    println!("{}", outcome.summary());
    outcome.failure.map_or(Ok(()), Err)
}
