//! Wall particles of tank, obstacles and body: one set of columns, in this order.
//!
//! The tank is sorted by cell once. Obstacles and body keep their order in the columns (loads and Robin memory are per
//! particle) and are sorted through an index whenever they move.

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
    /// Unit vector across the body, turning with it, or across a thin obstacle; zero for the tank.
    pub director: Vec<Vector<D>>,
    /// 1 along the axes whose velocity counts at the particle, else 0: a tank particle stands for a slip wall and mirrors
    /// only the part normal to the faces it lies behind; a body particle mirrors all.
    pub facing: Vec<Vector<D>>,
    /// 1 where the wall takes part in the viscous term, 0 behind planes of symmetry.
    pub friction: Vec<f32>,
    /// Volume of the wall particle over that of a water particle; 0 for a tank particle another one stands in for.
    pub weight: Vec<f32>,
    /// Wall pressure on the lower and upper side of the director, Pa; the tank uses the first.
    pub pressure: Vec<[f32; 2]>,
    tank_len: usize,
    /// First column of the body.
    body_start: usize,
    tank_cells: CellList<D>,
    obstacles: MovingSet<D>,
    body: MovingSet<D>,
    /// Whether tank particles are near each cell.
    tank_near: Vec<bool>,
    switched_off: Vec<u32>,
}

/// A set of wall particles that may move.
#[derive(Debug, Default)]
struct MovingSet<const D: usize> {
    cells: CellList<D>,
    /// Cells it reaches, lower and upper corner; `None` if it is empty.
    reach: Option<([usize; D], [usize; D])>,
}

impl<const D: usize> MovingSet<D> {
    fn sort(&mut self, grid: &Grid<D>, position: &[Vector<D>]) {
        self.cells.sort(grid, position);
        self.reach = None;
        for x in position {
            let Some(cell) = grid.cell(x) else { continue };
            let at = grid.coordinates(cell);
            let (lower, upper) = self.reach.get_or_insert((at, at));
            for k in 0..D {
                lower[k] = lower[k].min(at[k]);
                upper[k] = upper[k].max(at[k]);
            }
        }
    }

    #[inline(always)]
    fn is_near(&self, grid: &Grid<D>, cell: usize) -> bool {
        let Some((lower, upper)) = self.reach else { return false };
        let at = grid.coordinates(cell);
        (0..D).all(|k| at[k] + 1 >= lower[k] && at[k] <= upper[k] + 1)
    }
}

/// Sets of wall particles: tank, obstacles, body.
pub const WALL_SETS: usize = 3;

/// One of the sorted sets, as the search sees it.
#[derive(Debug, Clone, Copy)]
pub struct WallSet<'a, const D: usize> {
    /// Sorted particles.
    pub cells: &'a CellList<D>,
    /// Whether the sorted numbers go through the list's order (obstacles, body) or are column numbers (tank).
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
    /// Sorts the tank's particles and appends room for `lens` particles of obstacles and body.
    pub fn new(grid: &Grid<D>, (tank, particles): (&Tank<D>, &[Vector<D>]), lens: (usize, usize)) -> Self {
        let mut walls = Self::default();
        walls.tank_cells.sort(grid, particles);
        walls.position.extend(walls.tank_cells.order().iter().map(|&k| particles[k as usize]));
        walls.tank_len = walls.position.len();
        walls.body_start = walls.tank_len + lens.0;
        let count = walls.body_start + lens.1;
        walls.position.resize(count, [0.0; D]);
        walls.velocity = vec![[0.0; D]; count];
        walls.acceleration = vec![[0.0; D]; count];
        walls.director = vec![[0.0; D]; count];
        let behind = |x: f64, k: usize| x < tank.min[k] || x > tank.max[k];
        let facing = |x: &Vector<D>| std::array::from_fn(|k| if behind(x[k], k) { 1.0 } else { 0.0 });
        walls.facing = walls.position[..walls.tank_len].iter().map(facing).collect();
        walls.facing.resize(count, [1.0; D]);
        walls.friction = vec![1.0; count];
        walls.weight = vec![1.0; count];
        walls.pressure = vec![[0.0; 2]; count];
        walls.mark_near_cells(grid);
        walls
    }

    /// Takes the friction from the tank's particles that stand behind planes of symmetry only.
    pub fn smooth(&mut self, tank: &Tank<D>, symmetry: &[[bool; 2]; D]) {
        for (x, friction) in self.position[..self.tank_len].iter().zip(&mut self.friction) {
            let behind = |k: usize| [x[k] < tank.min[k], x[k] > tank.max[k]];
            let rough = (0..D).any(|k| (0..2).any(|side| behind(k)[side] && !symmetry[k][side]));
            *friction = if rough { 1.0 } else { 0.0 };
        }
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

    /// Columns of the obstacles.
    pub fn obstacles(&self) -> Range<usize> {
        self.tank_len..self.body_start
    }

    /// Columns of the body.
    pub fn body(&self) -> Range<usize> {
        self.body_start..self.position.len()
    }

    /// Whether the scene has a body.
    pub fn has_body(&self) -> bool {
        self.body_start < self.position.len()
    }

    /// Sorts the obstacles after their particles were moved.
    pub fn sort_obstacles(&mut self, grid: &Grid<D>, spacing: f64) {
        self.obstacles.sort(grid, &self.position[self.tank_len..self.body_start]);
        self.switch_off_covered(grid, spacing);
    }

    /// Sorts the body after its particles were moved, and switches off tank particles within half of `spacing` of it.
    pub fn sort_body(&mut self, grid: &Grid<D>, spacing: f64) {
        self.body.sort(grid, &self.position[self.body_start..]);
        self.switch_off_covered(grid, spacing);
    }

    fn switch_off_covered(&mut self, grid: &Grid<D>, spacing: f64) {
        for &wall in &self.switched_off {
            self.weight[wall as usize] = 1.0;
        }
        self.switched_off.clear();
        for cover in self.tank_len..self.position.len() {
            let x = self.position[cover];
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

    /// The sets that have particles near a cell.
    #[inline(always)]
    pub fn sets_near(&self, grid: &Grid<D>, cell: usize) -> [Option<WallSet<'_, D>>; WALL_SETS] {
        let tank = WallSet { cells: &self.tank_cells, indirect: false, offset: 0 };
        let tank = self.tank_near[cell].then_some(tank);
        let sets = [(&self.obstacles, self.tank_len), (&self.body, self.body_start)];
        let [obstacles, body] = sets.map(|(set, start)| {
            let found = WallSet { cells: &set.cells, indirect: true, offset: start as u32 };
            set.is_near(grid, cell).then_some(found)
        });
        [tank, obstacles, body]
    }

    /// Side of the director on which water at `d` = x_i - x_w lies: 0 lower, 1 upper; always 0 for the tank.
    #[inline(always)]
    pub fn side(&self, wall: usize, d: &Vector<D>) -> usize {
        usize::from(wall >= self.tank_len && dot(d, &self.director[wall]) > 0.0)
    }
}
