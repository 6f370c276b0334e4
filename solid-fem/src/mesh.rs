//! The finite element mesh: nodes, elements of one kind, named faces.

use std::collections::HashMap;

use crate::box_grid::{BoxGrid, Face};
use crate::cell::Cell;

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

/// Nodes, connectivity and named faces.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// 2 or 3.
    pub dimension: usize,
    /// Shape of the elements.
    pub cell: Cell,
    /// Node positions of the unloaded body, `[n, D]` m.
    pub reference_position: Vec<f64>,
    /// Nodes of each element, `[elements, nodes_per_element]`.
    pub connectivity: Vec<usize>,
    /// Faces and sets of nodes that supports and loads name.
    pub faces: Vec<NamedFace>,
}

/// Part of the surface, or a set of nodes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NamedFace {
    /// Its name.
    pub name: String,
    /// Nodes of its facets, outward, `[facets, nodes per facet]`; empty for a set of nodes.
    pub facets: Vec<usize>,
    /// Its nodes, ascending.
    pub nodes: Vec<usize>,
}

impl NamedFace {
    /// The face made of these facets.
    pub fn of_facets(name: &str, facets: Vec<usize>) -> Self {
        let mut nodes = facets.clone();
        nodes.sort_unstable();
        nodes.dedup();
        Self { name: name.to_owned(), facets, nodes }
    }
}

impl Mesh {
    /// The box in cells of this shape, its sides named as those of [`Face`].
    pub fn of_box(grid: &BoxGrid, cell: Cell) -> Self {
        let mut mesh = if cell.is_simplex() { Self::of_simplices(grid) } else { Self::of_boxes(grid) };
        let sides = Face::ALL.iter().take(2 * grid.dimension);
        let facets = |face: Face| grid.facets(&[face], cell.is_simplex()).nodes;
        mesh.faces = sides.map(|&face| NamedFace::of_facets(face.name(), facets(face))).collect();
        if cell.is_quadratic() { mesh.into_quadratic() } else { mesh }
    }

    fn of_boxes(grid: &BoxGrid) -> Self {
        Self {
            dimension: grid.dimension,
            cell: if grid.dimension == 2 { Cell::Quadrilateral4 } else { Cell::Hexahedron8 },
            reference_position: grid.reference_position(),
            connectivity: grid.connectivity(),
            faces: Vec::new(),
        }
    }

    /// Triangles (2 a cell) or tetrahedra (6 a cell) around one diagonal of the cell (Kuhn 1960); neighbouring cells are
    /// mirror images of each other, so that they fit and no direction is preferred.
    fn of_simplices(grid: &BoxGrid) -> Self {
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
        let cell = if d == 2 { Cell::Triangle3 } else { Cell::Tetrahedron4 };
        Self { dimension: d, cell, reference_position, connectivity, faces: Vec::new() }
    }

    /// The same mesh with a node in the middle of every edge; sets of nodes take the middles between two of theirs.
    pub fn into_quadratic(mut self) -> Self {
        let (d, linear, cell) = (self.dimension, self.cell, self.cell.quadratic());
        let mut middles: HashMap<(usize, usize), usize> = HashMap::new();
        let mut connectivity = Vec::with_capacity(self.element_count() * cell.nodes());
        for element in 0..self.element_count() {
            let corners = &self.connectivity[element * linear.nodes()..][..linear.nodes()];
            connectivity.extend_from_slice(corners);
            for &(a, b) in linear.edges() {
                let edge = (corners[a].min(corners[b]), corners[a].max(corners[b]));
                let position = &mut self.reference_position;
                connectivity.push(*middles.entry(edge).or_insert_with(|| {
                    for axis in 0..d {
                        position.push(0.5 * (position[edge.0 * d + axis] + position[edge.1 * d + axis]));
                    }
                    position.len() / d - 1
                }));
            }
        }
        for face in &mut self.faces {
            let facet = linear.facet();
            let mut facets = Vec::new();
            for corners in face.facets.chunks_exact(facet.nodes()) {
                facets.extend_from_slice(corners);
                let ends = facet.edges().iter().map(|&(a, b)| (corners[a], corners[b]));
                facets.extend(ends.map(|(a, b)| middles[&(a.min(b), a.max(b))]));
            }
            let holds = |node: &usize| face.nodes.binary_search(node).is_ok();
            let between = middles.iter().filter(|((a, b), _)| holds(a) && holds(b)).map(|(_, &node)| node);
            let mut nodes: Vec<usize> = if facets.is_empty() { between.collect() } else { facets.clone() };
            nodes.extend_from_slice(&face.nodes);
            nodes.sort_unstable();
            nodes.dedup();
            (face.facets, face.nodes) = (facets, nodes);
        }
        (self.cell, self.connectivity) = (cell, connectivity);
        self
    }

    /// Names the plane sides of the bounding box after [`Face`], but for names there are already: a face is the part of
    /// the surface within a millionth of the body's size of the plane.
    pub fn name_plane_sides(&mut self) {
        let (low, high) = self.bounding_box();
        let size = (0..self.dimension).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
        let boundary = self.boundary();
        let per_facet = self.cell.facet().nodes();
        for face in Face::ALL.into_iter().take(2 * self.dimension) {
            let axis = face.axis();
            let plane = if face.sign() > 0.0 { high[axis] } else { low[axis] };
            let is_on = |&node: &usize| {
                (self.reference_position[node * self.dimension + axis] - plane).abs() <= 1e-6 * size
            };
            let on_plane = boundary.chunks_exact(per_facet).filter(|facet| facet.iter().all(is_on));
            let facets: Vec<usize> = on_plane.flatten().copied().collect();
            if !facets.is_empty() && self.face(face.name()).is_none() {
                self.faces.push(NamedFace::of_facets(face.name(), facets));
            }
        }
    }

    /// Facets that belong to one element only, outward, `[facets, nodes per facet]`.
    pub fn boundary(&self) -> Vec<usize> {
        let mut owners: HashMap<Vec<usize>, u32> = HashMap::new();
        let key = |element: usize, face: &[usize]| {
            let nodes = self.element(element);
            let mut key: Vec<usize> = face.iter().map(|&corner| nodes[corner]).collect();
            key.sort_unstable();
            key
        };
        for element in 0..self.element_count() {
            for face in self.cell.face_corners() {
                *owners.entry(key(element, face)).or_default() += 1;
            }
        }
        let mut facets = Vec::new();
        for element in 0..self.element_count() {
            for (number, face) in self.cell.face_corners().iter().enumerate() {
                if owners[&key(element, face)] == 1 {
                    let nodes = self.element(element);
                    facets.extend(self.cell.face_nodes(number).iter().map(|&node| nodes[node]));
                }
            }
        }
        facets
    }

    /// The face or set of this name.
    pub fn face(&self, name: &str) -> Option<&NamedFace> {
        self.faces.iter().find(|face| face.name == name)
    }

    /// Least and greatest coordinates, m; 0 along an axis the mesh does not have.
    pub fn bounding_box(&self) -> ([f64; 3], [f64; 3]) {
        let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
        for axis in 0..self.dimension {
            let along = || self.reference_position.iter().skip(axis).step_by(self.dimension).copied();
            (low[axis], high[axis]) =
                (along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max));
        }
        (low, high)
    }

    /// Shortest edge between the corners of an element, m.
    pub fn shortest_edge(&self) -> f64 {
        let mut shortest = f64::INFINITY;
        for element in 0..self.element_count() {
            let x = self.relative_position(element);
            for &(a, b) in self.cell.edges() {
                let square: f64 = (0..self.dimension)
                    .map(|i| (x[a * self.dimension + i] - x[b * self.dimension + i]).powi(2))
                    .sum();
                shortest = shortest.min(square);
            }
        }
        shortest.sqrt()
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.reference_position.len() / self.dimension
    }

    /// Number of elements.
    pub fn element_count(&self) -> usize {
        self.connectivity.len() / self.nodes_per_element()
    }

    /// Nodes per element.
    pub fn nodes_per_element(&self) -> usize {
        self.cell.nodes()
    }

    /// The nodes of one element.
    pub fn element(&self, element: usize) -> &[usize] {
        &self.connectivity[element * self.nodes_per_element()..(element + 1) * self.nodes_per_element()]
    }

    /// Node positions of one element relative to its first node, `[N, D]` m.
    pub fn relative_position(&self, element: usize) -> Vec<f64> {
        let (d, nodes) = (self.dimension, self.element(element));
        let at = |node: usize, axis: usize| self.reference_position[node * d + axis];
        nodes.iter().flat_map(|&node| (0..d).map(move |axis| at(node, axis) - at(nodes[0], axis))).collect()
    }

    /// Elements sorted by shape: the class of each element, `[elements]`, and one element's relative positions per
    /// class. Elements that are translations of each other (to 1e-10 of their size) share a class, so a box of equal
    /// cells stores few shapes; a mesh of many shapes stores one per element.
    pub fn shapes(&self) -> (Vec<u32>, Vec<Vec<f64>>) {
        let mut shapes: Vec<Vec<f64>> = Vec::new();
        let mut known: HashMap<Vec<i64>, u32> = HashMap::new();
        let mut class = Vec::with_capacity(self.element_count());
        for element in 0..self.element_count() {
            let shape = self.relative_position(element);
            let size = shape.iter().fold(0.0f64, |size, x| size.max(x.abs()));
            // Sizes that differ by round-off must round to one key.
            let unit = 1e-10 * 2.0f64.powi(size.log2().round() as i32);
            let key = shape.iter().map(|x| (x / unit).round() as i64).collect();
            class.push(*known.entry(key).or_insert_with(|| {
                shapes.push(shape);
                shapes.len() as u32 - 1
            }));
        }
        (class, shapes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_has_few_shapes_and_closed_sides() {
        let grid =
            BoxGrid { dimension: 3, minimum: [0.0; 3], maximum: [0.012, 0.08, 0.292], cells: [3, 20, 73] };
        let tetrahedra = Mesh::of_box(&grid, Cell::Tetrahedron4);
        assert!(tetrahedra.shapes().1.len() <= 48);
        let mesh = Mesh::of_box(&BoxGrid { cells: [2, 3, 4], ..grid }, Cell::Tetrahedron10);
        let facets: usize = mesh.faces.iter().map(|face| face.facets.len()).sum();
        assert_eq!(mesh.boundary().len(), facets);
        let mut anew = mesh.clone();
        anew.faces.clear();
        anew.name_plane_sides();
        for (old, new) in mesh.faces.iter().zip(&anew.faces) {
            assert_eq!((&old.name, &old.nodes), (&new.name, &new.nodes));
        }
    }
}
