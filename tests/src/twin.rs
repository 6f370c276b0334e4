//! The participants as threads of the test, over the in-process transport, obeying the launcher's own time loop.

use std::path::Path;
use std::time::Duration;

use launcher::check::{Checked, Program};
use launcher::conduct::{Ending, Observer, cast, conduct, resume, roles};
use launcher::processes::{Duty, Threads};
use launcher::time_step::Moment;
use protocol::case::{CaseFile, CheckReport, Shared};
use protocol::failure::Failure;
use protocol::participant::{self, Context};

const TIMEOUT: Duration = Duration::from_secs(60);

/// Conducts the resolved case `lock` with threads in place of processes; the series go into `folder`.
///
/// # Errors
/// The first failure of any participant.
pub fn run(lock: &Path, folder: &Path, threads: usize) -> Result<Ending, Failure> {
    run_watched((lock, None), folder, threads, &mut Nobody)
}

/// The same under the eyes of an observer, and from a moment whose state lies in `folder`, if there is one.
///
/// # Errors
/// The first failure of any participant.
pub fn run_watched(
    (lock, from): (&Path, Option<Moment>),
    folder: &Path,
    threads: usize,
    observer: &mut dyn Observer,
) -> Result<Ending, Failure> {
    let checked = check(lock);
    let duties = roles(cast(&checked.shared)).iter().map(|role| duty(role, &checked, folder, threads));
    let mut crew = Threads::start(TIMEOUT, duties.collect())?;
    let (shared, start) = (&checked.shared, checked.interface());
    let ending = match from {
        Some(moment) => resume(&mut crew, shared, (start, moment), observer)?,
        None => conduct(&mut crew, shared, start, observer)?,
    };
    crew.finish()?;
    Ok(ending)
}

struct Nobody;

impl Observer for Nobody {}

/// What the launcher's check gives, without a process: every program's own check is called.
pub fn check(case: &Path) -> Checked {
    let file = CaseFile::load(case, &[]).expect("the case can be read");
    let shared = Shared::read(&file);
    let (mut programs, mut reports) = (Vec::new(), Vec::new());
    for role in roles(cast(&shared)) {
        let program = program(role, &shared);
        reports.push(report(program, case));
        let (name, path) = (program.name.to_owned(), crate::programs::program(program.name));
        programs.push(Program { role, name, path });
    }
    let lock = file.resolved();
    Checked { case: case.to_owned(), shared, programs, reports, lock, left_out: Vec::new() }
}

fn report(program: participant::Program, case: &Path) -> CheckReport {
    let file = CaseFile::load(case, &[]).expect("the case can be read");
    let report = (program.check)(&file);
    assert_eq!(report.diagnostics, [], "{} refuses the case", program.name);
    report
}

fn program(role: &str, shared: &Shared) -> participant::Program {
    let is_rigid = shared.solid.as_ref().is_some_and(|solid| solid.model == "rigid");
    match role {
        "fluid" => fluid_isph::participant::PROGRAM,
        "coupler" => coupler::participant::PROGRAM,
        _ if is_rigid => solid_fem::rigid::PROGRAM,
        _ => solid_fem::participant::PROGRAM,
    }
}

fn duty(role: &str, checked: &Checked, folder: &Path, threads: usize) -> (String, Duty) {
    let program = program(role, &checked.shared);
    let (lock, folder) = (checked.case.clone(), folder.to_owned());
    let serve = move |mut transport| {
        let case = CaseFile::load(&lock, &[]).expect("the case can be read");
        // All three have read the same case, which is what the number stands for.
        let context = Context { folder, threads, scene: case.text().len() as u32 };
        let mut participant = (program.build)(&case, &context)?;
        participant::serve(program.role, &mut *participant, &mut transport)
    };
    (role.to_owned(), Box::new(serve))
}
