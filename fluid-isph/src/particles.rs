//! The water: one column per quantity, sorted by cell at the start of every sub-step.

use rayon::prelude::*;

use crate::cells::{CellList, Grid};
use crate::parallel::{CHUNK, LIGHT};
use crate::vector::Vector;

/// Columns of the water particles, `[n]` each.
#[derive(Debug, Default)]
pub struct Water<const D: usize> {
    /// x, m.
    pub position: Vec<Vector<D>>,
    /// v, and v* between the intermediate velocity and the correction, m/s.
    pub velocity: Vec<Vector<D>>,
    /// P of the last solve, Pa.
    pub pressure: Vec<f32>,
    /// P of the solve before, Pa.
    pub last_pressure: Vec<f32>,
    /// n_i = sum W over water and wall, itself included, 1/m^D.
    pub number_density: Vec<f32>,
    /// Number the particle got at the start.
    pub id: Vec<u32>,
    /// Place in the grid and a zero: four lanes, as the sums over pairs read it.
    pub place: Vec<[i32; 4]>,
    /// v, and v* after the intermediate velocity, as the sums over pairs read it, m/s; the last of the four lanes is 1
    /// at the surface, once v* is known.
    pub flow: Vec<[f32; 4]>,
    /// Sorted by cell; its order is the order of the columns.
    pub cells: CellList<D>,
    /// Number of the non-empty cell each particle is in.
    pub aggregate: Vec<u32>,
    /// Non-empty cells, in rising order.
    pub occupied: Vec<u32>,
    /// First particle of each non-empty cell, `[cells + 1]`.
    pub aggregate_start: Vec<u32>,
    spare: Spare<D>,
}

#[derive(Debug, Default)]
struct Spare<const D: usize> {
    position: Vec<Vector<D>>,
    velocity: Vec<Vector<D>>,
    pressure: Vec<f32>,
    last_pressure: Vec<f32>,
    number_density: Vec<f32>,
    id: Vec<u32>,
}

impl<const D: usize> Water<D> {
    /// Water at the start, at rest under no pressure.
    pub fn new(position: Vec<Vector<D>>, velocity: Vec<Vector<D>>) -> Self {
        let count = position.len();
        Self {
            pressure: vec![0.0; count],
            last_pressure: vec![0.0; count],
            number_density: vec![0.0; count],
            id: (0..count as u32).collect(),
            position,
            velocity,
            ..Self::default()
        }
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether there is no particle.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Sorts all columns by cell and lists the non-empty cells; every particle must be inside the grid.
    pub fn sort(&mut self, grid: &Grid<D>) {
        self.cells.sort(grid, &self.position);
        let order = self.cells.order();
        permute(order, &self.position, &mut self.spare.position);
        permute(order, &self.velocity, &mut self.spare.velocity);
        permute(order, &self.pressure, &mut self.spare.pressure);
        permute(order, &self.last_pressure, &mut self.spare.last_pressure);
        permute(order, &self.number_density, &mut self.spare.number_density);
        permute(order, &self.id, &mut self.spare.id);
        std::mem::swap(&mut self.position, &mut self.spare.position);
        std::mem::swap(&mut self.velocity, &mut self.spare.velocity);
        std::mem::swap(&mut self.pressure, &mut self.spare.pressure);
        std::mem::swap(&mut self.last_pressure, &mut self.spare.last_pressure);
        std::mem::swap(&mut self.number_density, &mut self.spare.number_density);
        std::mem::swap(&mut self.id, &mut self.spare.id);
        self.list_occupied(grid);
        self.fill_lanes();
    }

    fn fill_lanes(&mut self) {
        self.place.resize(self.len(), [0; 4]);
        self.flow.resize(self.len(), [0.0; 4]);
        let (cells, velocity) = (&self.cells, &self.velocity);
        let lanes = self.place.par_chunks_mut(CHUNK).zip(self.flow.par_chunks_mut(CHUNK));
        lanes.enumerate().with_min_len(LIGHT).for_each(|(number, (place, flow))| {
            for k in 0..place.len() {
                place[k][..D].copy_from_slice(&cells.place(number * CHUNK + k));
                flow[k] = four_lanes(&velocity[number * CHUNK + k]);
            }
        });
    }

    fn list_occupied(&mut self, grid: &Grid<D>) {
        self.aggregate.clear();
        self.occupied.clear();
        self.aggregate_start.clear();
        let mut particle = 0;
        while particle < self.position.len() {
            let cell = grid.cell(&self.position[particle]).expect("particles outside the grid are retired");
            let end = self.cells.range(cell).end;
            self.aggregate.resize(end, self.occupied.len() as u32);
            self.aggregate_start.push(particle as u32);
            self.occupied.push(cell as u32);
            particle = end;
        }
        self.aggregate_start.push(particle as u32);
    }

    /// Removes the particles `leaves` says so; the order of the others is kept.
    pub fn retire(&mut self, mut leaves: impl FnMut(&Vector<D>, &Vector<D>) -> bool) {
        let mut kept = 0;
        for particle in 0..self.len() {
            if !leaves(&self.position[particle], &self.velocity[particle]) {
                self.position[kept] = self.position[particle];
                self.velocity[kept] = self.velocity[particle];
                self.pressure[kept] = self.pressure[particle];
                self.last_pressure[kept] = self.last_pressure[particle];
                self.number_density[kept] = self.number_density[particle];
                self.id[kept] = self.id[particle];
                kept += 1;
            }
        }
        self.position.truncate(kept);
        self.velocity.truncate(kept);
        self.pressure.truncate(kept);
        self.last_pressure.truncate(kept);
        self.number_density.truncate(kept);
        self.id.truncate(kept);
    }
}

/// A vector in single precision, filled up with zeros.
#[inline(always)]
pub fn four_lanes<const D: usize>(v: &Vector<D>) -> [f32; 4] {
    std::array::from_fn(|k| if k < D { v[k] as f32 } else { 0.0 })
}

fn permute<T: Copy + Send + Sync>(order: &[u32], from: &[T], to: &mut Vec<T>) {
    // Any value will do for the new places: all are overwritten.
    if let Some(&any) = from.first() {
        to.resize(order.len(), any);
    } else {
        to.clear();
    }
    to.par_chunks_mut(CHUNK).zip(order.par_chunks(CHUNK)).with_min_len(16).for_each(|(to, order)| {
        for (target, &source) in to.iter_mut().zip(order) {
            *target = from[source as usize];
        }
    });
}
