//! Matrices of two or three rows, by value.

/// I.
#[inline]
pub(crate) fn unit<const D: usize>() -> [[f64; D]; D] {
    let mut unit = [[0.0; D]; D];
    for i in 0..D {
        unit[i][i] = 1.0;
    }
    unit
}

/// A'.
pub(crate) fn transpose<const D: usize>(a: &[[f64; D]; D]) -> [[f64; D]; D] {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// A B.
#[inline]
pub(crate) fn product<const D: usize>(a: &[[f64; D]; D], b: &[[f64; D]; D]) -> [[f64; D]; D] {
    let mut result = [[0.0; D]; D];
    for i in 0..D {
        for k in 0..D {
            for j in 0..D {
                result[i][j] += a[i][k] * b[k][j];
            }
        }
    }
    result
}

#[inline]
pub(crate) fn times<const D: usize>(matrix: &[[f64; D]; D], vector: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|i| dot(&matrix[i], vector))
}

#[inline]
pub(crate) fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let mut sum = 0.0;
    for i in 0..D {
        sum += a[i] * b[i];
    }
    sum
}

/// Determinant of a 2x2 or 3x3 matrix.
#[inline]
pub(crate) fn determinant<const D: usize>(m: &[[f64; D]; D]) -> f64 {
    if D == 2 {
        m[0][0] * m[1][1] - m[0][1] * m[1][0]
    } else {
        let minor = |i: usize, j: usize| m[1][i] * m[2][j] - m[1][j] * m[2][i];
        m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
    }
}

/// Inverse of a 2x2 or 3x3 matrix, by cofactors.
pub(crate) fn inverse<const D: usize>(m: &[[f64; D]; D]) -> [[f64; D]; D] {
    let determinant = determinant(m);
    let mut result = [[0.0; D]; D];
    for i in 0..D {
        for j in 0..D {
            result[j][i] = if D == 2 {
                let sign = if i == j { 1.0 } else { -1.0 };
                sign * m[1 - i][1 - j] / determinant
            } else {
                let (p, q, r, s) = ((i + 1) % D, (i + 2) % D, (j + 1) % D, (j + 2) % D);
                (m[p][r] * m[q][s] - m[p][s] * m[q][r]) / determinant
            };
        }
    }
    result
}
