//! Neighbour search: a dense grid of cells with the kernel's support as edge, and points sorted by cell.
//!
//! Places are whole numbers of a small part of an edge: differences are exact, so what i finds of j, j finds of i to
//! the last bit, and a distance needs single precision only. `neighbours.rs` searches them.

use rayon::prelude::*;

use crate::lanes::LANES;
use crate::parallel::{CHUNK, LIGHT};
use crate::vector::Vector;

/// No cell of the stencil beyond 3^3.
pub const STENCIL_MAX: usize = 27;

/// Parts of an edge at most: differences across the stencil are then exact in single precision. An edge is 2.4
/// spacings, so a part is a millionth of a spacing.
const FINEST: u32 = 1 << 21;

/// A point in parts of an edge from the corner of the grid.
pub type Place<const D: usize> = [i32; D];

/// A dense grid over everything the water can reach.
#[derive(Debug, Clone)]
pub struct Grid<const D: usize> {
    origin: Vector<D>,
    /// Length of a part of an edge, m.
    pub(crate) part: f64,
    pub(crate) parts: i32,
    pub(crate) inverse_part: f64,
    inverse_edge: f64,
    count: [usize; D],
    stride: [usize; D],
    /// Offset of each cell of the stencil, `[3^D]`.
    offset: Vec<isize>,
}

impl<const D: usize> Grid<D> {
    /// A grid of cells of `edge` m covering `lower..upper`, with one more layer of cells around.
    pub fn new(lower: &Vector<D>, upper: &Vector<D>, edge: f64) -> Self {
        let count: [usize; D] = std::array::from_fn(|k| ((upper[k] - lower[k]) / edge).ceil() as usize + 2);
        let origin = std::array::from_fn(|k| lower[k] - edge);
        let mut stride = [1; D];
        for k in 1..D {
            stride[k] = stride[k - 1] * count[k - 1];
        }
        let steps = |number: usize| [number % 3, number / 3 % 3, number / 9];
        let along = |number: usize, k: usize| (steps(number)[k] as isize - 1) * stride[k] as isize;
        let offset = (0..3usize.pow(D as u32)).map(|number| (0..D).map(|k| along(number, k)).sum()).collect();
        // Room for the whole grid in 31 bits.
        let longest = count.iter().fold(1, |longest, &count| longest.max(count as u32 + 4));
        let parts = FINEST.min((1 << 30) / longest.next_power_of_two()) as i32;
        Self {
            origin,
            part: edge / f64::from(parts),
            parts,
            inverse_part: f64::from(parts) / edge,
            inverse_edge: 1.0 / edge,
            count,
            stride,
            offset,
        }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.count.iter().product()
    }

    /// Whether there is no cell; never the case.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Cells along each axis.
    pub fn count(&self) -> [usize; D] {
        self.count
    }

    /// Coordinates of a cell.
    pub fn coordinates(&self, cell: usize) -> [usize; D] {
        std::array::from_fn(|k| cell / self.stride[k] % self.count[k])
    }

    /// The cell of a point, or `None` outside the grid or in its outermost layer, where the stencil would leave it.
    #[inline(always)]
    pub fn inner_cell(&self, x: &Vector<D>) -> Option<usize> {
        self.cell_within(x, 1)
    }

    /// The cell of a point, or `None` outside the grid.
    #[inline(always)]
    pub fn cell(&self, x: &Vector<D>) -> Option<usize> {
        self.cell_within(x, 0)
    }

    #[inline(always)]
    fn cell_within(&self, x: &Vector<D>, margin: usize) -> Option<usize> {
        let mut cell = 0;
        for k in 0..D {
            let at = (x[k] - self.origin[k]) * self.inverse_edge;
            // A NaN fails both comparisons and is outside.
            if !(at >= margin as f64 && at < (self.count[k] - margin) as f64) {
                return None;
            }
            cell += at as usize * self.stride[k];
        }
        Some(cell)
    }

    /// Place of a point inside the grid.
    #[inline(always)]
    pub fn place(&self, x: &Vector<D>) -> Place<D> {
        std::array::from_fn(|k| ((x[k] - self.origin[k]) * self.inverse_part) as i32)
    }

    /// Length of a part of an edge, the unit of places, m.
    pub fn part(&self) -> f64 {
        self.part
    }

    /// The cells around `cell`, itself included, in the order of the stencil; `cell` must be an inner one.
    pub fn stencil(&self, cell: usize) -> impl Iterator<Item = usize> + '_ {
        self.offset.iter().map(move |&offset| (cell as isize + offset) as usize)
    }
}

/// Points sorted by cell.
#[derive(Debug, Clone)]
pub struct CellList<const D: usize> {
    /// First sorted point of each cell, `[cells + 1]`.
    start: Vec<u32>,
    /// Places of the sorted points, one column per axis, with room for a vector behind the last.
    pub(crate) column: [Vec<i32>; D],
    /// Original number of each sorted point.
    order: Vec<u32>,
    cell_of: Vec<u32>,
}

impl<const D: usize> Default for CellList<D> {
    fn default() -> Self {
        let column = std::array::from_fn(|_| Vec::new());
        Self { start: Vec::new(), column, order: Vec::new(), cell_of: Vec::new() }
    }
}

const OUTSIDE: u32 = u32::MAX;

impl<const D: usize> CellList<D> {
    /// Sorts points by cell, stable (counting sort); points outside the grid are left out.
    pub fn sort(&mut self, grid: &Grid<D>, points: &[Vector<D>]) {
        self.cell_of.resize(points.len(), OUTSIDE);
        let cells = self.cell_of.par_chunks_mut(CHUNK).zip(points.par_chunks(CHUNK));
        cells.with_min_len(LIGHT).for_each(|(cells, points)| {
            for (cell, x) in cells.iter_mut().zip(points) {
                *cell = grid.cell(x).map_or(OUTSIDE, |cell| cell as u32);
            }
        });
        // Two places further on, so that after the points are placed each start stands where it belongs.
        self.start.clear();
        self.start.resize(grid.len() + 2, 0);
        for &cell in self.cell_of.iter().filter(|&&cell| cell != OUTSIDE) {
            self.start[cell as usize + 2] += 1;
        }
        let mut sum = 0;
        for start in &mut self.start {
            sum += *start;
            *start = sum;
        }
        self.order.resize(sum as usize, 0);
        for (point, &cell) in self.cell_of.iter().enumerate().filter(|&(_, &cell)| cell != OUTSIDE) {
            let place = &mut self.start[cell as usize + 1];
            self.order[*place as usize] = point as u32;
            *place += 1;
        }
        self.find_places(grid, points);
    }

    fn find_places(&mut self, grid: &Grid<D>, points: &[Vector<D>]) {
        for (k, column) in self.column.iter_mut().enumerate() {
            column.resize(self.order.len() + LANES, 0);
            let places = column.par_chunks_mut(CHUNK).zip(self.order.par_chunks(CHUNK));
            places.with_min_len(LIGHT).for_each(|(places, order)| {
                for (place, &point) in places.iter_mut().zip(order) {
                    *place = grid.place(&points[point as usize])[k];
                }
            });
        }
    }

    /// Original number of each sorted point.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Place of a sorted point as it stood when it was sorted.
    #[inline(always)]
    pub fn place(&self, sorted: usize) -> Place<D> {
        std::array::from_fn(|k| self.column[k][sorted])
    }

    /// A sorted point as it stood when it was sorted, to a part of an edge, m.
    #[inline(always)]
    pub fn point(&self, grid: &Grid<D>, sorted: usize) -> Vector<D> {
        std::array::from_fn(|k| grid.origin[k] + (f64::from(self.column[k][sorted]) + 0.5) * grid.part)
    }

    /// Sorted points of one cell.
    #[inline(always)]
    pub fn range(&self, cell: usize) -> std::ops::Range<usize> {
        self.start[cell] as usize..self.start[cell + 1] as usize
    }

    /// Whether any of the cells around `cell` holds a point.
    #[inline(always)]
    pub fn is_near(&self, grid: &Grid<D>, cell: usize) -> bool {
        grid.stencil(cell).any(|near| !self.range(near).is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neighbours::Neighbours;
    use crate::vector::{norm, sub};

    #[test]
    fn the_search_finds_what_a_loop_over_all_pairs_finds() {
        let mut state = 7u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let points: Vec<Vector<3>> = (0..400).map(|_| [random(), random() * 0.5, random() * 0.7]).collect();
        let grid = Grid::new(&[0.0; 3], &[1.0, 0.5, 0.7], 0.17);
        let mut list = CellList::default();
        list.sort(&grid, &points);
        let mut near = Neighbours::default();
        for x in &points {
            let cell = grid.inner_cell(x).unwrap();
            near.find_around((&grid, &list), (cell, x), (0.17 * 0.17, 1.0));
            let mut found: Vec<u32> =
                near.index[..near.len()].iter().map(|&k| list.order()[k as usize]).collect();
            found.sort_unstable();
            let all = (0..400u32).filter(|&j| norm(&sub(x, &points[j as usize])) < 0.17);
            assert_eq!(found, all.collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_point_that_is_not_finite_is_in_no_cell() {
        let grid = Grid::new(&[0.0; 2], &[1.0; 2], 0.1);
        assert_eq!(grid.cell(&[f64::NAN, 0.5]), None);
        assert_eq!(grid.cell(&[0.5, f64::INFINITY]), None);
    }
}
