//! The scene as resolved: everything the solid is made of, checked once.

use protocol::case::interpolate;
use serde::{Deserialize, Serialize};

use crate::box_grid::{BoxGrid, Face};
use crate::element::ElementKind;
use crate::error::SceneError;
use crate::integrator::Integrator;
use crate::material::StVenantKirchhoff;
use crate::mesh::Mesh;

/// A body, its supports, its loads, and how it is computed.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The body and its cells.
    pub grid: BoxGrid,
    /// The element.
    pub element: ElementKind,
    /// kg/m3.
    pub density: f64,
    /// Pa.
    pub young_modulus: f64,
    /// In [0, 0.5).
    pub poisson_ratio: f64,
    /// Faces whose nodes do not move.
    pub clamped: Vec<Face>,
    /// Faces whose nodes do not move along the normal (symmetry planes).
    pub rollers: Vec<Face>,
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
    /// Time integration.
    pub integrator: Integrator,
    /// Residual over the largest of the forces in balance at which Newton's method stops.
    pub newton_tolerance: f64,
    /// Own loads, beside what the water does.
    pub loads: Vec<FaceLoad>,
}

/// A uniform load on one face.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FaceLoad {
    /// Where.
    pub face: Face,
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
            grid,
            element: ElementKind::default_of(grid.dimension),
            density,
            young_modulus,
            poisson_ratio,
            clamped: vec![Face::Bottom],
            rollers: Vec::new(),
            interface: vec![Face::Left, Face::Right, Face::Top],
            wet_sides: 2,
            gravity: [0.0; 3],
            gravity_table: Vec::new(),
            damping: 0.0,
            integrator: Integrator::default(),
            newton_tolerance: 1.5e-6,
            loads: Vec::new(),
        }
    }

    /// Checks what would make nonsense of the computation.
    ///
    /// # Errors
    /// One variant of [`SceneError`] per kind of nonsense.
    pub fn check(&self) -> Result<(), SceneError> {
        let d = self.grid.dimension;
        if !(d == 2 || d == 3) {
            return Err(SceneError::Dimension(d));
        }
        for axis in 0..d {
            let extent = self.grid.extent(axis);
            if extent <= 0.0 || !extent.is_finite() {
                return Err(SceneError::Extent(axis));
            }
            if self.grid.cells[axis] == 0 {
                return Err(SceneError::Elements(axis));
            }
        }
        if self.element.dimension() != d {
            return Err(SceneError::Element(self.element.name(), d));
        }
        self.check_numbers()?;
        let loaded = self.loads.iter().map(|load| &load.face);
        let faces = self.clamped.iter().chain(&self.rollers).chain(&self.interface).chain(loaded);
        match faces.into_iter().find(|face| face.axis() >= d) {
            Some(face) => Err(SceneError::Face(face.name(), "it is a face of a body in 3-D")),
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
        range("young_modulus", self.young_modulus, self.young_modulus > 0.0, "above 0")?;
        let nu = self.poisson_ratio;
        range("poisson_ratio", nu, (0.0..0.5).contains(&nu), "from 0 to below 0.5")?;
        range("damping", self.damping, self.damping >= 0.0, "at least 0")?;
        let tolerance = self.newton_tolerance;
        range("newton_tolerance", tolerance, tolerance > 0.0 && tolerance < 0.1, "above 0 and below 0.1")?;
        self.integrator.check()
    }

    /// The finite element mesh.
    pub fn mesh(&self) -> Mesh {
        if self.element.is_simplex() { Mesh::of_simplices(&self.grid) } else { Mesh::of_boxes(&self.grid) }
    }

    /// The material law.
    pub fn material(&self) -> StVenantKirchhoff {
        StVenantKirchhoff::new(self.density, self.young_modulus, self.poisson_ratio)
    }

    /// Speed of the longitudinal wave in a bar, sqrt(E/rho), m/s.
    pub fn wave_speed(&self) -> f64 {
        (self.young_modulus / self.density).sqrt()
    }

    /// Shortest cell edge, m.
    pub fn smallest_cell(&self) -> f64 {
        (0..self.grid.dimension)
            .map(|axis| self.grid.extent(axis) / self.grid.cells[axis] as f64)
            .fold(f64::INFINITY, f64::min)
    }

    /// Mass behind a wet area: density times the shortest edge over the number of wet faces at its ends, kg/m2.
    pub fn areal_mass(&self) -> f64 {
        let edges = (0..self.grid.dimension).map(|axis| self.grid.extent(axis));
        self.density * edges.fold(f64::INFINITY, f64::min) / self.wet_sides.max(1) as f64
    }

    /// Which components of which nodes do not move, `[n, D]`.
    pub fn fixed(&self) -> Vec<bool> {
        let d = self.grid.dimension;
        let mut fixed = vec![false; self.grid.node_count() * d];
        for face in &self.clamped {
            for node in self.grid.face_nodes(*face) {
                fixed[node * d..node * d + d].fill(true);
            }
        }
        for face in &self.rollers {
            for node in self.grid.face_nodes(*face) {
                fixed[node * d + face.axis()] = true;
            }
        }
        fixed
    }
}

impl FaceLoad {
    /// The factor of its table at a time.
    pub fn factor(&self, time: f64) -> f64 {
        interpolate(&self.table, time)
    }
}
