//! Neighbour search: a dense grid of cells with the kernel's support as edge, and points sorted by cell.
//!
//! Places are whole numbers of a small part of an edge: differences are exact, so what i finds of j, j finds of i to
//! the last bit, and a distance needs single precision only. The points of a cell stand side by side; the search
//! takes eight of them at once and packs the hits without a branch.

use rayon::prelude::*;

use crate::kernel::shape;
use crate::lanes::{LANES, Lanes, PACKED, Portable};
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
    part: f64,
    parts: i32,
    inverse_part: f64,
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
    column: [Vec<i32>; D],
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

/// Up to eight points of one cell that stand side by side.
#[derive(Debug, Clone, Copy)]
struct Strip {
    /// Sorted number of the first.
    first: u32,
    /// Their places as seen from the corner of the cell gathered; out of reach where there is none.
    place: [[f32; LANES]; 3],
}

/// The points within the support of one point; buffers are kept from call to call.
///
/// First [`Neighbours::gather`] for a cell, then [`Neighbours::find`] for each point in it.
#[derive(Debug, Clone, Default)]
pub struct Neighbours {
    /// Sorted number of each neighbour; more room than neighbours.
    pub index: Vec<u32>,
    /// (r/h)^2 of each; behind the last one stand zeros of the kernel up to a whole vector.
    pub q2: Vec<f32>,
    /// Slope of the kernel at each, after [`Neighbours::weigh`].
    pub slope: Vec<f32>,
    count: usize,
    strips: Vec<Strip>,
    /// Number of neighbours in the strips before each, `[strips + 1]`.
    strip_end: Vec<u32>,
    /// Number of strips up to the end of each cell of the stencil.
    cell_end: [u32; STENCIL_MAX],
    /// Lower corner of the cell gathered last, in parts of an edge.
    corner: [i32; 3],
    reach2: f32,
    scale: f32,
}

impl Neighbours {
    /// Number found.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether none was found.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Whether there is no point around the cell gathered last.
    pub fn nothing_near(&self) -> bool {
        self.strips.is_empty()
    }

    /// Prepares for points in an inner cell: those of `list` around it within the root of `support2` m2 will be
    /// found, with their squared distances times `inverse_h2` 1/m2.
    #[inline(always)]
    pub fn gather<const D: usize>(
        &mut self,
        (grid, list): (&Grid<D>, &CellList<D>),
        cell: usize,
        (support2, inverse_h2): (f64, f32),
    ) {
        self.strips.clear();
        let at = grid.coordinates(cell);
        self.corner = [0; 3];
        for k in 0..D {
            self.corner[k] = at[k] as i32 * grid.parts;
        }
        for (near, end) in grid.stencil(cell).zip(&mut self.cell_end) {
            let std::ops::Range { start: mut first, end: last } = list.range(near);
            while first < last {
                let mut strip = Strip { first: first as u32, place: [[0.0; LANES]; 3] };
                let count = (last - first).min(LANES);
                for k in 0..D {
                    let places = &list.column[k][first..first + LANES];
                    for lane in 0..LANES {
                        strip.place[k][lane] = places[lane].wrapping_sub(self.corner[k]) as f32;
                    }
                }
                for lane in count..LANES {
                    strip.place[0][lane] = f32::INFINITY;
                }
                self.strips.push(strip);
                first += LANES;
            }
            *end = self.strips.len() as u32;
        }
        self.strip_end.resize(self.strips.len() + 1, 0);
        // A vector behind the last neighbour, and what fills it up.
        let room = LANES * (self.strips.len() + 2);
        if self.index.len() < room {
            self.index.resize(room, 0);
            self.q2.resize(room, 0.0);
            self.slope.resize(room, 0.0);
        }
        self.reach2 = (support2 * grid.inverse_part * grid.inverse_part) as f32;
        self.scale = inverse_h2 * (grid.part * grid.part) as f32;
    }

    /// Finds all points within reach of `x`, itself included, in the order of the stencil.
    #[inline(always)]
    pub fn find<L: Lanes, const D: usize>(&mut self, lanes: L, x: &Place<D>) {
        let mut count = 0;
        let x: [f32; D] = std::array::from_fn(|k| x[k].wrapping_sub(self.corner[k]) as f32);
        let room = LANES * (self.strips.len() + 2);
        let (index, q2) = (&mut self.index[..room], &mut self.q2[..room]);
        for (strip, end) in self.strips.iter().zip(&mut self.strip_end[1..]) {
            let mut r2 = [0.0f32; LANES];
            for k in 0..D {
                for lane in 0..LANES {
                    let d = x[k] - strip.place[k][lane];
                    r2[lane] += d * d;
                }
            }
            let hits = lanes.below(r2, self.reach2);
            let order = PACKED[hits];
            let number: [u32; LANES] = std::array::from_fn(|lane| strip.first + order[lane]);
            q2[count..count + LANES].copy_from_slice(&lanes.shuffle(r2, order));
            index[count..count + LANES].copy_from_slice(&number);
            count += hits.count_ones() as usize;
            *end = count as u32;
        }
        for q2 in &mut self.q2[..count] {
            *q2 *= self.scale;
        }
        // Twice the smoothing length: W and F are 0 there.
        self.q2[count..count + LANES].fill(4.0);
        self.count = count;
    }

    /// Gathers and finds at once, for points that come one by one.
    pub fn find_around<const D: usize>(
        &mut self,
        (grid, list): (&Grid<D>, &CellList<D>),
        (cell, x): (usize, &Vector<D>),
        reach: (f64, f32),
    ) {
        self.gather((grid, list), cell, reach);
        self.find(Portable, &grid.place(x));
    }

    /// Replaces `q2` by the kernel's w and fills `slope` with `factor` f; returns the sum of w.
    #[inline(always)]
    pub fn weigh(&mut self, factor: f32) -> f32 {
        let whole = self.count.next_multiple_of(LANES);
        let q2 = &mut self.q2[..whole];
        for (q2, slope) in q2.iter_mut().zip(&mut self.slope[..whole]) {
            let (w, f) = shape(q2.sqrt());
            *q2 = w;
            *slope = factor * f;
        }
        let mut sums = [0.0f32; LANES];
        for w in q2.chunks_exact(LANES) {
            for lane in 0..LANES {
                sums[lane] += w[lane];
            }
        }
        sums.iter().sum()
    }

    /// Number of neighbours up to the end of a cell of the stencil.
    #[inline(always)]
    pub fn end_of(&self, cell: usize) -> usize {
        self.strip_end[self.cell_end[cell] as usize] as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
