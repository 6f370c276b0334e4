//! Pressure at the interface markers (the paper's "interface markers"), one per pair of face and surface node.

use protocol::interface::Facets;
use rayon::prelude::*;

use crate::cells::Grid;
use crate::kernel::Kernel;
use crate::neighbours::Neighbours;
use crate::particles::Water;
use crate::vector::{Vector, add_scaled, dot, normalised, sub};

/// Water counts for a marker when it lies less than this many spacings behind the face.
const BEHIND: f64 = 0.3;

/// A marker with less water around it than this part of n0 fades to zero pressure.
const WET: f64 = 0.25;

/// Markers of the body.
#[derive(Debug)]
pub struct Markers<const D: usize> {
    /// Pressure, `[m]` Pa, in the order of `Facets::markers()`, of the last sub-step.
    pub pressure: Vec<f64>,
    /// Surface node of each marker.
    node: Vec<usize>,
    facets: Facets,
    /// Marker of each corner of each facet.
    marker_of: Vec<usize>,
    normal: Vec<Vector<D>>,
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
    /// Markers on the wet facets of a body.
    pub fn new(facets: &Facets) -> Self {
        let markers = facets.markers();
        let corner = |facet: usize| {
            let (face, markers) = (facets.face[facet], &markers);
            facets.facet(facet).iter().map(move |&node| {
                let wanted = protocol::interface::InterfaceMarker { face, node };
                markers.binary_search(&wanted).expect("every corner of a facet has a marker")
            })
        };
        Self {
            pressure: vec![0.0; markers.len()],
            node: markers.iter().map(|marker| marker.node).collect(),
            marker_of: (0..facets.len()).flat_map(corner).collect(),
            normal: vec![[0.0; D]; markers.len()],
            near: vec![Neighbours::default(); markers.len().div_ceil(PER_TASK)],
            facets: facets.clone(),
        }
    }

    /// Evaluates all marker pressures at the current node positions; `acceleration` is that of prescribed motion,
    /// zero for every elastic wall.
    pub fn evaluate(
        &mut self,
        field: PressureField<'_, D>,
        (position, acceleration): (&[Vector<D>], &[Vector<D>]),
        gravity: &Vector<D>,
    ) {
        self.find_normals(position);
        let behind = BEHIND * field.kernel.spacing;
        let rows = self.pressure.par_chunks_mut(PER_TASK).zip(self.near.par_iter_mut());
        let given = self.node.par_chunks(PER_TASK).zip(self.normal.par_chunks(PER_TASK));
        rows.zip(given).for_each(|((pressure, near), (node, normal))| {
            for k in 0..pressure.len() {
                let body_force = sub(gravity, &acceleration[node[k]]);
                let at = (&position[node[k]], &normal[k]);
                pressure[k] = field.at(at, behind, &body_force, near).max(0.0);
            }
        });
    }

    fn find_normals(&mut self, position: &[Vector<D>]) {
        self.normal.fill([0.0; D]);
        let per_facet = self.facets.nodes_per_facet;
        for facet in 0..self.facets.len() {
            let nodes = self.facets.facet(facet);
            let area: Vector<D> = facet_area(nodes, position);
            for corner in 0..per_facet {
                add_scaled(&mut self.normal[self.marker_of[facet * per_facet + corner]], 1.0, &area);
            }
        }
        for normal in &mut self.normal {
            *normal = normalised(normal);
        }
    }
}

/// Markers per task.
const PER_TASK: usize = 64;

/// Outward area vector of a facet: m in 2-D, m2 in 3-D.
fn facet_area<const D: usize>(nodes: &[usize], position: &[Vector<D>]) -> Vector<D> {
    let x = |k: usize| &position[nodes[k]];
    let mut area = [0.0; D];
    if D == 2 {
        let along = sub(x(1), x(0));
        (area[0], area[1]) = (along[1], -along[0]);
    } else {
        let last = nodes.len() - 1;
        let (a, b) = if last == 2 {
            (sub(x(1), x(0)), sub(x(2), x(0)))
        } else {
            (sub(x(2), x(0)), sub(x(last), x(1)))
        };
        for k in 0..D {
            let (p, q) = ((k + 1) % D, (k + 2) % D);
            area[k] = 0.5 * (a[p] * b[q] - a[q] * b[p]);
        }
    }
    area
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_point_out_of_the_body() {
        // Lower edge of a body above it: the segment runs with the body on its left.
        let area: Vector<2> = facet_area(&[0, 1], &[[0.0, 0.0], [2.0, 0.0]]);
        assert_eq!(area, [0.0, -2.0]);
        let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(facet_area::<3>(&[0, 1, 2, 3], &square), [0.0, 0.0, 1.0]);
        assert_eq!(facet_area::<3>(&[0, 1, 2], &square), [0.0, 0.0, 0.5]);
    }
}
