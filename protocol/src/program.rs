//! The main program every participant shares: `--check CASE` for people and the launcher, `--run` for the launcher.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::{CommandFactory, FromArgMatches, Parser};
use tracing_subscriber::EnvFilter;

use crate::case::CaseFile;
use crate::failure::{Failure, FailureClass};
use crate::ipc::{IpcTransport, guard};
use crate::names::RunNames;
use crate::participant::{Context, Program, serve};

/// Started by `tidewall run`; by hand only with --check.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Checks the program's part of a case and prints diagnostics, resolved values and plan as JSON.
    #[arg(long, value_name = "CASE", conflicts_with = "run")]
    check: Option<PathBuf>,

    /// With --check: overrides a key of the case. May be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,

    /// Joins a run: the resolved case (case.lock.toml).
    #[arg(long, value_name = "CASE", required_unless_present = "check", requires_all = ["folder", "prefix", "root"])]
    run: Option<PathBuf>,

    /// Run folder.
    #[arg(long)]
    folder: Option<PathBuf>,

    /// Prefix of the run's names in shared memory.
    #[arg(long)]
    prefix: Option<String>,

    /// Folder of the run's sockets.
    #[arg(long)]
    root: Option<PathBuf>,

    /// A peer that does not answer for this long is given up, s.
    #[arg(long, default_value_t = 60.0, value_name = "SECONDS")]
    silence: f64,

    /// Threads to compute with.
    #[arg(long, default_value_t = 1)]
    threads: usize,
}

/// Runs a participant as a program; returns its exit code (0, or that of the [`FailureClass`]).
pub fn main(program: Program) -> ExitCode {
    let command = Arguments::command().name(program.name).about(program.about);
    let arguments = match Arguments::from_arg_matches(&command.get_matches()) {
        Ok(arguments) => arguments,
        Err(error) => error.exit(),
    };
    let result = match &arguments.check {
        Some(case) => check(program, case, &arguments.set),
        None => join(program, &arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("{failure}");
            ExitCode::from(failure.class.exit_code())
        }
    }
}

fn check(program: Program, case: &Path, options: &[String]) -> Result<(), Failure> {
    let case = load(program, case, options)?;
    let report = (program.check)(&case);
    println!("{}", serde_json::to_string(&report).expect("a check report holds nothing JSON cannot"));
    Ok(())
}

fn load(program: Program, path: &Path, options: &[String]) -> Result<CaseFile, Failure> {
    CaseFile::load(path, options).map_err(|error| {
        let what = format!("cannot read {}: {error}", path.display());
        Failure::new(FailureClass::Case, program.name, "check", what)
    })
}

fn join(program: Program, arguments: &Arguments) -> Result<(), Failure> {
    let refuse = |class, what: String| Failure::new(class, program.name, "start", what);
    let (Some(lock), Some(folder), Some(prefix), Some(root)) =
        (&arguments.run, &arguments.folder, &arguments.prefix, &arguments.root)
    else {
        return Err(refuse(FailureClass::Case, "--run needs --folder, --prefix and --root".to_owned()));
    };
    let names = RunNames::new(prefix, root).map_err(|error| refuse(FailureClass::Case, error.to_string()))?;
    let _member = guard::guard(&names).map_err(|error| refuse(FailureClass::Process, error.to_string()))?;
    start_log(program, folder)
        .map_err(|error| refuse(FailureClass::Resource, format!("cannot write the log: {error}")))?;
    let case = load(program, lock, &[])?;
    let scene = crc32fast::hash(case.text().as_bytes());
    let context = Context { folder: folder.clone(), threads: arguments.threads.max(1), scene };
    let timeout = Duration::try_from_secs_f64(arguments.silence).unwrap_or(Duration::from_secs(60));
    let mut transport = IpcTransport::new(&names, program.role, timeout)
        .map_err(|error| error.into_failure(program.name, 0, 0.0, "start"))?;
    tracing::info!(program = program.name, threads = context.threads, "joined the run");
    let mut participant = match (program.build)(&case, &context) {
        Ok(participant) => participant,
        Err(failure) => Box::new(crate::participant::Stillborn(failure)),
    };
    let result = serve(program.role, &mut *participant, &mut transport);
    match &result {
        Ok(()) => tracing::info!("done"),
        Err(failure) => tracing::error!(%failure),
    }
    result
}

fn start_log(program: Program, folder: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(folder.join("log"))?;
    let file = std::fs::File::create(folder.join("log").join(format!("{}.jsonl", program.name)))?;
    let filter = EnvFilter::try_from_env("TIDEWALL_LOG").unwrap_or_else(|_| EnvFilter::new("info"));
    // A second subscriber can only be set in tests that call this twice; the first one stays.
    let _ = tracing_subscriber::fmt().json().with_env_filter(filter).with_writer(file).try_init();
    Ok(())
}
