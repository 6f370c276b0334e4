//! Cells of the reference element: shape functions, their derivatives, quadrature, edges and faces.
//!
//! Nodes stand in VTK's order, which is also that of Abaqus and CalculiX; faces are numbered as there, outward:
//! counter-clockwise seen from outside in 3-D, with the normal on the right of the way in 2-D. Simplices have the
//! corners 0 and the unit vectors, the others those of [-1, 1]^D.

/// Most nodes a cell has.
pub const MAX_NODES: usize = 20;

/// Shape of an element or of a facet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Cell {
    /// Line, linear.
    Segment2,
    /// Line, quadratic.
    Segment3,
    /// Triangle, linear.
    Triangle3,
    /// Triangle, quadratic.
    Triangle6,
    /// Quadrilateral, bilinear.
    Quadrilateral4,
    /// Quadrilateral, serendipity.
    Quadrilateral8,
    /// Tetrahedron, linear.
    Tetrahedron4,
    /// Tetrahedron, quadratic.
    Tetrahedron10,
    /// Hexahedron, trilinear.
    Hexahedron8,
    /// Hexahedron, serendipity.
    Hexahedron20,
}

/// Shape functions at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// N_a, `[N]`; the rest is 0.
    pub value: [f64; MAX_NODES],
    /// dN_a / dxi_j, `[N, D]`; the rest is 0.
    pub derivative: [[f64; 3]; MAX_NODES],
}

const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

const HEXAHEDRON_EDGES: [(usize, usize); 12] =
    [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)];

impl Cell {
    /// 1, 2 or 3.
    pub fn dimension(self) -> usize {
        match self {
            Self::Segment2 | Self::Segment3 => 1,
            Self::Triangle3 | Self::Triangle6 | Self::Quadrilateral4 | Self::Quadrilateral8 => 2,
            _ => 3,
        }
    }

    /// Number of nodes.
    pub fn nodes(self) -> usize {
        match self {
            Self::Segment2 => 2,
            Self::Segment3 | Self::Triangle3 => 3,
            Self::Quadrilateral4 | Self::Tetrahedron4 => 4,
            Self::Triangle6 => 6,
            Self::Quadrilateral8 | Self::Hexahedron8 => 8,
            Self::Tetrahedron10 => 10,
            Self::Hexahedron20 => 20,
        }
    }

    /// Number of corners; they are the first nodes.
    pub fn corners(self) -> usize {
        self.linear().nodes()
    }

    /// The cell of the same outline with corners only.
    pub fn linear(self) -> Self {
        match self {
            Self::Segment3 => Self::Segment2,
            Self::Triangle6 => Self::Triangle3,
            Self::Quadrilateral8 => Self::Quadrilateral4,
            Self::Tetrahedron10 => Self::Tetrahedron4,
            Self::Hexahedron20 => Self::Hexahedron8,
            linear => linear,
        }
    }

    /// The cell of the same outline with a node in the middle of each edge.
    pub fn quadratic(self) -> Self {
        match self {
            Self::Segment2 => Self::Segment3,
            Self::Triangle3 => Self::Triangle6,
            Self::Quadrilateral4 => Self::Quadrilateral8,
            Self::Tetrahedron4 => Self::Tetrahedron10,
            Self::Hexahedron8 => Self::Hexahedron20,
            quadratic => quadratic,
        }
    }

    /// Whether it has nodes in the middle of its edges.
    pub fn is_quadratic(self) -> bool {
        self.linear() != self
    }

    /// Whether it is a triangle or tetrahedron.
    pub fn is_simplex(self) -> bool {
        matches!(self.linear(), Self::Triangle3 | Self::Tetrahedron4)
    }

    /// VTK's number of the cell.
    pub fn vtk(self) -> u8 {
        match self {
            Self::Segment2 => 3,
            Self::Segment3 => 21,
            Self::Triangle3 => 5,
            Self::Triangle6 => 22,
            Self::Quadrilateral4 => 9,
            Self::Quadrilateral8 => 23,
            Self::Tetrahedron4 => 10,
            Self::Tetrahedron10 => 24,
            Self::Hexahedron8 => 12,
            Self::Hexahedron20 => 25,
        }
    }

    /// Corners at both ends of each edge, in the order of the nodes in their middle.
    pub fn edges(self) -> &'static [(usize, usize)] {
        match self.linear() {
            Self::Segment2 => &[(0, 1)],
            Self::Triangle3 => &[(0, 1), (1, 2), (2, 0)],
            Self::Quadrilateral4 => &[(0, 1), (1, 2), (2, 3), (3, 0)],
            Self::Tetrahedron4 => &[(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
            _ => &HEXAHEDRON_EDGES,
        }
    }

    /// Shape of its faces.
    pub fn facet(self) -> Self {
        match self {
            Self::Triangle3 | Self::Quadrilateral4 => Self::Segment2,
            Self::Triangle6 | Self::Quadrilateral8 => Self::Segment3,
            Self::Tetrahedron4 => Self::Triangle3,
            Self::Tetrahedron10 => Self::Triangle6,
            Self::Hexahedron8 => Self::Quadrilateral4,
            Self::Hexahedron20 => Self::Quadrilateral8,
            segment => segment,
        }
    }

    /// Corners of its faces, outward.
    pub fn face_corners(self) -> &'static [&'static [usize]] {
        match self.linear() {
            Self::Triangle3 => &[&[0, 1], &[1, 2], &[2, 0]],
            Self::Quadrilateral4 => &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
            Self::Tetrahedron4 => &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[2, 0, 3]],
            Self::Hexahedron8 => {
                &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]]
            }
            _ => &[],
        }
    }

    /// All nodes of one of its faces, in the order of [`Self::facet`].
    pub fn face_nodes(self, face: usize) -> Vec<usize> {
        let mut nodes = self.face_corners()[face].to_vec();
        if self.is_quadratic() {
            let corners = nodes.clone();
            for &(a, b) in self.facet().edges() {
                let (a, b) = (corners[a], corners[b]);
                let edge = self.edges().iter().position(|&(c, d)| (a, b) == (c, d) || (a, b) == (d, c));
                nodes.push(self.corners() + edge.expect("the edge of a face is one of the cell"));
            }
        }
        nodes
    }

    /// Own coordinates of a node.
    pub fn node(self, node: usize) -> [f64; 3] {
        let corner = |corner: usize| {
            let mut at = [0.0; 3];
            if self.is_simplex() {
                if corner > 0 {
                    at[corner - 1] = 1.0;
                }
            } else {
                at[..self.dimension()].copy_from_slice(&CORNERS[corner][..self.dimension()]);
            }
            at
        };
        match node.checked_sub(self.corners()) {
            None => corner(node),
            Some(edge) => {
                let (a, b) = self.edges()[edge];
                let (a, b) = (corner(a), corner(b));
                std::array::from_fn(|i| 0.5 * (a[i] + b[i]))
            }
        }
    }

    /// Shape functions and derivatives at a place.
    pub fn shape(self, at: &[f64; 3]) -> Shape {
        let mut shape = Shape { value: [0.0; MAX_NODES], derivative: [[0.0; 3]; MAX_NODES] };
        match (self.is_simplex(), self.is_quadratic()) {
            (true, quadratic) => self.simplex(at, quadratic, &mut shape),
            (false, false) => self.tensor(at, &mut shape),
            (false, true) => self.serendipity(at, &mut shape),
        }
        shape
    }

    fn simplex(self, at: &[f64; 3], quadratic: bool, shape: &mut Shape) {
        let d = self.dimension();
        let l = |a: usize| if a == 0 { 1.0 - at[..d].iter().sum::<f64>() } else { at[a - 1] };
        let slope = |a: usize, j: usize| if a == 0 { -1.0 } else { f64::from(u8::from(a - 1 == j)) };
        for a in 0..=d {
            shape.value[a] = if quadratic { l(a) * (2.0 * l(a) - 1.0) } else { l(a) };
            for j in 0..d {
                shape.derivative[a][j] = slope(a, j) * if quadratic { 4.0 * l(a) - 1.0 } else { 1.0 };
            }
        }
        for (edge, &(a, b)) in self.edges().iter().enumerate().filter(|_| quadratic) {
            shape.value[d + 1 + edge] = 4.0 * l(a) * l(b);
            for j in 0..d {
                shape.derivative[d + 1 + edge][j] = 4.0 * (l(a) * slope(b, j) + l(b) * slope(a, j));
            }
        }
    }

    fn tensor(self, at: &[f64; 3], shape: &mut Shape) {
        let d = self.dimension();
        for a in 0..self.corners() {
            let factor = |i: usize| 0.5 * (1.0 + CORNERS[a][i] * at[i]);
            shape.value[a] = (0..d).map(factor).product();
            for j in 0..d {
                let others: f64 = (0..d).filter(|&i| i != j).map(factor).product();
                shape.derivative[a][j] = 0.5 * CORNERS[a][j] * others;
            }
        }
    }

    fn serendipity(self, at: &[f64; 3], shape: &mut Shape) {
        let d = self.dimension();
        self.tensor(at, shape);
        for a in 0..self.corners() {
            let sum = (0..d).map(|i| CORNERS[a][i] * at[i]).sum::<f64>() - (d as f64 - 1.0);
            for j in 0..d {
                shape.derivative[a][j] = shape.derivative[a][j] * sum + shape.value[a] * CORNERS[a][j];
            }
            shape.value[a] *= sum;
        }
        for edge in self.corners()..self.nodes() {
            let middle = self.node(edge);
            let factor = |i: usize| match middle[i] == 0.0 {
                true => (1.0 - at[i] * at[i], -2.0 * at[i]),
                false => (0.5 * (1.0 + middle[i] * at[i]), 0.5 * middle[i]),
            };
            shape.value[edge] = (0..d).map(|i| factor(i).0).product();
            for j in 0..d {
                let others: f64 = (0..d).filter(|&i| i != j).map(|i| factor(i).0).product();
                shape.derivative[edge][j] = factor(j).1 * others;
            }
        }
    }
}

/// Every cell.
#[cfg(test)]
pub(crate) const ALL: [Cell; 10] = [
    Cell::Segment2,
    Cell::Segment3,
    Cell::Triangle3,
    Cell::Triangle6,
    Cell::Quadrilateral4,
    Cell::Quadrilateral8,
    Cell::Tetrahedron4,
    Cell::Tetrahedron10,
    Cell::Hexahedron8,
    Cell::Hexahedron20,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shape_functions_are_one_at_their_node_and_sum_to_one() {
        for cell in ALL {
            for a in 0..cell.nodes() {
                let shape = cell.shape(&cell.node(a));
                for b in 0..cell.nodes() {
                    assert!((shape.value[b] - f64::from(u8::from(a == b))).abs() < 1e-14, "{cell:?} {a} {b}");
                }
            }
            let at = [0.21, 0.17, 0.3];
            let shape = cell.shape(&at);
            assert!((shape.value.iter().sum::<f64>() - 1.0).abs() < 1e-14);
            for j in 0..cell.dimension() {
                let step = 1e-6;
                let moved = |by: f64| {
                    let mut at = at;
                    at[j] += by;
                    cell.shape(&at).value
                };
                let (up, down) = (moved(step), moved(-step));
                for a in 0..cell.nodes() {
                    let slope = (up[a] - down[a]) / (2.0 * step);
                    assert!((slope - shape.derivative[a][j]).abs() < 1e-8, "{cell:?} {a} {j}");
                }
            }
        }
    }
}
