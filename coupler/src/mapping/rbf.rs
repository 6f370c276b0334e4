//! Radial basis functions: the motion between the nodes is sum_j c_j phi(|x - x_j|) + a linear polynomial, Wendland's C2
//! function phi (Wendland, Adv. Comput. Math. 4, 1995) over the size of the body, conditions as Beckert & Wendland
//! (Aerosp. Sci. Technol. 5, 2001). Rigid motion, force and moment are exact, on curved surfaces as well.
//!
//! One row h of H solves A' (h, .) = (phi(x - x_j), 1, x): its last equations say that h keeps constants and linear
//! fields. Dense: cost n^3 once, n per point and step.

use nalgebra::{DMatrix, DVector, Matrix3, SymmetricEigen, Vector3};
use protocol::interface::Surface;

use super::{MappingError, Rows};

/// Most nodes a dense matrix is made for (128 MB).
const LIMIT: usize = 4000;
/// Extent below which the surface has none in a direction, relative to its size.
const FLAT: f64 = 1e-9;

pub(super) fn rows(points: &[f64], surface: &Surface) -> Result<Rows, MappingError> {
    let nodes: Vec<_> = surface.reference_position.chunks_exact(surface.dimension).map(padded).collect();
    if nodes.len() > LIMIT {
        return Err(MappingError::TooManyNodes { count: nodes.len(), limit: LIMIT });
    }
    let basis = Basis::new(&nodes);
    let size = nodes.len() + basis.len();
    let mut matrix = DMatrix::zeros(size, size);
    for (column, node) in nodes.iter().enumerate() {
        matrix.column_mut(column).copy_from(&basis.at(node, &nodes));
    }
    for row in nodes.len()..size {
        for column in 0..nodes.len() {
            matrix[(column, row)] = matrix[(row, column)];
        }
    }
    // Symmetric, so A' is A.
    let factors = matrix.clone().lu();
    let row = |point: &[f64]| {
        let right = basis.at(&padded(point), &nodes);
        let mut solution = factors.solve(&right).ok_or(MappingError::Coincident)?;
        // One step of refinement: the conditions on constants and linear fields then hold to round-off.
        let rest = &right - &matrix * &solution;
        solution += factors.solve(&rest).ok_or(MappingError::Coincident)?;
        Ok(solution.iter().take(nodes.len()).copied().enumerate().collect())
    };
    points.chunks_exact(surface.dimension).map(row).collect()
}

fn padded(point: &[f64]) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| point.get(axis).copied().unwrap_or_default())
}

/// Scale and place of the basis functions, and the directions the surface extends in.
struct Basis {
    centre: Vector3<f64>,
    radius: f64,
    directions: Vec<Vector3<f64>>,
}

impl Basis {
    fn new(nodes: &[Vector3<f64>]) -> Self {
        let centre = nodes.iter().sum::<Vector3<f64>>() / nodes.len().max(1) as f64;
        let extent = nodes.iter().map(|node| (node - centre).norm()).fold(0.0, f64::max);
        let mut spread = Matrix3::zeros();
        for node in nodes {
            let arm = (node - centre) / extent.max(f64::MIN_POSITIVE);
            spread += arm * arm.transpose();
        }
        let axes = SymmetricEigen::new(spread);
        let extends = |&axis: &usize| axes.eigenvalues[axis] > FLAT * FLAT * nodes.len() as f64;
        let directions = (0..3).filter(extends).map(|axis| axes.eigenvectors.column(axis).into()).collect();
        Self { centre, radius: 2.0 * extent.max(f64::MIN_POSITIVE), directions }
    }

    /// Number of polynomial terms.
    fn len(&self) -> usize {
        1 + self.directions.len()
    }

    /// phi(|x - x_j|) for all nodes, then 1 and the coordinates of x along the directions.
    fn at(&self, point: &Vector3<f64>, nodes: &[Vector3<f64>]) -> DVector<f64> {
        let radial = nodes.iter().map(|node| wendland_c2((point - node).norm() / self.radius));
        let arm = (point - self.centre) / self.radius;
        let linear = self.directions.iter().map(|direction| direction.dot(&arm));
        let count = nodes.len() + self.len();
        DVector::from_iterator(count, radial.chain(std::iter::once(1.0)).chain(linear))
    }
}

/// (1 - r)^4 (4 r + 1) inside the support.
fn wendland_c2(r: f64) -> f64 {
    let inside = (1.0 - r).max(0.0);
    inside.powi(4) * (4.0 * r + 1.0)
}
