//! Both participants in one process with the test as launcher and coupler.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::path::Path;
use std::thread;
use std::time::Duration;

use protocol::case::CaseFile;
use protocol::control::{Order, Part, Reply, Start, StepTime, decode, encode};
use protocol::header::{Header, Kind};
use protocol::inprocess::Hub;
use protocol::interface::{Contract, Surface};
use protocol::link::{Expect, Link, Transport, agree};
use protocol::participant::{Context, Program, serve};
use solid_fem::{participant, rigid};

const CASE: &str = "[case]\nname = \"t\"\ndimension = 2\n[time]\nend = 0.1\nmax_dt = 1e-3\n\
    [output]\nfields_every = 0.01\n[gravity]\nacceleration = [0, -9.81]\n\
    [[gauge]]\nname = \"tip\"\nkind = \"displacement\"\npoint = [0.292, 0.08]\n\
    [[gauge]]\nname = \"foot\"\nkind = \"reaction\"\n";
const FLUID: &str = "[fluid]\ndensity = 1000\n";
const ELASTIC: &str = "[solid]\nmin = [0.292, 0]\nmax = [0.304, 0.08]\nelements = [1, 8]\nclamped = [\"bottom\"]\n\
    density = 2500\nyoung_modulus = 1e6\nwet = [\"left\", \"right\", \"top\"]\n";
const RIGID: &str = "[solid]\nmodel = \"rigid\"\nmin = [0.292, 0]\nmax = [0.304, 0.08]\nwet = [\"left\", \"right\"]\n\
    [solid.motion]\namplitude = [0.01, 0]\nfrequency = 5\n";

struct Launcher {
    control: Box<dyn Link<u8>>,
    sequence: u64,
}

impl Launcher {
    fn order(&mut self, order: &Order) {
        self.sequence += 1;
        let bytes = encode(order);
        let header = Header::new(Kind::Order, self.sequence, 0.0, 0.0);
        self.control.send(header, bytes.len(), &mut |out| out.copy_from_slice(&bytes)).unwrap();
    }

    fn answer(&mut self) -> Reply {
        let mut reply = None;
        let expect = Expect { kind: Kind::Reply, step: self.sequence, count: None };
        self.control.receive(expect, &mut |_, bytes| reply = Some(decode(bytes, "solid").unwrap())).unwrap();
        reply.unwrap()
    }
}

/// Starts a program on a thread of its own and takes its hello.
fn launch(program: Program, text: &str, folder: &Path, hub: &Hub) -> (Launcher, thread::JoinHandle<()>) {
    let (text, folder, mut transport) = (text.to_owned(), folder.to_owned(), hub.transport("solid"));
    let thread = thread::spawn(move || {
        let case = CaseFile::parse("t.toml", &text, &[]);
        let context = Context { folder, threads: 1, scene: 7 };
        let mut participant = (program.build)(&case, &context).unwrap();
        serve(program.role, &mut *participant, &mut transport).unwrap();
    });
    let mut launcher = Launcher { control: hub.control("solid"), sequence: 0 };
    assert!(matches!(launcher.answer(), Reply::Hello { process, .. } if process == "solid"));
    (launcher, thread)
}

/// The coupler's part of the handshake; returns link, surface and first motion.
fn shake(hub: &Hub, node_count: usize) -> (Box<dyn Link<f64>>, Surface, Vec<f64>) {
    let mut link = hub.transport("coupler").connect("solid", 1000).unwrap();
    agree(&mut *link, &Contract { dimension: 2, node_count, end_time: 0.1, scene: 7 }).unwrap();
    let mut surface = None;
    let expect = Expect { kind: Kind::Surface, step: 0, count: None };
    link.receive(expect, &mut |_, values| surface = Some(Surface::decode(values, "solid").unwrap())).unwrap();
    let surface = surface.unwrap();
    let motion = receive_motion(&mut *link, 0, &surface);
    (link, surface, motion)
}

fn receive_motion(link: &mut dyn Link<f64>, step: u64, surface: &Surface) -> Vec<f64> {
    let mut motion = Vec::new();
    let count = Some(6 * surface.node_count());
    link.receive(Expect { kind: Kind::Motion, step, count }, &mut |_, values| motion = values.to_vec())
        .unwrap();
    motion
}

/// A push of 1 N/m on every interface node, as nodal force.
fn push(link: &mut dyn Link<f64>, at: StepTime, surface: &Surface) {
    let forces = 2 * surface.node_count();
    let count = 1 + forces + 2 * surface.facets.markers().len();
    link.send(Header::new(Kind::Load, at.step, at.time, at.dt), count, &mut |out| {
        out.fill(0.0);
        out[1..=forces].iter_mut().step_by(2).for_each(|force| *force = 0.01);
    })
    .unwrap();
}

fn coupled(program: Program, text: &str, node_count: usize, folder: &Path) -> (Surface, Vec<Vec<f64>>) {
    let hub = Hub::new(Duration::from_secs(20));
    let (mut launcher, thread) = launch(program, text, folder, &hub);
    let nodes = Some(node_count as u64);
    launcher.order(&Order::Start(Start { surface_nodes: nodes, fluid_nodes: nodes }));
    let (mut link, surface, first) = shake(&hub, node_count);
    assert!(matches!(launcher.answer(), Reply::Ready(_)));
    let mut motions = vec![first];
    for step in 1..=20 {
        let at = StepTime { step, time: 1e-3 * step as f64, dt: 1e-3 };
        launcher.order(&Order::Step { at, parts: vec![Part::Advance, Part::Record] });
        push(&mut *link, at, &surface);
        motions.push(receive_motion(&mut *link, step, &surface));
        assert!(matches!(launcher.answer(), Reply::Done(_)));
    }
    launcher.order(&Order::Output { frame: 1, at: StepTime { step: 20, time: 0.02, dt: 1e-3 } });
    let Reply::Account(account) = launcher.answer() else { panic!("no account") };
    launcher.order(&Order::Stop);
    assert!(matches!(launcher.answer(), Reply::Account(_)));
    thread.join().unwrap();
    if program.name == "solid-fem" {
        assert!(account.phases.iter().any(|phase| phase.name == "balance_forces"));
        assert!(account.health["solid_newton_iterations"] > 0.0);
    }
    (surface, motions)
}

fn rows(folder: &Path, name: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(folder.join("series").join(format!("{name}.csv"))).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(|value| value.parse().unwrap()).collect()).collect()
}

#[test]
fn the_elastic_solid_answers_loads_with_motion() {
    let folder = tempfile::tempdir().unwrap();
    let (surface, motions) =
        coupled(participant::PROGRAM, &format!("{CASE}{FLUID}{ELASTIC}"), 18, folder.path());
    assert_eq!(surface.node_count(), 18);
    assert!((surface.areal_mass[0] - 2500.0 * 0.012 / 2.0).abs() < 1e-12);
    // It sags under its weight at the start, at rest, and bends to the right under the push.
    let block = 2 * surface.node_count();
    assert!(motions[0][..block].iter().any(|&u| u < 0.0));
    assert!(motions[0][block..].iter().all(|&value| value == 0.0));
    let tip = surface.reference_position.chunks(2).position(|x| x == [0.292, 0.08]).unwrap();
    assert!(motions[20][2 * tip] > 1e-5);
    let recorded = rows(folder.path(), "tip");
    assert_eq!(recorded.len(), 21);
    assert_eq!(recorded[20][1], motions[20][2 * tip]);
    assert_eq!(recorded[0].len(), 3);
    // The foot carries the weight per metre of depth.
    let weight = 2500.0 * 9.81 * 0.012 * 0.08;
    assert!((rows(folder.path(), "foot")[0][2] - weight).abs() < 1e-6 * weight);
    let frame = protocol::vtk::read(&folder.path().join("fields/solid_00001.vtu")).unwrap();
    assert_eq!(frame.nodes_per_cell, 4);
    assert!(folder.path().join("fields/solid.pvd").exists());
}

#[test]
fn the_rigid_stub_moves_as_told_and_sums_the_load() {
    let folder = tempfile::tempdir().unwrap();
    let (surface, motions) = coupled(rigid::PROGRAM, &format!("{CASE}{FLUID}{RIGID}"), 4, folder.path());
    assert!(surface.areal_mass.iter().all(|&mass| mass == 0.0));
    let omega = std::f64::consts::TAU * 5.0;
    let (sine, cosine) = (omega * 0.02).sin_cos();
    for node in 0..4 {
        assert_eq!(motions[20][2 * node], 0.01 * sine);
        assert_eq!(motions[20][8 + 2 * node], 0.01 * (omega * cosine));
        assert_eq!(motions[20][16 + 2 * node], 0.01 * (-omega * omega * sine));
        assert_eq!(motions[20][2 * node + 1], 0.0);
    }
    // Four nodes of 0.01 N/m; the support holds against them, with the arm of half the height.
    let foot = rows(folder.path(), "foot");
    assert!((foot[20][1] + 0.04).abs() < 1e-15);
    assert!((foot[20][3] - 0.04 * 0.04).abs() < 1e-15);
    assert_eq!(rows(folder.path(), "tip")[20][1], 0.01 * sine);
}

#[test]
fn a_solid_alone_needs_no_coupler() {
    let folder = tempfile::tempdir().unwrap();
    let hub = Hub::new(Duration::from_secs(20));
    let load = "[[solid.load]]\nface = \"left\"\npressure = 10\ntable = [[0, 0], [0.01, 1]]\n";
    let text = format!("{CASE}{ELASTIC}analysis = \"static\"\nweight = false\n{load}");
    let (mut launcher, thread) = launch(participant::PROGRAM, &text, folder.path(), &hub);
    launcher.order(&Order::Start(Start::default()));
    assert!(matches!(launcher.answer(), Reply::Ready(_)));
    for step in 1..=10 {
        let at = StepTime { step, time: 1e-3 * step as f64, dt: 1e-3 };
        launcher.order(&Order::Step { at, parts: vec![Part::Advance, Part::Record] });
        assert!(matches!(launcher.answer(), Reply::Done(done) if done.substeps == 1));
    }
    launcher.order(&Order::Stop);
    assert!(matches!(launcher.answer(), Reply::Account(_)));
    thread.join().unwrap();
    // Half the load at half the time: small deflections are linear. 3.6197e-4 m at 10 Pa.
    let tip = rows(folder.path(), "tip");
    assert!((tip[10][1] - 3.6197e-4).abs() < 0.01 * 3.6197e-4, "{}", tip[10][1]);
    assert!((tip[5][1] - 0.5 * tip[10][1]).abs() < 1e-3 * tip[10][1]);
}
