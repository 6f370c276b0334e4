//! An axis-aligned box cut into equal cells: nodes, cells and named faces.
//!
//! Nodes are numbered x fastest, then y, then z. Cells are quadrilaterals or hexahedra in VTK order. This is all that
//! `solid-rigid` needs of this crate.

pub use protocol::case::BoxFace as Face;
use protocol::interface::{Facets, Surface};

/// The box and its cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxGrid {
    /// 2 or 3.
    pub dimension: usize,
    /// Lower corner, m; z not used in 2-D.
    pub minimum: [f64; 3],
    /// Upper corner, m; z not used in 2-D.
    pub maximum: [f64; 3],
    /// Cells per axis; z not used in 2-D.
    pub cells: [usize; 3],
}

impl BoxGrid {
    /// Length along an axis, m.
    pub fn extent(&self, axis: usize) -> f64 {
        self.maximum[axis] - self.minimum[axis]
    }

    fn cells_along(&self, axis: usize) -> usize {
        if axis < self.dimension { self.cells[axis] } else { 0 }
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        (0..3).map(|axis| self.cells_along(axis) + 1).product()
    }

    /// Number of quadrilaterals or hexahedra.
    pub fn cell_count(&self) -> usize {
        (0..self.dimension).map(|axis| self.cells[axis]).product()
    }

    /// Number of the node at a grid point.
    pub fn node(&self, at: [usize; 3]) -> usize {
        at[0] + (self.cells_along(0) + 1) * (at[1] + (self.cells_along(1) + 1) * at[2])
    }

    /// Node positions, `[n, D]` m.
    pub fn reference_position(&self) -> Vec<f64> {
        let mut position = Vec::with_capacity(self.node_count() * self.dimension);
        for at in self.grid_points([0; 3], [0, 1, 2].map(|axis| self.cells_along(axis) + 1)) {
            for axis in 0..self.dimension {
                let fraction = at[axis] as f64 / self.cells[axis] as f64;
                position.push(self.minimum[axis] + fraction * self.extent(axis));
            }
        }
        position
    }

    /// Corners of all cells in VTK order, `[cells, 2^D]`.
    pub fn connectivity(&self) -> Vec<usize> {
        const CORNERS: [[usize; 3]; 8] =
            [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
        let corners = &CORNERS[..1 << self.dimension];
        self.cell_coordinates()
            .flat_map(|at| corners.iter().map(move |c| self.node([at[0] + c[0], at[1] + c[1], at[2] + c[2]])))
            .collect()
    }

    /// Grid coordinates of the lowest corner of each cell.
    pub(crate) fn cell_coordinates(&self) -> impl Iterator<Item = [usize; 3]> {
        self.grid_points([0; 3], [0, 1, 2].map(|axis| self.cells_along(axis).max(1)))
    }

    /// Nodes on a face, ascending.
    pub fn face_nodes(&self, face: Face) -> Vec<usize> {
        let (mut low, mut high) = ([0; 3], [0, 1, 2].map(|axis| self.cells_along(axis) + 1));
        let at = if is_upper(face) { self.cells[face.axis()] } else { 0 };
        (low[face.axis()], high[face.axis()]) = (at, at + 1);
        self.grid_points(low, high).map(|at| self.node(at)).collect()
    }

    /// Facets of the named faces in global node numbers, outward: segments, quadrilaterals, or triangles when
    /// `triangulated` (cut as `Mesh::of_simplices` cuts the cells).
    pub fn facets(&self, faces: &[Face], triangulated: bool) -> Facets {
        let mut facets = Facets { nodes_per_facet: self.nodes_per_facet(triangulated), ..Facets::default() };
        for &face in faces {
            if self.dimension == 2 {
                self.push_segments(face, &mut facets);
            } else {
                self.push_quadrilaterals(face, triangulated, &mut facets);
            }
        }
        facets
    }

    /// The surface that travels: the named faces with their nodes numbered compactly in ascending order of the node
    /// number, and those node numbers, `[n]`. `areal_mass` in kg/m2 is given to every node.
    pub fn surface(&self, faces: &[Face], triangulated: bool, areal_mass: f64) -> (Surface, Vec<usize>) {
        let mut facets = self.facets(faces, triangulated);
        let mut nodes = facets.nodes.clone();
        nodes.sort_unstable();
        nodes.dedup();
        for node in &mut facets.nodes {
            *node = nodes.binary_search(node).expect("the list was made of these nodes");
        }
        let position = self.reference_position();
        let d = self.dimension;
        let reference_position =
            nodes.iter().flat_map(|&node| position[node * d..(node + 1) * d].iter().copied()).collect();
        let areal_mass = vec![areal_mass; nodes.len()];
        (Surface { dimension: d, reference_position, facets, areal_mass }, nodes)
    }

    fn nodes_per_facet(&self, triangulated: bool) -> usize {
        match (self.dimension, triangulated) {
            (2, _) => 2,
            (_, true) => 3,
            (_, false) => 4,
        }
    }

    fn push_segments(&self, face: Face, facets: &mut Facets) {
        let along = 1 - face.axis();
        // The outward normal (dy, -dx) lies on the right of a -> b.
        let upwards = matches!(face, Face::Right | Face::Bottom);
        for cell in 0..self.cells[along] {
            let mut at = [0; 3];
            at[face.axis()] = if is_upper(face) { self.cells[face.axis()] } else { 0 };
            at[along] = cell;
            let first = self.node(at);
            at[along] = cell + 1;
            let second = self.node(at);
            facets.nodes.extend(if upwards { [first, second] } else { [second, first] });
            facets.face.push(face as usize);
        }
    }

    fn push_quadrilaterals(&self, face: Face, triangulated: bool, facets: &mut Facets) {
        let (b, c) = ((face.axis() + 1) % 3, (face.axis() + 2) % 3);
        let at = |i: usize, j: usize| {
            let mut at = [0; 3];
            at[face.axis()] = if is_upper(face) { self.cells[face.axis()] } else { 0 };
            (at[b], at[c]) = (i, j);
            self.node(at)
        };
        for j in 0..self.cells[c] {
            for i in 0..self.cells[b] {
                let mut corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                if !is_upper(face) {
                    corners.swap(1, 3);
                }
                if triangulated {
                    // The cut joins the corners of even grid coordinates to those of odd ones.
                    corners.rotate_left((i + j) % 2);
                    let [p, q, r, s] = corners;
                    facets.nodes.extend([p, q, r, p, r, s]);
                    facets.face.extend([face as usize; 2]);
                } else {
                    facets.nodes.extend(corners);
                    facets.face.push(face as usize);
                }
            }
        }
    }

    fn grid_points(&self, low: [usize; 3], high: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
        (low[2]..high[2])
            .flat_map(move |k| (low[1]..high[1]).flat_map(move |j| (low[0]..high[0]).map(move |i| [i, j, k])))
    }
}

fn is_upper(face: Face) -> bool {
    face.sign() > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(dimension: usize) -> BoxGrid {
        BoxGrid { dimension, minimum: [1.0, 2.0, 3.0], maximum: [2.0, 4.0, 6.0], cells: [2, 3, 4] }
    }

    /// Area vector of a facet, outward.
    fn area(position: &[f64], nodes: &[usize], d: usize) -> [f64; 3] {
        let x = |a: usize| {
            let mut x = [0.0; 3];
            x[..d].copy_from_slice(&position[nodes[a] * d..nodes[a] * d + d]);
            x
        };
        let minus = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
        if d == 2 {
            let t = minus(x(1), x(0));
            return [t[1], -t[0], 0.0];
        }
        let last = nodes.len() - 1;
        let (p, q) = if last == 3 {
            (minus(x(2), x(0)), minus(x(3), x(1)))
        } else {
            (minus(x(1), x(0)), minus(x(2), x(0)))
        };
        [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]].map(|c| 0.5 * c)
    }

    #[test]
    fn facets_point_outward_and_cover_their_face() {
        for (d, triangulated) in [(2, false), (3, false), (3, true)] {
            let grid = grid(d);
            let position = grid.reference_position();
            for face in &Face::ALL[..2 * d] {
                let facets = grid.facets(&[*face], triangulated);
                let mut sum = [0.0; 3];
                for facet in 0..facets.len() {
                    let area = area(&position, facets.facet(facet), d);
                    (0..3).for_each(|i| sum[i] += area[i]);
                }
                let size: f64 = (0..d).filter(|&a| a != face.axis()).map(|a| grid.extent(a)).product();
                let mut expected = [0.0; 3];
                expected[face.axis()] = if is_upper(*face) { size } else { -size };
                (0..3).for_each(|i| assert!((sum[i] - expected[i]).abs() < 1e-12, "{d} {face:?} {sum:?}"));
            }
        }
    }

    #[test]
    fn the_surface_numbers_its_nodes_compactly() {
        let (surface, nodes) = grid(2).surface(&[Face::Left, Face::Top], false, 7.0);
        assert_eq!(surface.node_count(), 4 + 3 - 1);
        assert_eq!(nodes.len(), surface.node_count());
        assert_eq!(surface.facets.len(), 3 + 2);
        assert_eq!(surface.reference_position[..2], [1.0, 2.0]);
        assert_eq!(surface.areal_mass, vec![7.0; 6]);
    }
}
