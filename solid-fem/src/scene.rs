//! The scene as resolved: everything the solid is made of, checked once.

use std::sync::Arc;

use protocol::case::interpolate;
use serde::{Deserialize, Serialize};

use crate::box_grid::{BoxGrid, Face};
use crate::element::{ElementKind, Kinematics, Substance};
use crate::error::SceneError;
use crate::integrator::Integrator;
use crate::material::LawKind;
use crate::mesh::Mesh;
use crate::support::{Support, Supports};

/// The unloaded body.
#[derive(Debug, Clone, PartialEq)]
pub enum Geometry {
    /// A box of equal cells.
    Box(BoxGrid),
    /// A mesh as read, in the cells of the scene's element.
    Mesh(Arc<Mesh>),
}

/// A body, its supports, its loads, and how it is computed.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The body and its cells.
    pub geometry: Geometry,
    /// The element.
    pub element: ElementKind,
    /// kg/m3.
    pub density: f64,
    /// Material and kinematics.
    pub substance: Substance,
    /// Faces whose nodes do not move.
    pub clamped: Vec<String>,
    /// Faces whose nodes do not move along the normal (symmetry planes).
    pub rollers: Vec<String>,
    /// Other supports, also moving ones.
    pub supports: Vec<Support>,
    /// Faces whose nodes are interface nodes: those water may touch and both ends of the shortest edge.
    pub interface: Vec<Face>,
    /// How many ends of the shortest edge are wet: 0, 1 or 2.
    pub wet_sides: usize,
    /// Acceleration of gravity, m/s2; zero if the weight is left out.
    pub gravity: [f64; 3],
    /// Times, s, and factors on gravity; linear between, constant outside. Empty: factor 1.
    pub gravity_table: Vec<(f64, f64)>,
    /// Mass-proportional damping a of a M v, 1/s: free vibration decays as exp(-a t / 2); 0 for none.
    pub damping: f64,
    /// Stiffness-proportional damping b of b K v, K that of the unloaded body, s; 0 for none. As K does not turn with
    /// the body, for small rotation only.
    pub stiffness_damping: f64,
    /// Time integration.
    pub integrator: Integrator,
    /// Residual over the largest of the forces in balance at which Newton's method stops.
    pub newton_tolerance: f64,
    /// Longest step of the body, s; longer ones are taken in equal parts. `None`: as long as they are given.
    pub max_dt: Option<f64>,
    /// Own loads, beside what the water does.
    pub loads: Vec<FaceLoad>,
    /// Forces at points.
    pub point_loads: Vec<PointLoad>,
}

/// A force at a point of the body, spread over the nodes of its element by their shape functions (a node's own place:
/// that node).
#[derive(Debug, Clone, PartialEq)]
pub struct PointLoad {
    /// Where in the unloaded body, m.
    pub point: Vec<f64>,
    /// N (N/m in 2-D).
    pub force: [f64; 3],
    /// As of a [`FaceLoad`].
    pub table: Vec<(f64, f64)>,
}

/// A uniform load on one face.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FaceLoad {
    /// Where: a named face.
    pub face: String,
    /// What.
    pub kind: FaceLoadKind,
    /// Times, s, and factors, ascending; linear between, constant outside. Empty: factor 1 from the start.
    pub table: Vec<(f64, f64)>,
}

/// How a face load acts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum FaceLoadKind {
    /// Pressure, Pa, on the current area against its outward normal: it turns with the face.
    FollowerPressure(f64),
    /// Pressure, Pa, on the reference area against its normal there.
    DeadPressure(f64),
    /// Force per reference area, Pa.
    DeadTraction([f64; 3]),
}

impl Scene {
    /// A body at rest without loads: clamped at the bottom, wet on its left, top and right, no gravity, the default
    /// element and integrator.
    pub fn of_box(grid: BoxGrid, density: f64, young_modulus: f64, poisson_ratio: f64) -> Self {
        Self {
            element: ElementKind::default_of(grid.dimension),
            geometry: Geometry::Box(grid),
            density,
            substance: Substance {
                law: LawKind::default(),
                young_modulus,
                poisson_ratio,
                is_plane_stress: false,
                kinematics: Kinematics::default(),
            },
            clamped: vec![Face::Bottom.name().to_owned()],
            rollers: Vec::new(),
            supports: Vec::new(),
            interface: vec![Face::Left, Face::Right, Face::Top],
            wet_sides: 2,
            gravity: [0.0; 3],
            gravity_table: Vec::new(),
            damping: 0.0,
            stiffness_damping: 0.0,
            integrator: Integrator::default(),
            newton_tolerance: 1.5e-6,
            max_dt: None,
            loads: Vec::new(),
            point_loads: Vec::new(),
        }
    }

    /// 2 or 3.
    pub fn dimension(&self) -> usize {
        match &self.geometry {
            Geometry::Box(grid) => grid.dimension,
            Geometry::Mesh(mesh) => mesh.dimension,
        }
    }

    /// Checks what would make nonsense of the computation.
    ///
    /// # Errors
    /// One variant of [`SceneError`] per kind of nonsense.
    pub fn check(&self) -> Result<(), SceneError> {
        let d = self.dimension();
        if !(d == 2 || d == 3) {
            return Err(SceneError::Dimension(d));
        }
        if let Geometry::Box(grid) = &self.geometry {
            for axis in 0..d {
                if grid.extent(axis) <= 0.0 || !grid.extent(axis).is_finite() {
                    return Err(SceneError::Extent(axis));
                }
                if grid.cells[axis] == 0 {
                    return Err(SceneError::Elements(axis));
                }
            }
        }
        if self.element.dimension() != d {
            return Err(SceneError::Element(self.element.name(), d));
        }
        self.check_numbers()?;
        self.check_conflicts()?;
        match self.interface.iter().find(|face| face.axis() >= d) {
            Some(face) => Err(SceneError::Face(face.name().to_owned(), "it is a face of a body in 3-D")),
            None => Ok(()),
        }
    }

    fn check_numbers(&self) -> Result<(), SceneError> {
        let range = |name, value: f64, is_allowed: bool, range| {
            if is_allowed && value.is_finite() {
                Ok(())
            } else {
                Err(SceneError::Range { name, value, range })
            }
        };
        range("density", self.density, self.density > 0.0, "above 0")?;
        let modulus = self.substance.young_modulus;
        range("young_modulus", modulus, modulus > 0.0, "above 0")?;
        let nu = self.substance.poisson_ratio;
        range("poisson_ratio", nu, (0.0..0.5).contains(&nu), "from 0 to below 0.5")?;
        range("damping", self.damping, self.damping >= 0.0, "at least 0")?;
        let stiffness = self.stiffness_damping;
        range("stiffness_damping", stiffness, stiffness >= 0.0, "at least 0")?;
        let tolerance = self.newton_tolerance;
        range("newton_tolerance", tolerance, tolerance > 0.0 && tolerance < 0.1, "above 0 and below 0.1")?;
        self.integrator.check()
    }

    fn check_conflicts(&self) -> Result<(), SceneError> {
        let Substance { law, kinematics, .. } = &self.substance;
        let is_linear_law = *law == LawKind::StVenantKirchhoff;
        if *kinematics == Kinematics::UpdatedLagrangian && self.element.is_enhanced() {
            let what =
                "the enhanced strain lives in the unloaded shape: take another element, or total_lagrangian";
            return Err(SceneError::Conflict(what));
        }
        if self.integrator == Integrator::EnergyMomentum
            && (!is_linear_law || *kinematics == Kinematics::UpdatedLagrangian)
        {
            let what = "energy_momentum needs st_venant_kirchhoff in linear or total_lagrangian kinematics";
            return Err(SceneError::Conflict(what));
        }
        Ok(())
    }

    /// The finite element mesh.
    pub fn mesh(&self) -> Mesh {
        match &self.geometry {
            Geometry::Box(grid) => Mesh::of_box(grid, self.element.cell()),
            Geometry::Mesh(mesh) => Mesh::clone(mesh),
        }
    }

    /// Whether the supports leave no rigid motion to the body; in words what they leave.
    ///
    /// # Errors
    /// [`SceneError::Face`] or [`SceneError::Mechanism`].
    pub fn check_supports(&self, mesh: &Mesh) -> Result<(), SceneError> {
        match Supports::new(self, mesh)?.free_motion(mesh) {
            Some(motion) => Err(SceneError::Mechanism(motion)),
            None => Ok(()),
        }
    }

    /// Speed of the longitudinal wave in a bar, sqrt(E/rho), m/s.
    pub fn wave_speed(&self) -> f64 {
        (self.substance.young_modulus / self.density).sqrt()
    }

    /// Shortest cell edge, m.
    pub fn smallest_cell(&self) -> f64 {
        match &self.geometry {
            Geometry::Box(grid) => (0..grid.dimension)
                .map(|axis| grid.extent(axis) / grid.cells[axis] as f64)
                .fold(f64::INFINITY, f64::min),
            Geometry::Mesh(mesh) => mesh.shortest_edge(),
        }
    }

    /// Least and greatest coordinates of the unloaded body, m.
    pub fn bounding_box(&self) -> ([f64; 3], [f64; 3]) {
        match &self.geometry {
            Geometry::Box(grid) => (grid.minimum, grid.maximum),
            Geometry::Mesh(mesh) => mesh.bounding_box(),
        }
    }

    /// Mass behind a wet area: density times the shortest edge over the number of wet faces at its ends, kg/m2.
    pub fn areal_mass(&self) -> f64 {
        let (low, high) = self.bounding_box();
        let edges = (0..self.dimension()).map(|axis| high[axis] - low[axis]);
        self.density * edges.fold(f64::INFINITY, f64::min) / self.wet_sides.max(1) as f64
    }
}

impl FaceLoad {
    /// The factor of its table at a time.
    pub fn factor(&self, time: f64) -> f64 {
        interpolate(&self.table, time)
    }
}
