//! Checks a case before anything starts: every program checks its own part, the complaints come together.

use std::path::{Path, PathBuf};
use std::process::Command;

use protocol::PROTOCOL_VERSION;
use protocol::case::{
    CaseFile, CheckReport, Diagnostic, FluidSide, GaugeKind, LeftOut, Shared, Side, Target,
};
use protocol::control::Start;
use protocol::failure::{Failure, FailureClass};

use crate::stress::promise::Promise;

/// The role a program plays in a run, and where it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    /// `fluid`, `coupler` or `solid`.
    pub role: &'static str,
    /// Its name, of the executable.
    pub name: String,
    /// The executable.
    pub path: PathBuf,
}

/// A case in which nothing was found wrong, and what the programs plan.
#[derive(Debug)]
pub struct Checked {
    /// The case file.
    pub case: PathBuf,
    /// The shared sections.
    pub shared: Shared,
    /// The programs the scene needs, in the order fluid, coupler, solid.
    pub programs: Vec<Program>,
    /// Their reports, in the same order.
    pub reports: Vec<CheckReport>,
    /// The whole case with every default filled in, as `case.lock.toml`.
    pub lock: toml::Table,
    /// What the scene does not need.
    pub left_out: Vec<LeftOut>,
}

/// Why a case is not run.
#[derive(Debug)]
pub enum CheckError {
    /// There are mistakes in the case.
    Mistakes {
        /// The case, for the lines.
        case: Box<CaseFile>,
        /// All of them.
        diagnostics: Vec<Diagnostic>,
    },
    /// A file or program is missing or broken.
    Failed(Failure),
}

impl Program {
    /// An executable of somebody else.
    fn at(role: &'static str, path: PathBuf) -> Self {
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        Self { role, name, path }
    }
}

impl Checked {
    /// A figure of any program's plan.
    pub fn figure(&self, name: &str) -> Option<f64> {
        self.reports.iter().find_map(|report| report.figure(name))
    }

    /// The sizes of both sides of the interface, as planned.
    pub fn interface(&self) -> Start {
        let size = |name: &str| self.figure(name).map(|count| count as u64);
        let fluid_nodes = match self.shared.fluid_side {
            FluidSide::DummyMesh => size("dummy_nodes"),
            FluidSide::Points => size("interface_points"),
        };
        Start { surface_nodes: size("surface_nodes"), fluid_nodes }
    }
}

/// Checks the case with the `--set` options laid over it.
///
/// # Errors
/// [`CheckError::Mistakes`] with all of them at once; [`CheckError::Failed`] when the case cannot be read or a program
/// does not answer.
pub fn check(path: &Path, options: &[String]) -> Result<Checked, CheckError> {
    check_with(path, options, None)
}

/// The same with an executable in the place of one side, whatever the case says.
///
/// # Errors
/// As [`check`].
pub fn check_with(
    path: &Path,
    options: &[String],
    stand_in: Option<(Side, &Path)>,
) -> Result<Checked, CheckError> {
    let case = CaseFile::load(path, options).map_err(|error| {
        let what = format!("cannot read the case {}: {error}", path.display());
        CheckError::Failed(Failure::new(FailureClass::Case, "tidewall", "check", what))
    })?;
    let shared = Shared::read(&case);
    let mut programs = programs(&case, &shared, path);
    if let Some((side, stand_in)) = stand_in
        && let Some(program) = programs.iter_mut().find(|program| program.role == side.role())
    {
        *program = Program::at(side.role(), stand_in.to_owned());
    }
    check_launcher_part(&case, &shared, path);
    let mut reports = Vec::new();
    for program in &programs {
        reports.push(ask(program, path, options).map_err(CheckError::Failed)?);
    }
    if shared.output.state {
        refuse_forgetful(&case, &programs, &reports);
    }
    let mut diagnostics = case.diagnostics();
    let mut lock = case.resolved();
    for report in &reports {
        diagnostics.extend(report.diagnostics.iter().cloned());
        merge(&mut lock, &report.resolved);
    }
    diagnostics.sort();
    diagnostics.dedup();
    if !diagnostics.is_empty() {
        return Err(CheckError::Mistakes { case: Box::new(case), diagnostics });
    }
    make_absolute(&mut lock, path);
    let mut left_out = absent_processes(&shared);
    left_out.extend(reports.iter().flat_map(|report| report.left_out.iter().cloned()));
    Ok(Checked { case: path.to_owned(), shared, programs, reports, lock, left_out })
}

/// A run whose programs do not all keep their state keeps none.
fn refuse_forgetful(case: &CaseFile, programs: &[Program], reports: &[CheckReport]) {
    for (program, _) in programs.iter().zip(reports).filter(|(_, report)| !report.keeps_state) {
        let message = format!("{} cannot keep its state", program.name);
        case.section_or_default("output").complain("state", message, "false", "");
    }
}

/// The programs a scene needs, and no others.
pub fn programs(case: &CaseFile, shared: &Shared, path: &Path) -> Vec<Program> {
    let own = |role, name: &str| Program { role, name: name.to_owned(), path: sibling(name) };
    let mut programs = Vec::new();
    let replayed = shared.replay.as_ref().map(|replay| replay.side);
    if shared.fluid.is_some() && replayed != Some(Side::Fluid) {
        let about = "Another executable in the fluid's place, relative to the case file; what it makes of the other keys \
                     of [fluid] is its own affair.";
        let other = named(case, Side::Fluid, about, path);
        programs.push(other.unwrap_or_else(|| own("fluid", "fluid-isph")));
    }
    if shared.fluid.is_some() && shared.solid.is_some() {
        programs.push(own("coupler", "coupler"));
    }
    if let Some(solid) = shared.solid.as_ref().filter(|_| replayed != Some(Side::Solid)) {
        let about = "Another executable in the solid's place, relative to the case file.";
        let other = named(case, Side::Solid, about, path);
        let name = if solid.model == "rigid" { "solid-rigid" } else { "solid-fem" };
        programs.push(other.unwrap_or_else(|| own("solid", name)));
    }
    programs
}

/// The program a case names for one side.
fn named(case: &CaseFile, side: Side, about: &str, path: &Path) -> Option<Program> {
    let section = case.section(side.role())?;
    let program = section.text("program").about(about).optional()?;
    // A name without a folder would be looked for in PATH.
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    Some(Program::at(side.role(), folder.unwrap_or(Path::new(".")).join(program)))
}

/// The executable of this name beside the running one.
pub(crate) fn sibling(name: &str) -> PathBuf {
    let own = std::env::current_exe().unwrap_or_default();
    own.parent().unwrap_or(Path::new(".")).join(name)
}

/// What only the launcher can find wrong: the scene as a whole.
fn check_launcher_part(case: &CaseFile, shared: &Shared, path: &Path) {
    // What a case promises is asked for by `tidewall stress` alone, but is checked like all else.
    let _ = Promise::read(case);
    if shared.fluid.is_none() && shared.solid.is_none() {
        case.section_or_default("case").complain(
            "name",
            "there is neither water nor a solid in this scene",
            "a [fluid], a [solid], or both",
            "Add a [fluid] section with a region of water, or a [solid] section.",
        );
    }
    if (shared.solid.is_none() || shared.fluid.is_none())
        && let Some(section) = case.section("coupling")
    {
        let hint = "Remove the section, or add what is missing.";
        section.complain("scheme", "[coupling] has no use in this scene", "a [fluid] and a [solid]", hint);
    }
    for (gauge, section) in shared.gauges.iter().zip(case.list("gauge")) {
        let of_fluid = gauge.kind.is_of_fluid();
        let absent = if of_fluid { shared.fluid.is_none() } else { shared.solid.is_none() };
        if absent {
            let part = if of_fluid { "fluid" } else { "solid" };
            section.complain(
                "kind",
                format!("the scene has no {part} to record it"),
                &format!("a [{part}]"),
                "",
            );
        }
        if matches!(&gauge.kind, GaugeKind::Force { on } if on == "body") && shared.solid.is_none() {
            section.complain("on", "the scene has no body", "a tank face", "");
        }
    }
    for (reference, section) in shared.references.iter().zip(case.list("reference")) {
        if let Target::Curve { file, column, band } = &reference.target {
            let columns =
                [Some(column), band.as_ref().map(|band| &band.0), band.as_ref().map(|band| &band.1)];
            if let Err(what) =
                crate::compare::load_curve(&beside(path, file), &columns.map(|c| c.map(String::as_str)))
            {
                section.complain("curve", what, "a CSV file with the columns named", "");
            }
        }
    }
}

fn beside(case: &Path, file: &str) -> PathBuf {
    case.parent().unwrap_or(Path::new(".")).join(file)
}

/// Asks a program for its part of the check.
fn ask(program: &Program, case: &Path, options: &[String]) -> Result<CheckReport, Failure> {
    let refuse =
        |class, what: String, hint: &str| Failure::new(class, &program.name, "check", what).with_hint(hint);
    let options = options.iter().flat_map(|option| ["--set", option]);
    let output =
        Command::new(&program.path).arg("--check").arg(case).args(options).output().map_err(|error| {
            let what = format!("cannot start {}: {error}", program.path.display());
            refuse(FailureClass::Resource, what, "Build all programs with: cargo build --release")
        })?;
    if !output.status.success() {
        let what = format!(
            "--check ended with {}: {}",
            output.status,
            String::from_utf8_lossy(&output.stderr).trim()
        );
        return Err(refuse(FailureClass::Case, what, ""));
    }
    let report: CheckReport = serde_json::from_slice(&output.stdout).map_err(|error| {
        refuse(FailureClass::Case, format!("its answer to --check is no check report: {error}"), "")
    })?;
    if report.protocol_version != PROTOCOL_VERSION {
        let (expected, found) = (PROTOCOL_VERSION, report.protocol_version);
        let what =
            format!("protocol version: expected {expected}, found {found} in {}", program.path.display());
        return Err(refuse(FailureClass::Case, what, "Build all programs from one version."));
    }
    Ok(report)
}

/// Lays `other` over `table`; both hold the same values where they meet.
fn merge(table: &mut toml::Table, other: &toml::Table) {
    for (key, value) in other {
        match (table.get_mut(key), value) {
            (Some(toml::Value::Table(mine)), toml::Value::Table(theirs)) => merge(mine, theirs),
            (Some(toml::Value::Array(mine)), toml::Value::Array(theirs)) => merge_list(mine, theirs),
            _ => {
                table.insert(key.clone(), value.clone());
            }
        }
    }
}

fn merge_list(mine: &mut Vec<toml::Value>, theirs: &[toml::Value]) {
    for (index, value) in theirs.iter().enumerate() {
        match (mine.get_mut(index), value) {
            (Some(toml::Value::Table(mine)), toml::Value::Table(theirs)) => merge(mine, theirs),
            (Some(mine), value) => *mine = value.clone(),
            (None, value) => mine.push(value.clone()),
        }
    }
}

/// Curve files, meshes and programs are named relative to the case; the lock file lies elsewhere.
fn make_absolute(lock: &mut toml::Table, case: &Path) {
    let absolute = |value: &mut toml::Value| {
        if let toml::Value::String(file) = value {
            let path = beside(case, file);
            *file = path.canonicalize().unwrap_or(path).to_string_lossy().into_owned();
        }
    };
    if let Some(toml::Value::Array(references)) = lock.get_mut("reference") {
        let tables = references.iter_mut().filter_map(toml::Value::as_table_mut);
        tables.filter_map(|table| table.get_mut("curve")).for_each(absolute);
    }
    if let Some(coupling) = lock.get_mut("coupling").and_then(toml::Value::as_table_mut) {
        coupling.get_mut("replay").into_iter().for_each(absolute);
    }
    for (section, key) in [("fluid", "program"), ("solid", "program"), ("solid", "mesh")] {
        let table = lock.get_mut(section).and_then(toml::Value::as_table_mut);
        table.and_then(|table| table.get_mut(key)).into_iter().for_each(absolute);
    }
}

fn absent_processes(shared: &Shared) -> Vec<LeftOut> {
    let mut left_out = Vec::new();
    match (&shared.fluid, &shared.solid) {
        (Some(_), None) => {
            left_out.push(LeftOut::new("solid process", "the scene has no solid"));
            left_out.push(LeftOut::new("coupler process, data channels", "nothing to couple"));
        }
        (None, Some(_)) => {
            left_out.push(LeftOut::new("fluid process", "the scene has no water"));
            left_out.push(LeftOut::new("coupler process, data channels", "nothing to couple"));
        }
        (_, Some(solid)) if solid.model == "rigid" => {
            left_out
                .push(LeftOut::new("finite elements", "the body is rigid: the stub takes the solid's place"));
        }
        _ => {}
    }
    if let Some(replay) = &shared.replay {
        let what = format!("{} process", replay.side.role());
        left_out.push(LeftOut::new(&what, "a recording stands in its place"));
    }
    if shared.gravity.is_none() {
        left_out.push(LeftOut::new("gravity", "the case has no [gravity]"));
    }
    if shared.output.fields_every.is_none() {
        left_out.push(LeftOut::new("field output", "the case has no output.fields_every"));
    }
    left_out
}
