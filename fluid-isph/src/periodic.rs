//! Periodic directions: images of the water near one end stand beyond the other.
//!
//! An image is no unknown: its entry in a matrix row goes to the column of the particle it belongs to, so the matrix
//! stays symmetric and as small as it is. What the loops over rows then take for the place of the neighbour is that of
//! the owner; the terms linear in the distance are put right afterwards by the constant shift between the two. The
//! preconditioner does without the images' entries.

use crate::cells::{CellList, Grid};
use crate::kernel::Kernel;
use crate::markers::PressureField;
use crate::neighbours::Neighbours;
use crate::parallel::CHUNK;
use crate::particles::Water;
use crate::pressure::matrix::{PressureMatrix, RowChunk};
use crate::scene::Tank;
use crate::shifting::ShiftSums;
use crate::vector::{Vector, add_scaled, dot, sub};
use crate::walls::Walls;

/// A water particle and an image in its reach.
#[derive(Debug, Clone, Copy)]
struct Pair {
    row: u32,
    image: u32,
    /// A_ij, 1/m2.
    value: f32,
    /// W, 1/m^D.
    weight: f32,
}

/// The periodic directions of a scene that has some.
#[derive(Debug)]
pub struct Periodic<const D: usize> {
    axes: [bool; D],
    min: Vector<D>,
    length: Vector<D>,
    images: CellList<D>,
    /// By image as made: its owner and x_image - x_owner, m.
    made: Vec<(u32, Vector<D>)>,
    place: Vec<Vector<D>>,
    pairs: Vec<Pair>,
    /// Wall particles within reach of an end.
    walls: Vec<u32>,
    near: [Neighbours; 2],
    spare: RowChunk,
}

impl<const D: usize> Periodic<D> {
    /// The directions `axes` of a tank; `None` if there are none.
    pub fn new(axes: [bool; D], tank: &Tank<D>, walls: &Walls<D>, kernel: &Kernel<D>) -> Option<Self> {
        if axes == [false; D] {
            return None;
        }
        let reach = kernel.support_radius;
        let near_end = |x: &Vector<D>| {
            (0..D).any(|k| axes[k] && (x[k] < tank.min[k] + reach || x[k] > tank.max[k] - reach))
        };
        let near_walls = (0..walls.len()).filter(|&wall| near_end(&walls.position[wall]));
        Some(Self {
            axes,
            min: tank.min,
            length: sub(&tank.max, &tank.min),
            images: CellList::default(),
            made: Vec::new(),
            place: Vec::new(),
            pairs: Vec::new(),
            walls: near_walls.map(|wall| wall as u32).collect(),
            near: Default::default(),
            spare: RowChunk::default(),
        })
    }

    /// Brings particles that left at one end in at the other; returns the sum of their ways, m.
    pub fn wrap(&self, position: &mut [Vector<D>]) -> Vector<D> {
        let mut way = [0.0; D];
        for k in (0..D).filter(|&k| self.axes[k]) {
            for x in position.iter_mut() {
                let at = x[k] - self.min[k];
                if at < 0.0 || at >= self.length[k] {
                    let inside = at.rem_euclid(self.length[k]);
                    // Rounding may give the length itself.
                    let inside = if inside < self.length[k] { inside } else { 0.0 };
                    way[k] += inside - at;
                    x[k] = self.min[k] + inside;
                }
            }
        }
        way
    }

    /// Makes the images of all water within a support of an end and finds the particles in their reach.
    pub fn find_pairs(&mut self, grid: &Grid<D>, kernel: &Kernel<D>, water: &Water<D>) {
        let reach = kernel.support_radius;
        self.made.clear();
        self.place.clear();
        for (owner, x) in water.position.iter().enumerate() {
            // Each axis: no shift, a length up from the lower end, a length down from the upper end.
            for number in 1..3usize.pow(D as u32) {
                let digit = |k: usize| number / 3usize.pow(k as u32) % 3;
                let wanted = (0..D).all(|k| match digit(k) {
                    0 => true,
                    1 => self.axes[k] && x[k] < self.min[k] + reach,
                    _ => self.axes[k] && x[k] > self.min[k] + self.length[k] - reach,
                });
                if wanted {
                    let shift = std::array::from_fn(|k| [0.0, 1.0, -1.0][digit(k)] * self.length[k]);
                    self.made.push((owner as u32, shift));
                    self.place.push(std::array::from_fn(|k| x[k] + shift[k]));
                }
            }
        }
        self.images.sort(grid, &self.place);
        self.pairs.clear();
        let support = (reach * reach, kernel.inverse_square());
        for (row, x) in water.position.iter().enumerate() {
            let inner = |k: usize| {
                !self.axes[k] || x[k] >= self.min[k] + reach && x[k] <= self.min[k] + self.length[k] - reach
            };
            if (0..D).all(inner) {
                continue;
            }
            let Some(cell) = grid.inner_cell(x) else { continue };
            let near = &mut self.near[0];
            near.find_around((grid, &self.images), (cell, x), support);
            for k in 0..near.len() {
                let (w, f) = kernel.shape.evaluate(near.q2[k].sqrt());
                let image = self.images.order()[near.index[k] as usize];
                self.pairs.push(Pair {
                    row: row as u32,
                    image,
                    value: -kernel.coupling_factor() * f,
                    weight: w,
                });
            }
        }
    }

    /// Adds the images to the rows of the matrix, its diagonal and n_i.
    pub fn extend_rows(
        &mut self,
        (kernel, air): (&Kernel<D>, f64),
        water: &mut Water<D>,
        matrix: &mut PressureMatrix,
    ) {
        let mut first = 0;
        while first < self.pairs.len() {
            let number = self.pairs[first].row as usize / CHUNK;
            let in_chunk = self.pairs[first..].partition_point(|pair| pair.row as usize / CHUNK == number);
            let pairs = &self.pairs[first..first + in_chunk];
            let rows = &mut matrix.chunks[number];
            let mut rest = pairs;
            self.spare.clear();
            for k in 0..rows.end.len() {
                let particle = number * CHUNK + k;
                let (columns, values) = rows.row(k);
                self.spare.column.extend_from_slice(columns);
                self.spare.value.extend_from_slice(values);
                let own = rest.partition_point(|pair| pair.row as usize == particle);
                for pair in &rest[..own] {
                    self.spare.column.push(self.made[pair.image as usize].0);
                    self.spare.value.push(pair.value);
                    water.number_density[particle] += (f64::from(pair.weight) * kernel.value_factor()) as f32;
                }
                rest = &rest[own..];
                self.spare.end.push(self.spare.column.len() as u32);
            }
            std::mem::swap(&mut rows.column, &mut self.spare.column);
            std::mem::swap(&mut rows.value, &mut self.spare.value);
            std::mem::swap(&mut rows.end, &mut self.spare.end);
            for run in pairs.chunk_by(|a, b| a.row == b.row) {
                settle_diagonal((kernel, air), water, matrix, run[0].row as usize);
            }
            first += in_chunk;
        }
    }

    /// Puts the divergence right: the rows took the owner's place for the image's.
    pub fn correct_source(&self, divergence_factor: f64, water: &Water<D>, source: &mut [f32]) {
        for pair in &self.pairs {
            let (owner, shift) = &self.made[pair.image as usize];
            let change = sub(&water.velocity[pair.row as usize], &water.velocity[*owner as usize]);
            let divergence = 0.5 * f64::from(pair.value) * dot(&change, shift);
            source[pair.row as usize] -= (divergence_factor * divergence) as f32;
        }
    }

    /// Puts the pressure gradient right; `factor` is dt/(2 rho0).
    pub fn correct_velocity(&self, factor: f64, water: &mut Water<D>) {
        for pair in &self.pairs {
            let (owner, shift) = &self.made[pair.image as usize];
            let (row, owner) = (pair.row as usize, *owner as usize);
            let pressure = f64::from(water.pressure[row] + water.pressure[owner]);
            add_scaled(&mut water.velocity[row], factor * f64::from(pair.value) * pressure, shift);
        }
    }

    /// Puts the sums of the particle shifting right.
    pub fn correct_shifting(&self, water: &Water<D>, sums: &mut [ShiftSums<D>]) {
        for pair in &self.pairs {
            let (owner, shift) = &self.made[pair.image as usize];
            let (row, half) = (pair.row as usize, 0.5 * f64::from(pair.value));
            let change = sub(&water.velocity[row], &water.velocity[*owner as usize]);
            add_scaled(&mut sums[row].away, half, shift);
            for a in 0..D {
                add_scaled(&mut sums[row].gradient[a], half * change[a], shift);
            }
        }
    }

    /// Pressure of the wall particles near the ends, from water and images.
    pub fn find_wall_pressure(&mut self, field: PressureField<'_, D>, walls: &mut Walls<D>, g: &Vector<D>) {
        let support = (field.kernel.support_radius.powi(2), field.kernel.inverse_square());
        for &wall in &self.walls {
            let wall = wall as usize;
            let x = &walls.position[wall];
            let Some(cell) = field.grid.inner_cell(x) else { continue };
            let body_force = sub(g, &walls.acceleration[wall]);
            let (mut sum, mut weights) = ([0.0; 2], [0.0; 2]);
            let sets = [&field.water.cells, &self.images];
            for (set, near) in sets.into_iter().zip(&mut self.near) {
                near.find_around((field.grid, set), (cell, x), support);
                for k in 0..near.len() {
                    let sorted = near.index[k] as usize;
                    let d = sub(&set.point(field.grid, sorted), x);
                    let is_image = std::ptr::eq(set, &self.images);
                    let particle =
                        if is_image { self.made[set.order()[sorted] as usize].0 as usize } else { sorted };
                    let w = f64::from(field.kernel.shape.evaluate(near.q2[k].sqrt()).0);
                    let side = walls.side(wall, &d);
                    weights[side] += w;
                    let p = f64::from(field.water.pressure[particle]);
                    sum[side] += w * (p - field.reference_density * dot(&body_force, &d));
                }
            }
            walls.pressure[wall] = std::array::from_fn(|side| {
                if weights[side] > 0.0 { (sum[side] / weights[side]).max(0.0) as f32 } else { 0.0 }
            });
        }
    }
}

/// The diagonal of a row whose entries have changed, as the assembly makes it.
fn settle_diagonal<const D: usize>(
    (kernel, air): (&Kernel<D>, f64),
    water: &Water<D>,
    matrix: &mut PressureMatrix,
    row: usize,
) {
    let rows = &mut matrix.chunks[row / CHUNK];
    let k = row % CHUNK;
    let first = if k == 0 { 0 } else { rows.end[k - 1] as usize };
    let last = rows.end[k] as usize;
    let (mut own, mut coupling) = (first, 0.0);
    for entry in first..last {
        if rows.column[entry] as usize == row && rows.value[entry] > 0.0 {
            own = entry;
        } else {
            coupling -= f64::from(rows.value[entry]);
        }
    }
    let wall: f64 = rows.wall_row(k).1.iter().map(|&value| f64::from(value)).sum();
    let full = kernel.full_diagonal;
    let diagonal =
        coupling + air * (full - coupling - wall).max(0.0) + crate::assembly::REGULARISATION * full;
    let stencil = 3usize.pow(D as u32);
    let share = (water.aggregate[row] as usize - rows.first_aggregate) * stencil + stencil / 2;
    rows.stencil[share] += f64::from(diagonal as f32) - f64::from(rows.value[own]);
    rows.value[own] = diagonal as f32;
    matrix.inverse_diagonal[row] = 1.0 / diagonal as f32;
}
