//! `tidewall conform`: plays launcher and coupler against a solid of somebody else, and says what it does wrong.
//!
//! Every trial starts the program anew, in a name space of its own. What is tried stands in `trials.rs`; the coupler's
//! end of the data link in `coupler.rs`.

mod coupler;
mod trials;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use protocol::failure::{Failure, FailureClass};
use protocol::names::{RunId, RunNames};

use crate::check::{self, CheckError, Checked};
use crate::folder;
use crate::processes::{Launch, ProcessSpec, Processes};

/// The scene a program is tried in when the user names none: a plane wall beside water.
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
max = [0.1, 0.1]
[solid]
model = "rigid"
min = [0.2, 0.0]
max = [0.22, 0.1]
elements = [1, 5]
[time]
end = 0.02
max_dt = 1e-3
"#;

/// Longest wait for any single answer of the program.
const TIMEOUT: Duration = Duration::from_secs(10);

/// One thing a participant must do, and what it did instead.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// What it must do.
    pub what: &'static str,
    /// `None` if it does; else what was seen.
    pub fault: Option<String>,
}

/// The program under trial and the scene made for it.
struct Bench {
    checked: Checked,
    folder: PathBuf,
}

/// Tries `program` in the scene of `case`, or in a scene of its own; findings in the order of a run.
///
/// # Errors
/// The scene is no coupled one, the program cannot be started at all, or there is no room for the files.
pub fn conform(program: &Path, case: Option<&Path>) -> Result<Vec<Finding>, Failure> {
    let refuse = |what: String| Failure::new(FailureClass::Case, "tidewall", "conform", what);
    let program =
        program.canonicalize().map_err(|error| refuse(format!("{}: {error}", program.display())))?;
    let id = RunId::random().map_err(|error| refuse(format!("cannot draw an id: {error}")))?;
    let folder = std::env::temp_dir().join(format!("tidewall-conform-{id}"));
    std::fs::create_dir_all(&folder).map_err(|error| protocol::series::unwritable(&folder, &error))?;
    let own = folder.join("conform.toml");
    folder::write(&own, SCENE)?;
    let findings = Bench::new(&program, case.unwrap_or(&own), &folder).and_then(|bench| trials::all(&bench));
    // What stays behind in the folder for temporary files does no harm.
    let _ = std::fs::remove_dir_all(&folder);
    findings
}

impl Bench {
    fn new(program: &Path, case: &Path, folder: &Path) -> Result<Self, Failure> {
        let refuse = |what: String| Failure::new(FailureClass::Case, "tidewall", "conform", what);
        let option = format!("solid.program={:?}", program.display().to_string());
        let checked = check::check(case, &[option]).map_err(|error| match error {
            CheckError::Failed(failure) => failure,
            CheckError::Mistakes { diagnostics, .. } => {
                let list: Vec<_> = diagnostics.iter().map(ToString::to_string).collect();
                refuse(format!("the case is refused: {}", list.join("; ")))
            }
        })?;
        if checked.figure("surface_nodes").is_none() || checked.figure("dummy_nodes").is_none() {
            return Err(refuse("the scene needs water and a solid whose plan has surface_nodes".to_owned()));
        }
        let lock = toml::to_string(&checked.lock).expect("the resolved case is plain TOML");
        folder::write(&folder.join("case.lock.toml"), &lock)?;
        Ok(Self { checked, folder: folder.to_owned() })
    }

    /// Starts the program and hears its first word.
    fn start(&self, names: &RunNames) -> Result<Processes, Failure> {
        let solid = self.checked.programs.iter().find(|program| program.role == "solid");
        let solid = solid.expect("a coupled scene has a solid");
        let path = |name: &str| self.folder.join(name).into_os_string();
        let lock = path("case.lock.toml");
        let arguments = ["--run".into(), lock, "--folder".into(), self.folder.clone().into_os_string()];
        let spec = ProcessSpec {
            name: "solid".to_owned(),
            program: solid.path.clone(),
            arguments: arguments.into(),
            environment: Vec::new(),
        };
        let log = self.folder.join("log");
        std::fs::create_dir_all(&log).map_err(|error| protocol::series::unwritable(&log, &error))?;
        Processes::start(Launch { names, log: &log, timeout: TIMEOUT }, &[spec])
    }
}

/// The findings as lines for people; the first fault decides the failure.
///
/// # Errors
/// A fault was found.
pub fn tell(findings: &[Finding]) -> (String, Result<(), Failure>) {
    let mut text = String::new();
    for finding in findings {
        let _ = match &finding.fault {
            None => writeln!(text, "  ok     {}", finding.what),
            Some(fault) => writeln!(text, "  WRONG  {}: {fault}", finding.what),
        };
    }
    let wrong = findings.iter().filter(|finding| finding.fault.is_some()).count();
    let result = match wrong {
        0 => Ok(()),
        _ => Err(Failure::new(
            FailureClass::Case,
            "tidewall",
            "conform",
            format!("{wrong} of {} points of the contract are not kept", findings.len()),
        )
        .with_hint("docs/participant.md shows the whole contract.")),
    };
    (text, result)
}
