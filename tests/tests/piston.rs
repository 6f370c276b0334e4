//! A column of real water on a piston held by a spring, tied by the coupler's own schemes: the coupled frequency is
//! sqrt(k/(m + m_a)) with m_a = rho_f h, and what decides about stability is r = m_a/m.
//!
//! `cargo test --release -p tidewall-tests --test piston -- --nocapture` prints the table of `docs/verification.md`.

#![expect(clippy::unwrap_used, reason = "a failing helper must fail the test")]

use coupler::case::Settings;
use coupler::dummy_mesh::DummyMesh;
use coupler::guard::{LoadJump, UNSTABLE};
use coupler::mapping::Mapping;
use coupler::motion::{FluidMotion, SolidMotion};
use fluid_isph::scene::{Scene, Source, Tank, WaterBox};
use fluid_isph::snapshot::Snapshot;
use fluid_isph::{Fluid, Motion, Structure};
use protocol::case::{CaseFile, Scheme, Shared};
use protocol::interface::Surface;

const WIDTH: f64 = 0.1;
const HEIGHT: f64 = 0.1;
const THICKNESS: f64 = 0.04;
const PERIOD: f64 = 0.1;
const GRAVITY: f64 = 9.81;
const WATER: f64 = 1000.0;
/// Weight of the column, N/m.
const WEIGHT: f64 = WATER * GRAVITY * HEIGHT * WIDTH;

const CASE: &str = r#"
[case]
name = "piston"
dimension = 2
[fluid]
[[fluid.region]]
min = [0.0, 0.0]
max = [0.1, 0.1]
[solid]
min = [0.0, -0.04]
max = [0.1, 0.0]
wet = ["top"]
elements = [4, 1]
density = 1.0
[time]
end = 1.0
max_dt = 1.0
"#;

/// Generalised-alpha (Chung & Hulbert 1993) for one degree of freedom, rho_inf = 0.5, load blended.
#[derive(Clone)]
struct Piston {
    mass: f64,
    stiffness: f64,
    state: [f64; 3],
    load: f64,
}

impl Piston {
    fn advance(&mut self, load: f64, dt: f64) {
        let rho = 0.5;
        let (am, af) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
        let gamma = 0.5 - am + af;
        let beta = 0.25 * (1.0 - am + af) * (1.0 - am + af);
        let [u, v, a] = self.state;
        let free = u + dt * v + dt * dt * (0.5 - beta) * a;
        let blended = (1.0 - af) * load + af * self.load;
        let known = blended - self.mass * am * a - self.stiffness * ((1.0 - af) * free + af * u);
        let new_a = known / (self.mass * (1.0 - am) + self.stiffness * (1.0 - af) * beta * dt * dt);
        self.state = [free + beta * dt * dt * new_a, v + dt * ((1.0 - gamma) * a + gamma * new_a), new_a];
        self.load = load;
    }
}

/// The piston as a surface, the water above it, and the coupler's parts between them.
struct Rig {
    fluid: Fluid<2>,
    piston: Piston,
    /// Sag of the spring under water and piston, m; half of it hangs in it at the start.
    sag: f64,
    mapping: Mapping,
    motion: FluidMotion,
    solid: SolidMotion,
    settings: Settings,
}

impl Rig {
    fn new(options: &[&str], ratio: f64) -> Self {
        let options: Vec<String> = options.iter().map(|&option| option.to_owned()).collect();
        let case = CaseFile::parse("piston.toml", CASE, &options);
        let shared = Shared::read(&case);
        let settings = Settings::read(&case, &shared);
        assert_eq!(case.diagnostics(), []);
        let mesh = DummyMesh::span(shared.solid.as_ref().unwrap(), &settings.dummy_elements);
        let areal_mass = WATER * HEIGHT / ratio;
        let surface = Surface {
            dimension: 2,
            reference_position: mesh.reference_position().to_vec(),
            facets: mesh.facets().clone(),
            areal_mass: vec![areal_mass; mesh.node_count()],
        };
        let mapping = Mapping::new(settings.mapping, mesh.reference_position(), &surface).unwrap();
        let still = vec![0.0; 2 * mesh.node_count()];
        let unloaded = mesh.reference_position();
        let (scheme, start) = ((settings.scheme, &settings), unloaded.to_vec());
        let motion = FluidMotion::new(scheme, (false, false), unloaded, start);
        let response_mass = vec![settings.robin_factor * areal_mass; mesh.node_count()];
        let body = mesh.body_mesh(response_mass, motion.response());
        let tank =
            Tank { min: [0.0, -2.0 * THICKNESS], max: [WIDTH, 2.0 * HEIGHT], open: [[false; 2], [true; 2]] };
        let water = WaterBox { min: [0.0; 2], max: [WIDTH, HEIGHT], velocity: [0.0; 2] };
        let mut scene = Scene::new(tank, vec![water], 0.01);
        scene.source = Source::Time(0.02);
        let (mass, total) = (areal_mass * WIDTH, (areal_mass + WATER * HEIGHT) * WIDTH);
        let stiffness = total * (std::f64::consts::TAU / PERIOD).powi(2);
        let sag = -total * GRAVITY / stiffness;
        let load = -0.5 * WEIGHT - mass * GRAVITY;
        let piston = Piston { mass, stiffness, state: [0.5 * sag, 0.0, -0.5 * GRAVITY], load };
        let solid = SolidMotion { displacement: still.clone(), velocity: still.clone(), acceleration: still };
        let mut fluid = Fluid::new(scene, Some(&Structure::Mesh(body))).unwrap();
        fluid.expect_passes(settings.scheme == Scheme::Strong);
        let mut rig = Self { fluid, piston, sag, mapping, motion, solid, settings };
        rig.follow_piston();
        rig
    }

    /// The piston's motion at all its nodes, from where it hangs at the start.
    fn follow_piston(&mut self) {
        let [u, v, a] = self.piston.state;
        let columns = [
            (&mut self.solid.displacement, u - 0.5 * self.sag),
            (&mut self.solid.velocity, v),
            (&mut self.solid.acceleration, a),
        ];
        for (column, value) in columns {
            column.iter_mut().skip(1).step_by(2).for_each(|entry| *entry = value);
        }
    }

    /// Water, then piston, over one step; the load on the piston, N/m.
    fn pass(&mut self, dt: f64) -> f64 {
        let FluidMotion { position, velocity, .. } = &self.motion;
        let motion = Motion { position, velocity, acceleration: None, normal: None };
        self.fluid.advance(dt, Some(motion)).unwrap();
        let load: f64 = self.fluid.pair_force().iter().skip(1).step_by(2).sum();
        self.piston.advance(load - self.piston.mass * GRAVITY, dt);
        self.follow_piston();
        load
    }

    /// One step by the scheme of the settings.
    fn step(&mut self, dt: f64, snapshot: &mut Snapshot) -> f64 {
        let Some(mut passes) = self.settings.passes.take() else {
            self.motion.predict(dt, &self.solid, &self.mapping);
            return self.pass(dt);
        };
        passes.begin(dt, &self.solid);
        self.fluid.save(snapshot);
        let piston = self.piston.clone();
        let load = loop {
            self.motion.follow(dt, (&passes.start, &passes.guess), &self.mapping);
            let load = self.pass(dt);
            if !passes.compare(&self.solid.displacement) {
                break load;
            }
            passes.correct(&self.solid.displacement);
            self.fluid.restore(snapshot);
            self.piston = piston.clone();
        };
        passes.settle();
        self.settings.passes = Some(passes);
        load
    }
}

/// What a run shows.
#[derive(Debug)]
struct Outcome {
    /// Measured over exact period; NaN without two crossings.
    period: f64,
    /// Largest swing over the sag; 0.5 at the start.
    swing: f64,
    /// Load jump, mean and greatest over 50 steps.
    jump: (f64, f64),
    /// Passes a step; 1 without sub-iterations.
    passes: f64,
}

fn run(options: &[&str], ratio: f64, steps_a_period: f64, periods: f64) -> Outcome {
    let mut rig = Rig::new(options, ratio);
    let dt = PERIOD / steps_a_period;
    let mut jump = LoadJump::new(WEIGHT, (0.0, f64::INFINITY));
    let (mut crossings, mut swing, mut snapshot) = (Vec::new(), 0.0f64, Snapshot::default());
    for step in 0..(periods * steps_a_period) as usize {
        let before = rig.piston.state[0] - rig.sag;
        let load = rig.step(dt, &mut snapshot);
        jump.book(step as f64 * dt, [0.0, load, 0.0]);
        let after = rig.piston.state[0] - rig.sag;
        if before > 0.0 && after <= 0.0 {
            crossings.push((step as f64 + before / (before - after)) * dt);
        }
        swing = swing.max((after / rig.sag).abs());
        if jump.diverges() || swing > 10.0 {
            break;
        }
    }
    let period = match crossings[..] {
        [first, .., last] => (last - first) / (crossings.len() - 1) as f64 / PERIOD,
        _ => f64::NAN,
    };
    let passes = rig.settings.passes.iter().flat_map(|passes| passes.health()).next();
    let passes = passes.map_or(1.0, |health| health.1);
    let outcome = Outcome { period, swing, jump: (jump.mean(), jump.greatest()), passes };
    println!("{options:?} r = {ratio}, {steps_a_period} steps a period: {outcome:.4?}");
    outcome
}

fn assert_right(outcome: &Outcome) {
    assert!((outcome.period - 1.0).abs() < 0.02, "{outcome:?}");
    assert!(outcome.swing < 0.55 && outcome.jump.1 < 0.5, "{outcome:?}");
}

#[test]
fn the_robin_wall_swings_with_the_coupled_frequency() {
    let options = ["coupling.scheme=robin"];
    for ratio in [0.5, 1.4, 5.0, 50.0] {
        assert_right(&run(&options, ratio, 600.0, 3.3));
    }
    assert_right(&run(&options, 500.0, 3000.0, 2.3));
}

#[test]
fn passes_swing_with_the_coupled_frequency_in_at_most_four_a_step() {
    for acceleration in ["iqn-ils", "imvj"] {
        let option = format!("coupling.acceleration={acceleration}");
        let options = ["coupling.scheme=strong", &option];
        for ratio in [0.5, 1.4, 5.0, 50.0, 500.0] {
            let outcome = run(&options, ratio, 600.0, 2.3);
            assert_right(&outcome);
            assert!(outcome.passes <= 4.0, "{outcome:?}");
        }
    }
}

#[test]
fn staggering_is_stable_below_its_limit_and_caught_above() {
    for (order, stable, unstable) in [(0, 2.2, 3.2), (1, 1.1, 2.0), (2, 0.8, 1.0)] {
        let option = format!("coupling.prediction_order={order}");
        let options = ["coupling.scheme=css", &option];
        assert_right(&run(&options, stable, 600.0, 2.3));
        let outcome = run(&options, unstable, 600.0, 2.3);
        assert!(outcome.jump.1 > UNSTABLE || outcome.swing > 10.0, "{outcome:?}");
    }
}
