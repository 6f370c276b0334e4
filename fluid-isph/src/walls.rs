//! Wall particles of tank and body: one set of columns, tank first, body behind it.
//!
//! The tank is sorted by cell once. The body keeps its order in the columns (loads and Robin memory are per particle)
//! and is sorted through an index whenever it moves.

use std::ops::Range;

use crate::cells::{CellList, Grid};
use crate::scene::Tank;
use crate::vector::{Vector, dot, norm, sub};

/// Columns of the wall particles, `[w]` each.
#[derive(Debug, Default)]
pub struct Walls<const D: usize> {
    /// x, m.
    pub position: Vec<Vector<D>>,
    /// v, m/s; zero for the tank.
    pub velocity: Vec<Vector<D>>,
    /// a that shifts the wall pressure, m/s2: of prescribed motion only.
    pub acceleration: Vec<Vector<D>>,
    /// Unit vector across the body, turning with it; zero for the tank.
    pub director: Vec<Vector<D>>,
    /// 1 along the axes whose velocity counts at the particle, else 0: a tank particle stands for a slip wall and mirrors
    /// only the part normal to the faces it lies behind; a body particle mirrors all.
    pub facing: Vec<Vector<D>>,
    /// Volume of the wall particle over that of a water particle; 0 for a tank particle the body stands in for.
    pub weight: Vec<f32>,
    /// Wall pressure on the lower and upper side of the director, Pa; the tank uses the first.
    pub pressure: Vec<[f32; 2]>,
    tank_len: usize,
    tank_cells: CellList<D>,
    body_cells: CellList<D>,
    /// Whether tank particles are near each cell.
    tank_near: Vec<bool>,
    /// Cells the body reaches, lower and upper corner; `None` without a body.
    body_box: Option<([usize; D], [usize; D])>,
    switched_off: Vec<u32>,
}

/// One of the two sorted sets, as the search sees it.
#[derive(Debug, Clone, Copy)]
pub struct WallSet<'a, const D: usize> {
    /// Sorted particles.
    pub cells: &'a CellList<D>,
    /// Whether the sorted numbers go through the list's order (body) or are column numbers (tank).
    indirect: bool,
    offset: u32,
}

impl<const D: usize> WallSet<'_, D> {
    /// Column number of a sorted particle.
    #[inline(always)]
    pub fn column(&self, sorted: u32) -> u32 {
        if self.indirect { self.offset + self.cells.order()[sorted as usize] } else { sorted }
    }
}

impl<const D: usize> Walls<D> {
    /// Sorts the tank's particles and appends room for `body_len` body particles.
    pub fn new(grid: &Grid<D>, (tank, particles): (&Tank<D>, &[Vector<D>]), body_len: usize) -> Self {
        let mut walls = Self::default();
        walls.tank_cells.sort(grid, particles);
        walls.position.extend(walls.tank_cells.order().iter().map(|&k| particles[k as usize]));
        walls.tank_len = walls.position.len();
        let count = walls.tank_len + body_len;
        walls.position.resize(count, [0.0; D]);
        walls.velocity = vec![[0.0; D]; count];
        walls.acceleration = vec![[0.0; D]; count];
        walls.director = vec![[0.0; D]; count];
        let behind = |x: f64, k: usize| x < tank.min[k] || x > tank.max[k];
        let facing = |x: &Vector<D>| std::array::from_fn(|k| if behind(x[k], k) { 1.0 } else { 0.0 });
        walls.facing = walls.position[..walls.tank_len].iter().map(facing).collect();
        walls.facing.resize(count, [1.0; D]);
        walls.weight = vec![1.0; count];
        walls.pressure = vec![[0.0; 2]; count];
        walls.mark_near_cells(grid);
        walls
    }

    fn mark_near_cells(&mut self, grid: &Grid<D>) {
        self.tank_near = vec![false; grid.len()];
        for cell in 0..grid.len() {
            let at = grid.coordinates(cell);
            let inner = (0..D).all(|k| at[k] > 0 && at[k] + 1 < grid.count()[k]);
            self.tank_near[cell] = inner && self.tank_cells.is_near(grid, cell);
        }
    }

    /// Number of wall particles.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether there is no wall particle.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Columns of the tank.
    pub fn tank(&self) -> Range<usize> {
        0..self.tank_len
    }

    /// Columns of the body.
    pub fn body(&self) -> Range<usize> {
        self.tank_len..self.position.len()
    }

    /// Whether the scene has a body.
    pub fn has_body(&self) -> bool {
        self.tank_len < self.position.len()
    }

    /// Sorts the body after its particles were moved, and switches off tank particles within half of `spacing` of it.
    pub fn sort_body(&mut self, grid: &Grid<D>, spacing: f64) {
        self.body_cells.sort(grid, &self.position[self.tank_len..]);
        self.body_box = None;
        for x in &self.position[self.tank_len..] {
            let Some(cell) = grid.cell(x) else { continue };
            let at = grid.coordinates(cell);
            let (lower, upper) = self.body_box.get_or_insert((at, at));
            for k in 0..D {
                lower[k] = lower[k].min(at[k]);
                upper[k] = upper[k].max(at[k]);
            }
        }
        self.switch_off_covered(grid, spacing);
    }

    fn switch_off_covered(&mut self, grid: &Grid<D>, spacing: f64) {
        for &wall in &self.switched_off {
            self.weight[wall as usize] = 1.0;
        }
        self.switched_off.clear();
        for body in self.tank_len..self.position.len() {
            let x = self.position[body];
            let Some(cell) = grid.inner_cell(&x) else { continue };
            if !self.tank_near[cell] {
                continue;
            }
            for near in grid.stencil(cell) {
                for wall in self.tank_cells.range(near) {
                    if self.weight[wall] > 0.0 && norm(&sub(&self.position[wall], &x)) < 0.5 * spacing {
                        self.weight[wall] = 0.0;
                        self.switched_off.push(wall as u32);
                    }
                }
            }
        }
    }

    /// The sets that have particles near a cell: tank, body, both or none.
    #[inline(always)]
    pub fn sets_near(&self, grid: &Grid<D>, cell: usize) -> [Option<WallSet<'_, D>>; 2] {
        let tank = WallSet { cells: &self.tank_cells, indirect: false, offset: 0 };
        let body = WallSet { cells: &self.body_cells, indirect: true, offset: self.tank_len as u32 };
        [self.tank_near[cell].then_some(tank), self.body_is_near(grid, cell).then_some(body)]
    }

    #[inline(always)]
    fn body_is_near(&self, grid: &Grid<D>, cell: usize) -> bool {
        let Some((lower, upper)) = self.body_box else { return false };
        let at = grid.coordinates(cell);
        (0..D).all(|k| at[k] + 1 >= lower[k] && at[k] <= upper[k] + 1)
    }

    /// Side of the director on which water at `d` = x_i - x_w lies: 0 lower, 1 upper; always 0 for the tank.
    #[inline(always)]
    pub fn side(&self, wall: usize, d: &Vector<D>) -> usize {
        usize::from(wall >= self.tank_len && dot(d, &self.director[wall]) > 0.0)
    }
}
