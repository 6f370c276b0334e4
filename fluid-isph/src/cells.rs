//! Neighbour search: a dense grid of cells with the kernel's support as edge, and points sorted by cell.
//!
//! The x axis runs fastest and every cell is cut into four slices along it, so the part of a row of cells that a
//! sphere can reach is one contiguous range of points, and the distance loop runs over plain columns. Cutting rows to
//! the sphere halves the candidates in 3-D.

use crate::vector::Vector;

/// Points a vector holds in the distance loop.
const LANES: usize = 4;

/// No cell of the stencil beyond 3^3.
pub const STENCIL_MAX: usize = 27;

/// Slices of a cell along x.
const SLICES: usize = 4;

/// A dense grid over everything the water can reach.
#[derive(Debug, Clone)]
pub struct Grid<const D: usize> {
    origin: Vector<D>,
    inverse_edge: f64,
    count: [usize; D],
    stride: [usize; D],
    /// Offset of the middle cell of each row of three around a cell, `[3^(D-1)]`.
    row_offset: Vec<isize>,
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
        let rows = 3usize.pow(D as u32 - 1);
        let row_offset = (0..rows)
            .map(|row| {
                let steps = [row % 3, row / 3];
                (1..D).map(|k| (steps[k - 1] as isize - 1) * stride[k] as isize).sum()
            })
            .collect();
        Self { origin, inverse_edge: 1.0 / edge, count, stride, row_offset }
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

    /// The slice of a point inside the grid.
    #[inline(always)]
    fn slice(&self, cell: usize, x: &Vector<D>) -> usize {
        let at = (x[0] - self.origin[0]) * self.inverse_edge;
        SLICES * cell + ((at - at.floor()) * SLICES as f64) as usize
    }

    /// Place of a point within its cell, 0..1 along each axis.
    #[inline(always)]
    fn fraction(&self, x: &Vector<D>) -> Vector<D> {
        std::array::from_fn(|k| {
            let at = (x[k] - self.origin[k]) * self.inverse_edge;
            at - at.floor()
        })
    }

    /// The cells around `cell`, itself included, in the order of the stencil; `cell` must be an inner one.
    pub fn stencil(&self, cell: usize) -> impl Iterator<Item = usize> + '_ {
        self.row_offset.iter().flat_map(move |&row| (-1..=1).map(move |k| (cell as isize + row + k) as usize))
    }

    /// The rows of three cells around `cell`, by their middle.
    #[inline(always)]
    fn rows(&self, cell: usize) -> impl Iterator<Item = usize> + '_ {
        self.row_offset.iter().map(move |&row| (cell as isize + row) as usize)
    }
}

/// Points sorted by cell.
#[derive(Debug, Clone, Default)]
pub struct CellList<const D: usize> {
    /// First sorted point of each slice, `[4 cells + 1]`.
    start: Vec<u32>,
    /// Coordinates of the sorted points, one column per axis, m.
    coordinate: Vec<Vec<f64>>,
    /// Original number of each sorted point.
    order: Vec<u32>,
    slice_of: Vec<u32>,
}

const OUTSIDE: u32 = u32::MAX;

impl<const D: usize> CellList<D> {
    /// Sorts points by cell, stable (counting sort); points outside the grid are left out.
    pub fn sort(&mut self, grid: &Grid<D>, points: &[Vector<D>]) {
        self.slice_of.clear();
        let slice = |x| grid.cell(x).map_or(OUTSIDE, |cell| grid.slice(cell, x) as u32);
        self.slice_of.extend(points.iter().map(slice));
        let slices = SLICES * grid.len();
        // Two places further on, so that after the points are placed each start stands where it belongs.
        self.start.clear();
        self.start.resize(slices + 2, 0);
        for &slice in self.slice_of.iter().filter(|&&slice| slice != OUTSIDE) {
            self.start[slice as usize + 2] += 1;
        }
        for slice in 0..slices {
            self.start[slice + 2] += self.start[slice + 1];
        }
        self.order.clear();
        self.order.resize(self.start[slices + 1] as usize, 0);
        for (point, &slice) in self.slice_of.iter().enumerate().filter(|&(_, &slice)| slice != OUTSIDE) {
            let place = &mut self.start[slice as usize + 1];
            self.order[*place as usize] = point as u32;
            *place += 1;
        }
        self.coordinate.resize(D, Vec::new());
        for (k, column) in self.coordinate.iter_mut().enumerate() {
            column.clear();
            column.extend(self.order.iter().map(|&point| points[point as usize][k]));
            // The distance loop reads whole vectors.
            column.resize(column.len() + LANES, f64::INFINITY);
        }
    }

    /// Original number of each sorted point.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// A sorted point as it stood when it was sorted, m.
    #[inline(always)]
    pub fn point(&self, sorted: usize) -> Vector<D> {
        std::array::from_fn(|k| self.coordinate[k][sorted])
    }

    /// Sorted points of one cell.
    #[inline(always)]
    pub fn range(&self, cell: usize) -> std::ops::Range<usize> {
        self.start[SLICES * cell] as usize..self.start[SLICES * (cell + 1)] as usize
    }

    /// Whether any of the cells around `cell` holds a point.
    #[inline(always)]
    pub fn is_near(&self, grid: &Grid<D>, cell: usize) -> bool {
        grid.rows(cell).any(|middle| self.start[SLICES * (middle + 2)] > self.start[SLICES * (middle - 1)])
    }
}

/// The points within the support of one point; buffers are kept from call to call.
#[derive(Debug, Clone, Default)]
pub struct Neighbours {
    /// Sorted number of each neighbour.
    pub index: Vec<u32>,
    /// (r/h)^2 of each.
    pub q2: Vec<f32>,
    /// End of each stencil cell's share in the two columns.
    pub segment_end: [u32; STENCIL_MAX],
    count: usize,
    r2: Vec<f64>,
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

    /// Finds all points of `list` within `support` of `x`, itself included, in the order of the stencil.
    #[inline(always)]
    pub fn find<const D: usize>(
        &mut self,
        grid: &Grid<D>,
        list: &CellList<D>,
        at: (usize, &Vector<D>),
        (support2, inverse_h2): (f64, f32),
    ) {
        let (cell, x) = at;
        let fraction = grid.fraction(x);
        let reach2 = support2 * grid.inverse_edge * grid.inverse_edge;
        let mut count = 0;
        let gap2: [[f64; 3]; D] = std::array::from_fn(|k| {
            [fraction[k] * fraction[k], 0.0, (1.0 - fraction[k]) * (1.0 - fraction[k])]
        });
        for (row, middle) in grid.rows(cell).enumerate() {
            // Squared distance of the row from the point, in cell edges.
            let gap2 = if D == 2 { gap2[1][row] } else { gap2[1][row % 3] + gap2[D - 1][row / 3] };
            let rest2 = reach2 - gap2;
            if rest2 <= 0.0 {
                self.segment_end[3 * row..3 * row + 3].fill(count as u32);
                continue;
            }
            let reach = rest2.sqrt() + 1e-9;
            let slices = [fraction[0] - reach, fraction[0] + reach]
                .map(|at| ((at + 1.0) * SLICES as f64) as i32 as usize);
            let begin = SLICES * (middle - 1);
            let first = list.start[begin + slices[0]] as usize;
            let last = list.start[begin + (slices[1] + 1).min(3 * SLICES)] as usize;
            let ends = [SLICES, 2 * SLICES].map(|k| list.start[begin + k]);
            let found = last - first;
            if self.r2.len() < found + LANES {
                self.r2.resize(2 * (found + LANES), 0.0);
            }
            if self.index.len() < count + found {
                self.index.resize(2 * (count + found), 0);
                self.q2.resize(2 * (count + found), 0.0);
            }
            // Local slices: the columns cannot alias, their places need no reloading.
            let (r2, index, q2) = (
                &mut self.r2[..found.next_multiple_of(LANES)],
                &mut self.index[..count + found],
                &mut self.q2[..count + found],
            );
            squared_distances(list, first, x, r2);
            // Without a branch on the distance or at the cells' borders: both would be mispredicted half the time.
            let mut below = [count as u32; 2];
            for (candidate, &r2) in (first as u32..last as u32).zip(&*r2) {
                index[count] = candidate;
                q2[count] = r2 as f32 * inverse_h2;
                let hit = u32::from(r2 < support2);
                count += hit as usize;
                below[0] += hit & u32::from(candidate < ends[0]);
                below[1] += hit & u32::from(candidate < ends[1]);
            }
            self.segment_end[3 * row] = below[0];
            self.segment_end[3 * row + 1] = below[1];
            self.segment_end[3 * row + 2] = count as u32;
        }
        self.count = count;
    }
}

/// Squared distances of `x` from the points from `first` on, whole vectors.
#[inline(always)]
fn squared_distances<const D: usize>(list: &CellList<D>, first: usize, x: &Vector<D>, r2: &mut [f64]) {
    let count = r2.len();
    let column = |k: usize| list.coordinate[k][first..first + count].chunks_exact(LANES);
    let planes = column(0).zip(column(1));
    if D == 2 {
        for (r2, (a, b)) in r2.chunks_exact_mut(LANES).zip(planes) {
            for k in 0..LANES {
                let (dx, dy) = (x[0] - a[k], x[1] - b[k]);
                r2[k] = dx * dx + dy * dy;
            }
        }
    } else {
        for (r2, ((a, b), c)) in r2.chunks_exact_mut(LANES).zip(planes.zip(column(D - 1))) {
            for k in 0..LANES {
                let (dx, dy, dz) = (x[0] - a[k], x[1] - b[k], x[D - 1] - c[k]);
                r2[k] = dx * dx + dy * dy + dz * dz;
            }
        }
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
            near.find(&grid, &list, (cell, x), (0.17 * 0.17, 1.0));
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
