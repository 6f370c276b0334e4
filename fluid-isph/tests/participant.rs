//! The fluid obeys orders without any other process: counts, steps, gauges and fields appear in the run folder.

#![expect(clippy::unwrap_used, reason = "a failing helper must fail the test")]

use fluid_isph::participant::PROGRAM;
use protocol::case::CaseFile;
use protocol::control::{Part, Start, StepTime};
use protocol::link::{Link, LinkError, Transport};
use protocol::participant::Context;

const CASE: &str = r#"
[case]
name = "small dam"
dimension = 2
[domain]
min = [0.0, 0.0]
max = [0.4, 0.4]
open = ["top"]
[gravity]
acceleration = [0.0, -9.81]
[fluid]
spacing = 0.02
[[fluid.region]]
min = [0.0, 0.0]
max = [0.1, 0.2]
[time]
end = 0.02
max_dt = 0.001
[output]
fields_every = 0.01
[[gauge]]
name = "front"
kind = "front"
[[gauge]]
name = "level"
kind = "water_level"
point = [0.05, 0.0]
[[gauge]]
name = "floor"
kind = "force"
on = "bottom"
[[gauge]]
name = "still"
kind = "hydrostatic_error"
[[gauge]]
name = "volume"
kind = "volume"
"#;

/// A scene without a solid connects to nobody.
struct Nobody;

impl Transport for Nobody {
    fn control(&mut self) -> Result<Box<dyn Link<u8>>, LinkError> {
        Err(LinkError::Aborted)
    }

    fn connect(&mut self, _: &str, _: usize) -> Result<Box<dyn Link<f64>>, LinkError> {
        Err(LinkError::Aborted)
    }
}

#[test]
fn a_scene_without_a_solid_runs_alone_and_writes_its_gauges_and_fields() {
    let folder = tempfile::tempdir().unwrap();
    let case = CaseFile::parse("small.toml", CASE, &[]);
    let context = Context { folder: folder.path().to_owned(), threads: 1, scene: 0 };
    let mut fluid = (PROGRAM.build)(&case, &context).unwrap();
    let ready = fluid.start(&Start::default(), &mut Nobody).unwrap();
    assert_eq!(ready.counts["water_particles"], 50);
    assert!(ready.admitted_dt > 1e-4 && ready.admitted_dt < 1e-2);
    let mut at = StepTime { step: 0, time: 0.0, dt: 1e-3 };
    for step in 1..=20 {
        at = StepTime { step, time: at.time + at.dt, dt: at.dt };
        fluid.part(Part::Advance, at).unwrap();
        let report = fluid.part(Part::Record, at).unwrap();
        assert_eq!(report.shown.unwrap().0, "front");
    }
    fluid.output(0, at).unwrap();
    let series = std::fs::read_to_string(folder.path().join("series/floor.csv")).unwrap();
    assert!(series.starts_with("time_s,fx_n,fy_n,mz_nm\n"), "{series}");
    assert_eq!(series.lines().count(), 21);
    let level = std::fs::read_to_string(folder.path().join("series/level.csv")).unwrap();
    let level: f64 = level.lines().last().unwrap().split(',').next_back().unwrap().parse().unwrap();
    assert!((level - 0.2).abs() < 0.02, "{level}");
    assert!(folder.path().join("fields/fluid_00000.vtp").exists());
    assert!(folder.path().join("fields/fluid.pvd").exists());
    let account = fluid.account();
    assert!(account.phases.iter().any(|phase| phase.name == "solve"));
    assert_eq!(account.health["escaped_particles"], 0.0);
    assert!(account.verdicts.is_empty(), "{:?}", account.verdicts);
}

/// The gauges of ten steps, each passed over this often before it stands.
fn series(passes: usize) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let context = Context { folder: folder.path().to_owned(), threads: 1, scene: 0 };
    let mut fluid = (PROGRAM.build)(&CaseFile::parse("small.toml", CASE, &[]), &context).unwrap();
    fluid.start(&Start::default(), &mut Nobody).unwrap();
    let mut at = StepTime { step: 0, time: 0.0, dt: 1e-3 };
    for step in 1..=10 {
        at = StepTime { step, time: at.time + at.dt, dt: at.dt };
        fluid.part(Part::Save, at).unwrap();
        for _ in 1..passes {
            // A pass of another length leaves no trace either.
            fluid.part(Part::Advance, StepTime { dt: 0.5e-3, ..at }).unwrap();
            fluid.part(Part::Restore, at).unwrap();
        }
        fluid.part(Part::Advance, at).unwrap();
        fluid.part(Part::Record, at).unwrap();
    }
    fluid.output(0, at).unwrap();
    let read = |name: &str| std::fs::read_to_string(folder.path().join("series").join(name)).unwrap();
    vec![read("floor.csv"), read("level.csv")]
}

#[test]
fn a_step_restored_and_passed_over_again_is_the_same_bit_for_bit() {
    assert_eq!(series(1), series(3));
}
