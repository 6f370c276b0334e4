//! `tidewall conform`: plays launcher and coupler against a solid or a fluid of somebody else, and says what it does
//! wrong.
//!
//! Every trial starts the program anew, in a name space of its own. What is tried stands in `trials.rs`, the same for all;
//! the coupler's end of the data link, one kind for each role, in `line.rs` and `fluid.rs`; one that lies in `forger.rs`.

mod fluid;
mod forger;
mod line;
mod orphan;
mod trials;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use protocol::case::{FluidSide, Side};
use protocol::failure::{Failure, FailureClass};
use protocol::names::{RunId, RunNames};

use crate::check::{self, CheckError, Checked};
use crate::folder;
use crate::processes::{Launch, ProcessSpec, Processes};
use line::Role;

pub use orphan::leave_orphan;

/// The scene a program is tried in when the user names none: a plane wall, held or rigid, beside water.
const SCENE: &str = r#"
[case]
name = "conform"
dimension = 2
[domain]
min = [0.0, 0.0]
max = [0.4, 0.4]
open = ["top"]
[gravity]
acceleration = [0.0, -9.81]
[fluid]
density = 1000.0
spacing = 0.01
[[fluid.region]]
min = [0.0, 0.0]
max = [0.2, 0.1]
[solid]
model = "rigid"
min = [0.2, 0.0]
max = [0.24, 0.1]
elements = [1, 5]
[time]
end = 0.02
max_dt = 1e-3
"#;

/// Longest wait for any single answer of the program.
const TIMEOUT: Duration = Duration::from_secs(10);
/// What the program is told for its own waits.
const SILENCE: Duration = Duration::from_secs(2);

/// One thing a participant must do, and what it did instead.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// What it must do.
    pub what: &'static str,
    /// `None` if it does; else what was seen.
    pub fault: Option<String>,
}

/// The findings in one form of the interface.
#[derive(Debug, Clone, PartialEq)]
pub struct Round {
    /// The form, where there are several.
    pub form: Option<&'static str>,
    /// The findings in the order of a run, or why the program cannot be tried in this form.
    pub findings: Result<Vec<Finding>, String>,
}

/// The program under trial and the scene made for it.
struct Bench {
    checked: Checked,
    role: Role,
    /// Size of the interface both ends are told.
    node_count: usize,
    folder: PathBuf,
}

/// Tries `program` as one side of the scene of `case`, or of a scene of its own: a fluid there in every form of the
/// interface that it can.
///
/// # Errors
/// The scene is no coupled one, the program cannot be started at all, or there is no room for the files.
pub fn conform(program: &Path, side: Side, case: Option<&Path>) -> Result<Vec<Round>, Failure> {
    let program =
        program.canonicalize().map_err(|error| refuse(format!("{}: {error}", program.display())))?;
    let id = RunId::random().map_err(|error| refuse(format!("cannot draw an id: {error}")))?;
    let folder = std::env::temp_dir().join(format!("tidewall-conform-{id}"));
    std::fs::create_dir_all(&folder).map_err(|error| protocol::series::unwritable(&folder, &error))?;
    let own = folder.join("conform.toml");
    folder::write(&own, SCENE)?;
    let rounds = match (side, case) {
        (Side::Fluid, None) => every_form(&program, &own, &folder),
        _ => round(&program, side, (case.unwrap_or(&own), &[]), &folder).map(|findings| {
            let findings = Ok(findings);
            vec![Round { form: None, findings }]
        }),
    };
    // What stays behind in the folder for temporary files does no harm.
    let _ = std::fs::remove_dir_all(&folder);
    rounds
}

/// Tries a fluid with both forms of its side; at least one must be possible.
fn every_form(program: &Path, case: &Path, folder: &Path) -> Result<Vec<Round>, Failure> {
    let forms = [("points without a mesh", "points"), ("the dummy mesh", "dummy_mesh")];
    let results = forms.map(|(form, word)| {
        let option = [format!("coupling.fluid_side={word:?}")];
        (form, round(program, Side::Fluid, (case, &option), folder))
    });
    if let [(_, Err(failure)), (_, Err(_))] = &results {
        return Err(failure.clone());
    }
    let told = |(form, result): (_, Result<_, Failure>)| Round {
        form: Some(form),
        findings: result.map_err(|failure| failure.what),
    };
    Ok(results.into_iter().map(told).collect())
}

fn round(
    program: &Path,
    side: Side,
    (case, options): (&Path, &[String]),
    folder: &Path,
) -> Result<Vec<Finding>, Failure> {
    trials::all(&Bench::new((side, program), case, options, folder)?)
}

impl Bench {
    fn new(
        (side, program): (Side, &Path),
        case: &Path,
        options: &[String],
        folder: &Path,
    ) -> Result<Self, Failure> {
        let checked =
            check::check_with(case, options, Some((side, program))).map_err(|error| match error {
                CheckError::Failed(failure) => failure,
                CheckError::Mistakes { diagnostics, .. } => {
                    let list: Vec<_> = diagnostics.iter().map(ToString::to_string).collect();
                    refuse(format!("the case is refused: {}", list.join("; ")))
                }
            })?;
        let role = match side {
            Side::Solid => Role::Solid,
            Side::Fluid => Role::Fluid(checked.shared.fluid_side),
        };
        let missing = |figure: &str| refuse(format!("the plan of the program does not give {figure}"));
        let planned = |figure: &str| checked.figure(figure).map(|count| count as usize);
        if checked.shared.fluid.is_none() || checked.shared.solid.is_none() {
            return Err(refuse("the scene needs water and a solid".to_owned()));
        }
        let node_count = match role {
            Role::Solid => planned("surface_nodes").ok_or_else(|| missing("surface_nodes"))?,
            Role::Fluid(FluidSide::DummyMesh) => fluid::mesh_nodes(checked.shared.header.dimension),
            Role::Fluid(FluidSide::Points) => {
                planned("interface_points").ok_or_else(|| missing("interface_points"))?
            }
        };
        let bench = Self { checked, role, node_count, folder: folder.to_owned() };
        let lock = toml::to_string(&bench.checked.lock).expect("the resolved case is plain TOML");
        folder::write(&bench.lock(), &lock)?;
        Ok(bench)
    }

    /// The resolved case.
    fn lock(&self) -> PathBuf {
        lock_in(&self.folder)
    }

    fn program(&self) -> &Path {
        let name = self.role.name();
        let program = self.checked.programs.iter().find(|program| program.role == name);
        &program.expect("the side under trial is not replayed").path
    }

    /// Starts the program and hears its first word.
    fn start(&self, names: &RunNames) -> Result<Processes, Failure> {
        start(names, self.role.name(), self.program().to_owned(), &self.folder)
    }
}

fn lock_in(folder: &Path) -> PathBuf {
    folder.join("case.lock.toml")
}

/// Starts a program with the case of this folder and hears its first word.
fn start(names: &RunNames, role: &str, program: PathBuf, folder: &Path) -> Result<Processes, Failure> {
    let silence = SILENCE.as_secs_f64().to_string();
    let arguments = [
        "--run".into(),
        lock_in(folder).into_os_string(),
        "--folder".into(),
        folder.as_os_str().to_owned(),
        "--threads".into(),
        "1".into(),
        "--silence".into(),
        silence.into(),
    ];
    let spec =
        ProcessSpec { name: role.to_owned(), program, arguments: arguments.into(), environment: Vec::new() };
    let log = folder.join("log");
    std::fs::create_dir_all(&log).map_err(|error| protocol::series::unwritable(&log, &error))?;
    Processes::start(Launch { names, log: &log, timeout: TIMEOUT }, &[spec])
}

fn refuse(what: String) -> Failure {
    Failure::new(FailureClass::Case, "tidewall", "conform", what)
}

/// The findings as lines for people.
///
/// # Errors
/// A fault was found.
pub fn tell(rounds: &[Round]) -> (String, Result<(), Failure>) {
    let mut text = String::new();
    let (mut wrong, mut tried) = (0, 0);
    for Round { form, findings } in rounds {
        match (form, findings) {
            (Some(form), Err(why)) => writeln!(text, "{form}: not tried, {why}"),
            (Some(form), Ok(_)) => writeln!(text, "{form}:"),
            _ => Ok(()),
        }
        .expect("a text can be written to");
        for finding in findings.iter().flatten() {
            tried += 1;
            wrong += usize::from(finding.fault.is_some());
            let _ = match &finding.fault {
                None => writeln!(text, "  ok     {}", finding.what),
                Some(fault) => writeln!(text, "  WRONG  {}: {fault}", finding.what),
            };
        }
    }
    let result = match wrong {
        0 => Ok(()),
        _ => Err(refuse(format!("{wrong} of {tried} points of the contract are not kept"))
            .with_hint("docs/participant.md shows the whole contract.")),
    };
    (text, result)
}
