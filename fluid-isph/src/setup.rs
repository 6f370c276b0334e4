//! How a fluid is made from its scene: particles, grid, and the terms the scene asks for.

use protocol::case::Prescribed;
use protocol::phases::PhaseClock;

use crate::assembly::WallMoments;
use crate::body::{Body, Structure};
use crate::body_layout::LayoutRules;
use crate::cells::Grid;
use crate::correction::Guard;
use crate::error::SetupError;
use crate::fluid::{Energy, Fluid, PressureLevel, RUNAWAY};
use crate::health::Health;
use crate::kernel::Kernel;
use crate::lattice::Lattice;
use crate::markers::Markers;
use crate::neighbours::Neighbours;
use crate::obstacle::Obstacles;
use crate::parallel::chunk_count;
use crate::particles::Water;
use crate::periodic::Periodic;
use crate::pressure::conjugate_gradient::ConjugateGradient;
use crate::pressure::matrix::PressureMatrix;
use crate::pressure::preconditioner::Preconditioner;
use crate::scene::Scene;
use crate::shifting::Shifting;
use crate::time_step::largest_speed;
use crate::turbulence::Smagorinsky;
use crate::vector::{Vector, dot};
use crate::viscosity::Viscosity;
use crate::wall_pressure::WallSearch;
use crate::walls::Walls;

/// Share of a closed tank's volume above which the water is taken to fill it: there is no free surface then.
const FULL_TANK: f64 = 0.98;

impl<const D: usize> Fluid<D> {
    /// Makes the fluid of a scene, with its side of a structure, where there is one.
    ///
    /// # Errors
    /// [`SetupError`]: the lattice does not fit, the body is too thin, the water lies inside it.
    pub fn new(scene: Scene<D>, structure: Option<&Structure<D>>) -> Result<Self, SetupError> {
        let lattice = Lattice::new(&scene)?;
        let spacing = lattice.spacing;
        let kernel = Kernel::new(scene.kernel, spacing);
        let grid = grid_around(&scene, &kernel);
        let make_body =
            |of: &Structure<D>| Body::new(of, LayoutRules::new(&scene, &kernel), scene.reference_density);
        let body = structure.map(make_body).transpose()?;
        let markers = structure.map(Markers::new);
        let obstacles = Obstacles::new(&scene.obstacles, spacing);
        let lens = (obstacles.as_ref().map_or(0, Obstacles::len), body.as_ref().map_or(0, Body::len));
        let mut walls = Walls::new(&grid, (&scene.tank, &lattice.wall), lens);
        if scene.symmetry != [[false; 2]; D] {
            walls.smooth(&scene.tank, &scene.symmetry);
        }
        if let Some(obstacles) = &obstacles {
            obstacles.enter(&mut walls);
            obstacles.place(&mut walls, 0.0, 0.0);
            walls.sort_obstacles(&grid, spacing);
        }
        let periodic = Periodic::new(scene.periodic, &scene.tank, &walls, &kernel);
        let (mut position, mut velocity) = (lattice.water, lattice.velocity);
        if let Some(body) = &body {
            let first = walls.body().start;
            walls.weight[first..].copy_from_slice(&body.weight);
            body.place(&mut walls);
            walls.sort_body(&grid, spacing);
            carve((&grid, &walls), spacing, &mut position, &mut velocity)?;
        }
        let tank_volume: f64 = (0..D).map(|k| scene.tank.max[k] - scene.tank.min[k]).product();
        let closed = scene.openings.is_empty() && scene.tank.open.iter().flatten().all(|&open| !open);
        let body_volume: f64 = body.iter().flat_map(|body| &body.weight).map(|&w| f64::from(w)).sum();
        let solid: f64 = scene.obstacles.iter().map(|obstacle| obstacle.outline.volume()).sum();
        let filled = (position.len() as f64 + body_volume) * kernel.volume + solid;
        let mut fluid = Self {
            spacing,
            viscosity: (scene.kinematic_viscosity.is_some() || scene.smagorinsky.is_some()).then(|| {
                Viscosity {
                    kinematic_viscosity: scene.kinematic_viscosity.unwrap_or(0.0),
                    friction: scene.friction,
                    acceleration: Vec::new(),
                }
            }),
            turbulence: scene.smagorinsky.map(|constant| Smagorinsky {
                mixing_length_squared: (constant * spacing).powi(2),
                eddy_viscosity: Vec::new(),
            }),
            preconditioner: Preconditioner::new(scene.solver),
            shifting: scene.shifting.map(|factor| Shifting { factor, sums: Vec::new() }),
            pressure_level: if closed && filled > FULL_TANK * tank_volume {
                PressureLevel::Shifted
            } else if scene.suction {
                PressureLevel::Free
            } else {
                PressureLevel::Clamped
            },
            marker_pressure: vec![0.0; markers.as_ref().map_or(0, |markers| markers.pressure.len())],
            pair_force: vec![0.0; body.as_ref().map_or(0, |body| body.nodes.len() * D)],
            markers,
            water: Water::new(position, velocity),
            scene,
            kernel,
            grid,
            walls,
            obstacles,
            periodic,
            body,
            health: Health::default(),
            matrix: PressureMatrix::default(),
            moments: WallMoments::default(),
            source: Vec::new(),
            explicit: None,
            solver: ConjugateGradient::default(),
            wall_search: WallSearch::default(),
            guard: Guard::default(),
            clock: PhaseClock::default(),
            start_velocity: Vec::new(),
            partial: Vec::new(),
            has_passes: false,
            step_number: 0,
            time: 0.0,
            last_substep: 0.0,
            speed: 0.0,
            speed_limit: f64::INFINITY,
            energy: Energy::default(),
            surface: 0.0,
            last_substeps: 0,
            iterations: 0,
            clamped: 0,
            solved: 0,
        };
        fluid.start()?;
        Ok(fluid)
    }

    /// Speeds and energy of the start.
    fn start(&mut self) -> Result<(), SetupError> {
        self.water.sort(&self.grid);
        self.speed = largest_speed(&self.water.velocity).0;
        let g = self.largest_gravity();
        let fall = self.largest_fall();
        self.surface = fall + 0.5 * self.spacing;
        if let Some(numbers) = self.scene.explicit {
            self.explicit = Some(self.start_explicitly(numbers).map_err(SetupError::StartPressure)?);
        }
        let moving = self.obstacles.as_ref().map_or(0.0, Obstacles::largest_speed);
        let shaken = self.scene.gravity.frame.as_ref().map_or(0.0, Prescribed::largest_speed);
        self.speed_limit = match (2.0 * g * fall).sqrt().max(self.speed).max(moving).max(shaken) {
            largest if largest > 0.0 => RUNAWAY * largest,
            _ => f64::INFINITY,
        };
        self.partial.resize(chunk_count(self.water.len()), [0.0; 3]);
        (self.energy.kinetic, self.energy.potential) = self.measure_energy();
        self.energy.start = self.energy.kinetic + self.energy.potential;
        let mass = self.particle_mass() * self.water.len() as f64;
        self.energy.reference = self.energy.kinetic + mass * g * self.mean_height();
        Ok(())
    }

    fn largest_fall(&self) -> f64 {
        let (down, floor) = self.floor_along_gravity();
        self.water.position.iter().map(|x| floor - dot(x, &down)).fold(0.0, f64::max)
    }

    fn mean_height(&self) -> f64 {
        let (down, floor) = self.floor_along_gravity();
        let sum: f64 = self.water.position.iter().map(|x| floor - dot(x, &down)).sum();
        sum / self.water.len().max(1) as f64
    }
}

/// The grid covers the tank, its walls, and half the tank's size beyond open faces.
fn grid_around<const D: usize>(scene: &Scene<D>, kernel: &Kernel<D>) -> Grid<D> {
    let (tank, edge) = (&scene.tank, kernel.support_radius);
    let beyond = |k: usize, side: usize| {
        if tank.open[k][side] { 0.5 * (tank.max[k] - tank.min[k]) } else { 0.0 }
    };
    let lower = std::array::from_fn(|k| tank.min[k] - beyond(k, 0) - 2.0 * edge);
    let upper = std::array::from_fn(|k| tank.max[k] + beyond(k, 1) + 2.0 * edge);
    Grid::new(&lower, &upper, edge)
}

/// Removes the water the body stands in: closer than 0.7 spacings to one of its particles.
fn carve<const D: usize>(
    (grid, walls): (&Grid<D>, &Walls<D>),
    spacing: f64,
    position: &mut Vec<Vector<D>>,
    velocity: &mut Vec<Vector<D>>,
) -> Result<(), SetupError> {
    let mut near = Neighbours::default();
    let mut is_free = |x: &Vector<D>| {
        let Some(cell) = grid.inner_cell(x) else { return true };
        let Some(set) = walls.sets_near(grid, cell)[2] else { return true };
        near.find_around((grid, set.cells), (cell, x), ((0.7 * spacing).powi(2), 1.0));
        near.is_empty()
    };
    let free: Vec<bool> = position.iter().map(&mut is_free).collect();
    let count = position.len();
    let mut kept = free.iter();
    position.retain(|_| *kept.next().expect("one flag per particle"));
    let mut kept = free.iter();
    velocity.retain(|_| *kept.next().expect("one flag per particle"));
    if position.is_empty() && count > 0 { Err(SetupError::WaterInsideBody { count }) } else { Ok(()) }
}
