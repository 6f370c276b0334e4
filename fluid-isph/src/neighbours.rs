//! The points within the support of one point, eight at a time.
//!
//! The points of a cell stand side by side; the search takes eight of them at once and packs the hits without a branch.

use crate::cells::{CellList, Grid, Place, STENCIL_MAX};
use crate::kernel_shape::Shape;
use crate::lanes::{LANES, Lanes, PACKED, Portable};
use crate::vector::Vector;

/// Up to eight points of one cell that stand side by side.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
struct Strip {
    /// Their places as seen from the corner of the cell gathered; out of reach where there is none.
    place: [[f32; LANES]; 3],
    /// Sorted number of the first.
    first: u32,
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
        let (index, q2, reach2) = (&mut self.index[..room], &mut self.q2[..room], self.reach2);
        for (strip, end) in self.strips.iter().zip(&mut self.strip_end[1..]) {
            let mut r2 = [0.0f32; LANES];
            for k in 0..D {
                for lane in 0..LANES {
                    let d = x[k] - strip.place[k][lane];
                    r2[lane] += d * d;
                }
            }
            let hits = lanes.below(r2, reach2);
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
    pub fn weigh(&mut self, shape: impl Shape, factor: f32) -> f32 {
        let whole = self.count.next_multiple_of(LANES);
        let q2 = &mut self.q2[..whole];
        for (q2, slope) in q2.iter_mut().zip(&mut self.slope[..whole]) {
            let (w, f) = shape.evaluate(q2.sqrt());
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
