//! The fluid's own points over the link: what is planned is what is offered, and the coupler's side gets the same force as
//! with a dummy mesh.

#![expect(clippy::unwrap_used, reason = "a failing helper must fail the test")]

mod common;

use std::time::Duration;

use common::upright_plate;
use fluid_isph::participant::PROGRAM;
use protocol::case::CaseFile;
use protocol::control::{Part, Start, StepTime};
use protocol::header::{Header, Kind};
use protocol::inprocess::Hub;
use protocol::interface::{Contract, PointWall, Points, Response};
use protocol::link::{Expect, Link, Transport, agree};
use protocol::participant::Context;

const CASE: &str = r#"
[case]
name = "basin"
dimension = 2
[domain]
min = [0.0, 0.0]
max = [0.5, 0.4]
open = ["top"]
[gravity]
acceleration = [0.0, -9.81]
[fluid]
spacing = 0.025
[[fluid.region]]
min = [0.0, 0.0]
max = [0.25, 0.25]
[solid]
model = "rigid"
min = [0.25, 0.0]
max = [0.3, 0.3]
[time]
end = 0.05
max_dt = 0.0005
"#;

const STEPS: u64 = 100;

/// The case with its water's side of the interface.
fn case(side: &str) -> CaseFile {
    CaseFile::parse("basin.toml", &format!("{CASE}[coupling]\nfluid_side = \"{side}\"\n"), &[])
}

/// Starts the fluid on a thread of its own; it takes the steps the coupler's side sends motion for.
fn run_fluid(hub: &Hub, side: &'static str, nodes: usize) -> std::thread::JoinHandle<()> {
    let mut transport = hub.transport("fluid");
    std::thread::spawn(move || {
        let folder = tempfile::tempdir().unwrap();
        let context = Context { folder: folder.path().to_owned(), threads: 1, scene: 7 };
        let mut fluid = (PROGRAM.build)(&case(side), &context).unwrap();
        let start = Start { surface_nodes: None, fluid_nodes: Some(nodes as u64) };
        fluid.start(&start, &mut transport).unwrap();
        for step in 1..=STEPS {
            fluid.part(Part::Advance, moment(step)).unwrap();
        }
    })
}

fn moment(step: u64) -> StepTime {
    StepTime { step, time: 5e-4 * step as f64, dt: 5e-4 }
}

fn shake(hub: &Hub, node_count: usize) -> Box<dyn Link<f64>> {
    let mut link = hub.transport("coupler").connect("fluid", 4000).unwrap();
    agree(&mut *link, &Contract { dimension: 2, node_count, end_time: 0.05, scene: 7 }).unwrap();
    link
}

fn send(link: &mut dyn Link<f64>, header: Header, values: &[f64]) {
    link.send(header, values.len(), &mut |out| out.copy_from_slice(values)).unwrap();
}

/// The loads of all steps of a wall that is sent the same motion again and again.
fn loads(link: &mut dyn Link<f64>, motion: &[f64], load_len: usize) -> Vec<Vec<f64>> {
    let mut loads = Vec::new();
    for step in 1..=STEPS {
        let at = moment(step);
        send(link, Header::new(Kind::Motion, at.step, at.time, at.dt), motion);
        let expect = Expect { kind: Kind::Load, step, count: Some(load_len) };
        link.receive(expect, &mut |_, values| loads.push(values.to_vec())).unwrap();
    }
    loads
}

/// The points offered, and the loads on a wall at rest.
fn at_points(response: Response, mass: f64) -> (Points, Vec<Vec<f64>>) {
    let planned = (PROGRAM.check)(&case("points")).figure("interface_points").unwrap() as usize;
    let hub = Hub::new(Duration::from_secs(20));
    let thread = run_fluid(&hub, "points", planned);
    let mut link = shake(&hub, planned);
    let mut points = Points::default();
    let expect = Expect { kind: Kind::Points, step: 0, count: None };
    link.receive(expect, &mut |_, values| points = Points::decode(values, "fluid").unwrap()).unwrap();
    assert_eq!(points.len(), planned);
    let wall = PointWall { response, response_mass: vec![mass; points.len()] };
    send(&mut *link, Header::new(Kind::PointWall, 0, 0.0, 0.0), &wall.encode());
    let mut motion = vec![1.0; usize::from(response == Response::Robin)];
    motion.extend(&points.reference_position);
    motion.resize(wall.motion_len(2) - 2 * points.len(), 0.0);
    let normals = |x: &[f64]| [if x[0] < 0.275 { -1.0 } else { 1.0 }, 0.0];
    motion.extend(points.reference_position.chunks_exact(2).flat_map(normals));
    let loads = loads(&mut *link, &motion, points.load_len());
    thread.join().unwrap();
    (points, loads)
}

fn in_mesh(response: Response, mass: f64) -> (usize, Vec<Vec<f64>>) {
    let mut mesh = upright_plate((0.25, 0.05, 0.3), 1, response);
    mesh.response_mass.fill(mass);
    let hub = Hub::new(Duration::from_secs(20));
    let thread = run_fluid(&hub, "dummy_mesh", mesh.node_count());
    let mut link = shake(&hub, mesh.node_count());
    send(&mut *link, Header::new(Kind::BodyMesh, 0, 0.0, 0.0), &mesh.encode());
    let mut motion = vec![1.0; usize::from(response == Response::Robin)];
    motion.extend(&mesh.reference_position);
    motion.resize(mesh.motion_len(), 0.0);
    let markers = mesh.facets.markers().len();
    let loads = loads(&mut *link, &motion, markers + mesh.reference_position.len());
    thread.join().unwrap();
    (markers, loads)
}

/// Force of a load behind its marker pressures, N/m.
fn force(load: &[f64], markers: usize) -> [f64; 2] {
    [0, 1].map(|k| load[markers..].iter().skip(k).step_by(2).sum())
}

#[test]
fn the_force_over_the_link_is_that_of_a_dummy_mesh() {
    for response in [Response::Robin, Response::Given, Response::Prescribed] {
        let (points, found) = at_points(response, 20.0);
        let (markers, expected) = in_mesh(response, 20.0);
        for (found, expected) in found.iter().zip(&expected) {
            let (found, expected) = (force(found, points.markers().len()), force(expected, markers));
            for k in 0..2 {
                let error = (found[k] - expected[k]).abs() / expected[0].abs();
                assert!(error < 1e-10, "{response:?}: {found:?} {expected:?}");
            }
        }
        let load = found.last().unwrap();
        let total: f64 = points.area.iter().sum();
        assert!((total - (0.3 + 0.3 + 0.05)).abs() < 1e-12);
        // The markers' own resultant on the wet face is rho g H^2/2, of water ten rows deep that is not quite at rest.
        let pressed: f64 = points.markers().iter().zip(load).map(|(&k, p)| p * points.area[k]).sum();
        assert!((pressed / (0.5 * 9810.0 * 0.25 * 0.25) - 1.0).abs() < 0.06, "{response:?}: {pressed} N/m");
    }
}
