//! The scene as resolved: every choice made, every default filled in. Optional physics is an `Option`.

use protocol::case::{Prescribed, interpolate};

use crate::air::DEEP;
use crate::flow::Flow;
use crate::kernel_shape::KernelShape;
use crate::obstacle::Obstacle;
use crate::vector::Vector;
use crate::weakly_compressible::Explicit;

/// An axis-aligned tank; faces that are not open carry wall particles.
#[derive(Debug, Clone, PartialEq)]
pub struct Tank<const D: usize> {
    /// Lower corner of the wall planes, m.
    pub min: Vector<D>,
    /// Upper corner of the wall planes, m.
    pub max: Vector<D>,
    /// Faces without a wall, `[axis][0 lower, 1 upper]`.
    pub open: [[bool; 2]; D],
}

/// A face of the tank: axis, and whether it is the upper one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Face {
    /// 0 x, 1 y, 2 z.
    pub axis: usize,
    /// Upper (+) instead of lower (-) face.
    pub upper: bool,
}

/// A hole in a face of the tank.
#[derive(Debug, Clone, PartialEq)]
pub struct Opening<const D: usize> {
    /// The face.
    pub face: Face,
    /// Lower corner, m; the extent across the face does not matter.
    pub min: Vector<D>,
    /// Upper corner, m.
    pub max: Vector<D>,
}

impl<const D: usize> Opening<D> {
    /// Whether a point beyond the face stands in the hole.
    pub fn holds(&self, x: &Vector<D>, tank: &Tank<D>) -> bool {
        let Face { axis, upper } = self.face;
        let beyond = if upper { x[axis] > tank.max[axis] } else { x[axis] < tank.min[axis] };
        beyond && (0..D).all(|k| k == axis || self.min[k] < x[k] && x[k] < self.max[k])
    }
}

/// A box full of water at the start.
#[derive(Debug, Clone, PartialEq)]
pub struct WaterBox<const D: usize> {
    /// Lower corner, m.
    pub min: Vector<D>,
    /// Upper corner, m.
    pub max: Vector<D>,
    /// Velocity at the start, m/s.
    pub velocity: Vector<D>,
}

/// Body force per mass, constant or with a table of factors over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Gravity<const D: usize> {
    /// g, m/s2.
    pub vector: Vector<D>,
    /// Rows (time s, factor), times rising; linear in between, constant outside. `None`: factor 1.
    pub factor: Option<Vec<(f64, f64)>>,
    /// Motion of the tank, in whose frame everything is computed: its acceleration acts the other way round.
    pub frame: Option<Prescribed>,
}

impl<const D: usize> Gravity<D> {
    /// Body force per mass at a time, m/s2: g less the acceleration of the tank.
    pub fn at(&self, time: f64) -> Vector<D> {
        let factor = self.factor.as_deref().map_or(1.0, |table| interpolate(table, time));
        let mut force = self.vector.map(|component| component * factor);
        if let Some(frame) = &self.frame {
            for (k, component) in force.iter_mut().enumerate() {
                *component -= frame.at(k, time)[2];
            }
        }
        force
    }
}

/// Source term of the pressure equation; all are (9) with some alpha.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    /// (6), divergence alone: alpha = 0.
    DivergenceFree,
    /// (8): rho* at the intermediate step, linearised as rho_n (1 - dt div v*), which is (9) with alpha = 1.
    DensityInvariance,
    /// (9) with the paper's alpha, which acts over dt/alpha seconds.
    Alpha(f64),
    /// (9) with alpha = dt/time: results that do not depend on dt, s.
    Time(f64),
}

impl Source {
    /// alpha of (9) for a step of `dt` s, -.
    pub fn alpha(self, dt: f64) -> f64 {
        match self {
            Self::DivergenceFree => 0.0,
            Self::DensityInvariance => 1.0,
            Self::Alpha(alpha) => alpha,
            Self::Time(time) => (dt / time).min(1.0),
        }
    }
}

/// How conjugate gradients are preconditioned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PressureSolver {
    /// Multigrid over the cells.
    Multigrid,
    /// Incomplete Cholesky factors: the paper's ICCG.
    IncompleteCholesky,
}

/// How the pressure at a wall particle is found from the water's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WallPressure {
    /// Hydrostatically shifted Shepard mean, one value per wall particle and side.
    Shepard,
    /// The water particle's own pressure, shifted, pair by pair: cheaper and noisier.
    PerPair,
}

/// What happens tangentially at walls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WallFriction {
    /// No viscosity with walls.
    Slip,
    /// Wall particles take part in the viscous term with the wall's velocity.
    NoSlip,
}

/// Everything the fluid needs to know; lengths before the lattice adjusts them.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene<const D: usize> {
    /// The tank.
    pub tank: Tank<D>,
    /// Body force.
    pub gravity: Gravity<D>,
    /// rho0, kg/m3.
    pub reference_density: f64,
    /// nu, m2/s; `None` leaves the viscous term out.
    pub kinematic_viscosity: Option<f64>,
    /// Smagorinsky constant C_s; `None` leaves turbulence out.
    pub smagorinsky: Option<f64>,
    /// Friction at walls; matters only with viscosity or turbulence.
    pub friction: WallFriction,
    /// Spacing asked for, m; adjusted by at most 2 %.
    pub particle_spacing: f64,
    /// How far above the outermost particles the air begins, in spacings; missing neighbours count one over it times.
    pub air_distance: f64,
    /// Shape of the smoothing kernel.
    pub kernel: KernelShape,
    /// Source of the pressure equation.
    pub source: Source,
    /// Water at the start.
    pub water: Vec<WaterBox<D>>,
    /// Largest max |v| dt/spacing.
    pub courant: f64,
    /// Relative residual at which the pressure solve ends.
    pub pressure_tolerance: f64,
    /// The same in coupling steps with several passes.
    pub pass_tolerance: f64,
    /// Preconditioner of the pressure solve.
    pub solver: PressureSolver,
    /// The weakly compressible scheme in place of the projection; `None`: projection.
    pub explicit: Option<Explicit>,
    /// Pressure at wall particles.
    pub wall_pressure: WallPressure,
    /// Largest number of sub-steps in one coupling step.
    pub max_substeps: u32,
    /// Sides of the body (lower, upper across the wall) water may touch; `None`: those with facets. A body wet on one
    /// side is continued behind the other to the kernel's support.
    pub body_wet: Option<[bool; 2]>,
    /// Random displacement of the initial lattice, in spacings; `None`: none.
    pub jitter: Option<f64>,
    /// Velocity field of the start, added to the velocities of the boxes; `None`: none.
    pub flow: Option<Flow<D>>,
    /// Obstacles, fixed or with a motion of their own.
    pub obstacles: Vec<Obstacle<D>>,
    /// Whether water written over an obstacle is left out; otherwise that is a mistake.
    pub carve: bool,
    /// Holes in the walls of the tank.
    pub openings: Vec<Opening<D>>,
    /// Axes along which the scene repeats itself.
    pub periodic: [bool; D],
    /// Faces that are planes of symmetry, `[axis][0 lower, 1 upper]`: walls without friction.
    pub symmetry: [[bool; 2]; D],
    /// A of the particle shifting; `None` leaves it out.
    pub shifting: Option<f64>,
    /// Whether negative pressures stand; otherwise they are set to zero where there is a free surface.
    pub suction: bool,
}

impl<const D: usize> Scene<D> {
    /// An inviscid scene of water (1000 kg/m3, 9.81 m/s2 downwards) with the recommended numbers: relaxation time
    /// 5 ms, Courant number 0.3, pressure tolerance 1e-3, Shepard walls.
    pub fn new(tank: Tank<D>, water: Vec<WaterBox<D>>, particle_spacing: f64) -> Self {
        let mut vector = [0.0; D];
        vector[1] = -9.81;
        Self {
            tank,
            gravity: Gravity { vector, factor: None, frame: None },
            reference_density: 1000.0,
            kinematic_viscosity: None,
            smagorinsky: None,
            friction: WallFriction::Slip,
            particle_spacing,
            air_distance: DEEP,
            kernel: KernelShape::CubicSpline,
            source: Source::Time(0.005),
            water,
            courant: 0.3,
            pressure_tolerance: 1e-3,
            pass_tolerance: 1e-4,
            solver: PressureSolver::Multigrid,
            explicit: None,
            wall_pressure: WallPressure::Shepard,
            max_substeps: 200,
            body_wet: None,
            jitter: None,
            flow: None,
            obstacles: Vec::new(),
            carve: false,
            openings: Vec::new(),
            periodic: [false; D],
            symmetry: [[false; 2]; D],
            shifting: None,
            suction: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gravity_follows_its_table() {
        let table = Some(vec![(0.0, 0.0), (0.1, 1.0)]);
        let gravity = Gravity { vector: [0.0, -10.0], factor: table, frame: None };
        assert_eq!(gravity.at(-1.0)[1], 0.0);
        assert!((gravity.at(0.05)[1] + 5.0).abs() < 1e-12);
        assert_eq!(gravity.at(2.0)[1], -10.0);
        let frame = Prescribed::Sine { amplitude: vec![0.1, 0.0], frequency: 1.0, phase: 0.0 };
        let shaken = Gravity { frame: Some(frame), ..gravity };
        let omega = std::f64::consts::TAU;
        assert!((shaken.at(0.25)[0] - 0.1 * omega * omega).abs() < 1e-12, "against the acceleration");
    }
}
