//! The finite element mesh: nodes and elements of one kind.

use crate::box_grid::BoxGrid;

/// The simplices of a cell: the orders in which a path from its first corner to the opposite one takes the axes.
const PATHS_2D: [&[usize]; 2] = [&[0, 1], &[1, 0]];
const PATHS_3D: [&[usize]; 6] = [&[0, 1, 2], &[0, 2, 1], &[1, 0, 2], &[1, 2, 0], &[2, 0, 1], &[2, 1, 0]];

/// Nodes along the path through a cell that takes the axes in this order. It starts at the even corner: in cells of odd
/// number along an axis the path runs against it.
pub(crate) fn path(grid: &BoxGrid, cell: [usize; 3], axes: &[usize]) -> impl Iterator<Item = usize> {
    let mut at =
        std::array::from_fn(|axis| cell[axis] + (if axis < grid.dimension { cell[axis] % 2 } else { 0 }));
    let first = grid.node(at);
    std::iter::once(first).chain(axes.iter().map(move |&axis| {
        at[axis] = cell[axis] + 1 - cell[axis] % 2;
        grid.node(at)
    }))
}

/// Whether the simplex of a path has negative volume: odd permutations have, and every mirrored axis changes the sign.
fn is_left_handed(cell: [usize; 3], axes: &[usize]) -> bool {
    let swaps =
        (0..axes.len()).flat_map(|j| (0..j).map(move |i| (i, j))).filter(|&(i, j)| axes[i] > axes[j]).count();
    (swaps + axes.iter().map(|&axis| cell[axis] % 2).sum::<usize>()) % 2 == 1
}

/// Nodes and connectivity.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// 2 or 3.
    pub dimension: usize,
    /// Node positions of the unloaded body, `[n, D]` m.
    pub reference_position: Vec<f64>,
    /// Nodes per element.
    pub nodes_per_element: usize,
    /// Nodes of each element, `[elements, nodes_per_element]`.
    pub connectivity: Vec<usize>,
}

impl Mesh {
    /// Quadrilaterals or hexahedra of the box.
    pub fn of_boxes(grid: &BoxGrid) -> Self {
        Self {
            dimension: grid.dimension,
            reference_position: grid.reference_position(),
            nodes_per_element: 1 << grid.dimension,
            connectivity: grid.connectivity(),
        }
    }

    /// The same box in triangles (2 a cell) or tetrahedra (6 a cell) around one diagonal of the cell (Kuhn 1960);
    /// neighbouring cells are mirror images of each other, so that they fit and no direction is preferred.
    pub fn of_simplices(grid: &BoxGrid) -> Self {
        let d = grid.dimension;
        let mut connectivity = Vec::new();
        for cell in grid.cell_coordinates() {
            for axes in if d == 2 { &PATHS_2D[..] } else { &PATHS_3D[..] } {
                let first = connectivity.len();
                connectivity.extend(path(grid, cell, axes));
                if is_left_handed(cell, axes) {
                    connectivity.swap(first + 1, first + 2);
                }
            }
        }
        let reference_position = grid.reference_position();
        Self { dimension: d, reference_position, nodes_per_element: d + 1, connectivity }
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.reference_position.len() / self.dimension
    }

    /// Number of elements.
    pub fn element_count(&self) -> usize {
        self.connectivity.len() / self.nodes_per_element
    }

    /// The nodes of one element.
    pub fn element(&self, element: usize) -> &[usize] {
        &self.connectivity[element * self.nodes_per_element..(element + 1) * self.nodes_per_element]
    }

    /// Node positions of one element relative to its first node, `[N, D]` m.
    pub fn relative_position(&self, element: usize) -> Vec<f64> {
        let (d, nodes) = (self.dimension, self.element(element));
        let at = |node: usize, axis: usize| self.reference_position[node * d + axis];
        nodes.iter().flat_map(|&node| (0..d).map(move |axis| at(node, axis) - at(nodes[0], axis))).collect()
    }

    /// Elements sorted by shape: the class of each element, `[elements]`, and one element's relative positions per
    /// class. Elements that are translations of each other (to 1e-12 of their size) share a class, so a box of equal
    /// cells stores one shape; a mesh of many shapes stores one per element.
    pub fn shapes(&self) -> (Vec<u32>, Vec<Vec<f64>>) {
        const COMPARED: usize = 8;
        let mut shapes: Vec<Vec<f64>> = Vec::new();
        let mut class = Vec::with_capacity(self.element_count());
        for element in 0..self.element_count() {
            let shape = self.relative_position(element);
            let size = shape.iter().fold(0.0f64, |size, x| size.max(x.abs()));
            let same = |other: &Vec<f64>| shape.iter().zip(other).all(|(a, b)| (a - b).abs() <= 1e-12 * size);
            let found = shapes.iter().take(COMPARED).position(same);
            class.push(found.unwrap_or(shapes.len()) as u32);
            if found.is_none() {
                shapes.push(shape);
            }
        }
        (class, shapes)
    }
}
