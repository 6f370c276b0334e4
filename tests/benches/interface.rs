//! What the coupler and its channels cost a step: the coupler's program between a fluid and a solid that answer at once, and
//! between two that compute for a while, as they do in a run: what the coupler does meanwhile keeps nobody waiting.
//!
//!     cargo bench -p tidewall-tests --bench interface
//!
//! Wall time of a whole step (orders, four data messages, the coupler's phases) less the computing of fluid and solid, and the
//! coupler's own CPU time, for a plate in space with matching meshes of 4,500 and 100,000 interface nodes, and with two points of
//! the fluid for every facet of the structure, one on it with an area and one inside the wall, between its faces.

use std::path::Path;
use std::time::{Duration, Instant};

use coupler::dummy_mesh::DummyMesh;
use launcher::processes::{Call, Crew, Launch, ProcessSpec, Processes};
use launcher::step::{Cast, order, settle};
use protocol::case::{CaseFile, Scheme, Shared};
use protocol::control::{Account, Order, Reply, Start, StepTime};
use protocol::failure::Failure;
use protocol::header::{Header, Kind};
use protocol::interface::{Contract, Points, Surface};
use protocol::ipc::IpcTransport;
use protocol::link::{Expect, Item, LinkError, Transport, agree};
use protocol::names::{RunId, RunNames};
use protocol::phases::PhaseTime;
use tidewall_tests::programs;

const TIMEOUT: Duration = Duration::from_secs(60);
const STEPS: u64 = 300;
const DT: f64 = 1e-4;
/// How long before its load the fluid knocks.
const BEFORE: Duration = Duration::from_micros(500);
/// What fluid and solid compute in a step, one after the other on one thread each.
const COMPUTING: [Duration; 2] = [Duration::ZERO, Duration::from_millis(20)];

fn main() {
    println!(
        "fluid's side, its nodes, threads, computing ms, wall ms a step less computing: median (least), coupler's CPU ms a step"
    );
    println!("  the coupler's phases, ms a step");
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let scenes = [([1, 44, 49], 1), ([1, 199, 249], 1), ([1, 199, 249], cores)];
    let sides = ["dummy_mesh", "points"].into_iter();
    let scenes = sides.flat_map(|side| scenes.map(|(cells, threads)| (side, cells, threads)));
    for ((side, cells, threads), computing) in scenes.flat_map(|scene| COMPUTING.map(|time| (scene, time))) {
        let folder = tempfile::tempdir().expect("there is room for a case");
        let bench = Bench::new((side, cells), (threads, computing), folder.path());
        let Measured { mut walls, cpu, phases } = bench.run().expect("the run goes through");
        walls.sort_by(f64::total_cmp);
        let (median, least) = (1e3 * walls[walls.len() / 2], 1e3 * walls[0]);
        let nodes = bench.fluid_nodes();
        let computing = 1e3 * computing.as_secs_f64();
        println!("{side}, {nodes}, {threads}, {computing}, {median:.3} ({least:.3}), {:.3}", 1e3 * cpu);
        println!("  {}", phases.join(", "));
    }
}

/// What the steps took.
struct Measured {
    /// Wall time of each less the computing of fluid and solid, s.
    walls: Vec<f64>,
    /// The coupler's CPU time a step, s.
    cpu: f64,
    /// Name and wall time a step, ms.
    phases: Vec<String>,
}

struct Bench<'f> {
    folder: &'f Path,
    threads: usize,
    computing: Duration,
    names: RunNames,
    surface: Surface,
    /// In place of the dummy mesh.
    points: Option<Points>,
    contract: Contract,
}

/// The middle of every facet with its area, and the place 5 mm below it in the wall.
fn points_on(surface: &Surface) -> Points {
    let mut points = Points { dimension: 3, ..Points::default() };
    for facet in 0..surface.facets.len() {
        let corner = |&node: &usize| &surface.reference_position[3 * node..3 * node + 3];
        let corners: Vec<_> = surface.facets.facet(facet).iter().map(corner).collect();
        let centre = [0, 1, 2].map(|axis| corners.iter().map(|x| 0.25 * x[axis]).sum::<f64>());
        let inwards = if centre[0] > 1.05 { -0.005 } else { 0.005 };
        points.reference_position.extend(centre);
        points.reference_position.extend([centre[0] + inwards, centre[1], centre[2]]);
        points.area.extend([2.0 / surface.facets.len() as f64, 0.0]);
    }
    points
}

impl<'f> Bench<'f> {
    fn new(
        (side, cells): (&str, [usize; 3]),
        (threads, computing): (usize, Duration),
        folder: &'f Path,
    ) -> Self {
        let text = format!(
            "[case]\nname = \"interface\"\ndimension = 3\n[domain]\nmin = [0, 0, 0]\nmax = [2, 1, 1]\n\
             [gravity]\nacceleration = [0, -9.81, 0]\n[fluid]\nspacing = 0.05\n[[fluid.region]]\nmin = [0, 0, 0]\n\
             max = [0.5, 1, 1]\n[solid]\nmin = [1, 0, 0]\nmax = [1.1, 1, 1]\nelements = {cells:?}\n\
             wet = [\"left\", \"right\"]\ndensity = 2500\n[coupling]\nfluid_side = {side:?}\n[time]\nend = 1\nmax_dt = {DT}\n"
        );
        let lock = folder.join("case.lock.toml");
        std::fs::write(&lock, &text).expect("the folder can be written");
        let shared = Shared::read(&CaseFile::parse(&lock, &text, &[]));
        let mesh = DummyMesh::span(shared.solid.as_ref().expect("the case has one"), &cells);
        let surface = Surface {
            dimension: 3,
            reference_position: mesh.reference_position().to_vec(),
            facets: mesh.facets().clone(),
            areal_mass: vec![125.0; mesh.node_count()],
        };
        let points = (side == "points").then(|| points_on(&surface));
        let contract = Contract {
            dimension: 3,
            node_count: mesh.node_count(),
            end_time: shared.time.end,
            scene: u8::checksum(text.as_bytes()),
        };
        let names = RunNames::of(RunId::random().expect("the system has random numbers"));
        Self { folder, threads, computing, names, surface, points, contract }
    }

    fn fluid_nodes(&self) -> usize {
        self.points.as_ref().map_or(self.contract.node_count, Points::len)
    }

    fn run(&self) -> Result<Measured, Failure> {
        let argument = |path: &Path| path.as_os_str().to_owned();
        let spec = ProcessSpec {
            name: "coupler".to_owned(),
            program: programs::program("coupler"),
            arguments: vec![
                "--run".into(),
                argument(&self.folder.join("case.lock.toml")),
                "--folder".into(),
                argument(self.folder),
                "--threads".into(),
                self.threads.to_string().into(),
            ],
            environment: Vec::new(),
        };
        let log = self.folder.join("log");
        std::fs::create_dir_all(&log).expect("the folder can be written");
        let processes =
            Processes::start(Launch { names: &self.names, log: &log, timeout: TIMEOUT }, &[spec])?;
        std::thread::scope(|scope| {
            let ends = [scope.spawn(|| self.solid()), scope.spawn(|| self.fluid())];
            let result = self.conduct(CouplerOnly(processes));
            for end in ends {
                let end = end.join().expect("an end reports its errors");
                end.map_err(|error| error.into_failure("bench", 0, 0.0, "exchange"))?;
            }
            result
        })
    }

    fn conduct(&self, mut crew: CouplerOnly) -> Result<Measured, Failure> {
        let start = Start {
            surface_nodes: Some(self.contract.node_count as u64),
            fluid_nodes: Some(self.fluid_nodes() as u64),
        };
        crew.0.ask("coupler", &Order::Start(start))?;
        let before = crew.account()?.cpu_s;
        let mut walls = Vec::new();
        for number in 1..=STEPS {
            let start = Instant::now();
            let step = order(&mut crew, Cast::Coupled(Scheme::Robin), at(number))?;
            settle(&mut crew, step, None)?;
            walls.push((start.elapsed() - 2 * self.computing).as_secs_f64());
        }
        let account = crew.account()?;
        let cpu = (account.cpu_s - before) / STEPS as f64;
        let own = account.phases.iter().filter(|phase| phase.name != "wait");
        let a_step = |phase: &PhaseTime| format!("{} {:.3}", phase.name, 1e3 * phase.wall_s / STEPS as f64);
        let phases = own.map(a_step).collect();
        crew.0.ask("coupler", &Order::Stop)?;
        crew.0.finish()?;
        Ok(Measured { walls, cpu, phases })
    }

    /// Keeps a core busy to the end of the computing but `rest`.
    fn compute(&self, since: Instant, rest: Duration) {
        while since.elapsed() + rest < self.computing {
            std::hint::spin_loop();
        }
    }

    fn solid(&self) -> Result<(), LinkError> {
        let mesh = self.surface.encode();
        let block = self.surface.reference_position.len();
        let load_len = 1 + block + 3 * self.surface.facets.markers().len();
        let capacity = mesh.len().max(3 * block);
        let mut link = IpcTransport::new(&self.names, "solid", TIMEOUT)?.connect("coupler", capacity)?;
        agree(&mut *link, &self.contract)?;
        link.send(Header::new(Kind::Surface, 0, 0.0, 0.0), mesh.len(), &mut |out| {
            out.copy_from_slice(&mesh)
        })?;
        for step in 0..=STEPS {
            if step > 0 {
                let expect = Expect { kind: Kind::Load, step, count: Some(load_len) };
                link.receive(expect, &mut |_, _| ())?;
                self.compute(Instant::now(), Duration::ZERO);
            }
            link.send(Header::new(Kind::Motion, step, at(step).time, DT), 3 * block, &mut |out| {
                out.fill(1e-6 * step as f64);
            })?;
        }
        Ok(())
    }

    fn fluid(&self) -> Result<(), LinkError> {
        let (nodes, markers) = (self.surface.reference_position.len(), self.surface.facets.markers().len());
        let load_len = self.points.as_ref().map_or(markers + nodes, Points::load_len);
        let mut transport = IpcTransport::new(&self.names, "fluid", TIMEOUT)?;
        let mut link = transport.connect("coupler", load_len.max(2 + 4 * self.fluid_nodes()))?;
        let knocks: Vec<_> =
            ["coupler", "solid"].into_iter().filter_map(|role| transport.knock(role)).collect();
        agree(&mut *link, &Contract { node_count: self.fluid_nodes(), ..self.contract })?;
        let first_word = match &self.points {
            Some(points) => {
                let values = points.encode();
                let header = Header::new(Kind::Points, 0, 0.0, 0.0);
                link.send(header, values.len(), &mut |out| out.copy_from_slice(&values))?;
                Kind::PointWall
            }
            None => Kind::BodyMesh,
        };
        link.receive(Expect { kind: first_word, step: 0, count: None }, &mut |_, _| ())?;
        for step in 1..=STEPS {
            link.receive(Expect { kind: Kind::Motion, step, count: None }, &mut |_, _| ())?;
            let since = Instant::now();
            self.compute(since, BEFORE);
            if self.computing > BEFORE {
                knocks.iter().for_each(|knock| knock());
            }
            self.compute(since, Duration::ZERO);
            link.send(Header::new(Kind::Load, step, at(step).time, DT), load_len, &mut |out| {
                out.fill(1.0 + 1e-3 * step as f64);
            })?;
        }
        Ok(())
    }
}

fn at(step: u64) -> StepTime {
    StepTime { step, time: DT * step as f64, dt: DT }
}

/// Of a crew only the coupler is a process; the others hear no orders and answer the data.
struct CouplerOnly(Processes);

impl CouplerOnly {
    fn account(&mut self) -> Result<Account, Failure> {
        match self.0.ask("coupler", &Order::Output { frame: 0, at: at(0) })? {
            Reply::Account(account) => Ok(account),
            other => panic!("an output is answered by an account, not {other:?}"),
        }
    }
}

impl Crew for CouplerOnly {
    fn order(&mut self, process: &str, order: &Order, call: Call) -> Result<(), Failure> {
        if process == "coupler" { self.0.order(process, order, call) } else { Ok(()) }
    }

    fn answer(&mut self, process: &str) -> Result<Reply, Failure> {
        self.0.answer(process)
    }

    fn answers(&mut self) -> Result<Vec<(String, Reply)>, Failure> {
        self.0.answers()
    }
}
