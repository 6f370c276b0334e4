//! Pressure at the interface markers (the paper's "interface markers"): one per pair of face and surface node of a dummy
//! mesh, or the fluid's own points on the wet faces.

use rayon::prelude::*;

use crate::body::Structure;
use crate::cells::Grid;
use crate::facet_normals::FacetNormals;
use crate::kernel::Kernel;
use crate::neighbours::Neighbours;
use crate::nodes::Nodes;
use crate::particles::Water;
use crate::vector::{Vector, dot, sub};

/// Water counts for a marker when it lies less than this many spacings behind the face.
const BEHIND: f64 = 0.3;

/// A marker with less water around it than this part of n0 fades to zero pressure.
const WET: f64 = 0.25;

/// Markers of the body.
#[derive(Debug)]
pub struct Markers<const D: usize> {
    /// Pressure, `[m]` Pa, of the last sub-step.
    pub pressure: Vec<f64>,
    /// Interface node, or point, of each marker.
    node: Vec<usize>,
    normal: Vec<Vector<D>>,
    /// What makes the normals of a mesh; without a mesh they are given.
    facets: Option<FacetNormals>,
    near: Vec<Neighbours>,
}

/// What the pressure at a point is taken from.
#[derive(Debug, Clone, Copy)]
pub struct PressureField<'a, const D: usize> {
    /// Search grid.
    pub grid: &'a Grid<D>,
    /// Kernel.
    pub kernel: &'a Kernel<D>,
    /// Water.
    pub water: &'a Water<D>,
    /// rho0, kg/m3.
    pub reference_density: f64,
}

impl<const D: usize> PressureField<'_, D> {
    /// Pressure at `x` (Pa): sum W (p_j + rho0 b.(x - x_j)) / max(sum W, 0.25 n0) over the water with
    /// (x_j - x).n >= -`behind`; `body_force` b is g - a, m/s2. A zero normal takes all water.
    ///
    /// A plain Shepard mean would be 1.5 % wrong at a floor under still water: b restores the hydrostatic slope.
    pub fn at(
        &self,
        (x, normal): (&Vector<D>, &Vector<D>),
        behind: f64,
        body_force: &Vector<D>,
        near: &mut Neighbours,
    ) -> f64 {
        let Some(cell) = self.grid.inner_cell(x) else { return 0.0 };
        let support2 = self.kernel.support_radius * self.kernel.support_radius;
        let reach = (support2, self.kernel.inverse_square());
        near.find_around((self.grid, &self.water.cells), (cell, x), reach);
        let (mut weights, mut sum) = (0.0, 0.0);
        for k in 0..near.len() {
            let j = near.index[k] as usize;
            let d = sub(&self.water.cells.point(self.grid, j), x);
            if dot(&d, normal) < -behind {
                continue;
            }
            let w = f64::from(self.kernel.shape.evaluate(near.q2[k].sqrt()).0) * self.kernel.value_factor();
            weights += w;
            sum += w * (f64::from(self.water.pressure[j]) - self.reference_density * dot(body_force, &d));
        }
        sum / weights.max(WET * self.kernel.lattice_density)
    }
}

impl<const D: usize> Markers<D> {
    /// Markers on the wet facets of a mesh, in the order of `Facets::markers()`, or at the points that have an area.
    pub fn new(structure: &Structure<D>) -> Self {
        let (node, facets): (Vec<_>, _) = match structure {
            Structure::Mesh(mesh) => {
                let markers = mesh.facets.markers();
                let facets = FacetNormals::new(&mesh.facets, &markers);
                (markers.iter().map(|marker| marker.node).collect(), Some(facets))
            }
            Structure::Points(offer, _) => ((offer.particle_count()..offer.len()).collect(), None),
        };
        let count = node.len();
        Self {
            pressure: vec![0.0; count],
            node,
            normal: vec![[0.0; D]; count],
            facets,
            near: vec![Neighbours::default(); count.div_ceil(PER_TASK)],
        }
    }

    /// Evaluates all marker pressures where the nodes are now; their acceleration is that of prescribed motion, zero for
    /// every elastic wall.
    pub fn evaluate(&mut self, field: PressureField<'_, D>, nodes: &Nodes<D>, gravity: &Vector<D>) {
        self.find_normals(nodes);
        let behind = BEHIND * field.kernel.spacing;
        let rows = self.pressure.par_chunks_mut(PER_TASK).zip(self.near.par_iter_mut());
        let given = self.node.par_chunks(PER_TASK).zip(self.normal.par_chunks(PER_TASK));
        rows.zip(given).for_each(|((pressure, near), (node, normal))| {
            for k in 0..pressure.len() {
                let body_force = sub(gravity, &nodes.acceleration[node[k]]);
                let at = (&nodes.position[node[k]], &normal[k]);
                pressure[k] = field.at(at, behind, &body_force, near).max(0.0);
            }
        });
    }

    fn find_normals(&mut self, nodes: &Nodes<D>) {
        match &self.facets {
            Some(facets) => facets.evaluate(&nodes.position, &mut self.normal),
            None => {
                for (normal, &node) in self.normal.iter_mut().zip(&self.node) {
                    *normal = nodes.normal[node];
                }
            }
        }
    }
}

/// Markers per task.
const PER_TASK: usize = 64;
