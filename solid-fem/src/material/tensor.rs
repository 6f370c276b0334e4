//! Symmetric tensors in Voigt order and their principal axes.

use nalgebra::{Matrix3, SymmetricEigen};

/// Pairs of axes in Voigt order.
pub const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)];

/// A symmetric tensor, `[3, 3]`.
pub type Tensor = [[f64; 3]; 3];

/// The unit tensor.
pub const UNIT: Tensor = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Tensor of a strain in Voigt order with engineering shear.
pub fn of_strain(voigt: &[f64; 6]) -> Tensor {
    let mut tensor = of_stress(voigt);
    for (i, row) in tensor.iter_mut().enumerate() {
        (0..3).filter(|&j| j != i).for_each(|j| row[j] *= 0.5);
    }
    tensor
}

/// Tensor of a stress in Voigt order.
pub fn of_stress(voigt: &[f64; 6]) -> Tensor {
    let mut tensor = [[0.0; 3]; 3];
    for (component, &(i, j)) in PAIRS.iter().enumerate() {
        (tensor[i][j], tensor[j][i]) = (voigt[component], voigt[component]);
    }
    tensor
}

/// Components of a symmetric tensor in Voigt order, shear not doubled.
pub fn voigt(tensor: &Tensor) -> [f64; 6] {
    PAIRS.map(|(i, j)| tensor[i][j])
}

/// A B.
pub fn product(a: &Tensor, b: &Tensor) -> Tensor {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Principal values and axes, `axes[a]` the unit vector of value a.
pub fn principal(tensor: &Tensor) -> ([f64; 3], [[f64; 3]; 3]) {
    let eigen = SymmetricEigen::new(Matrix3::from_fn(|i, j| tensor[i][j]));
    let axis = |a: usize| std::array::from_fn(|i| eigen.eigenvectors[(i, a)]);
    (std::array::from_fn(|a| eigen.eigenvalues[a]), std::array::from_fn(axis))
}

/// Sum of value_a n_a n_a.
pub fn compose(values: &[f64; 3], axes: &[[f64; 3]; 3]) -> Tensor {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..3).map(|a| values[a] * axes[a][i] * axes[a][j]).sum())
    })
}

/// Principal stresses, greatest first, and the equivalent stress of von Mises, of a stress in Voigt order.
pub fn invariants(stress: &[f64; 6]) -> ([f64; 3], f64) {
    let (mut values, _) = principal(&of_stress(stress));
    values.sort_by(|a, b| b.total_cmp(a));
    let [a, b, c] = values;
    (values, (0.5 * ((a - b).powi(2) + (b - c).powi(2) + (c - a).powi(2))).sqrt())
}
