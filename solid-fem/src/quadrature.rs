//! Quadrature of the cells.

use crate::cell::Cell;

/// A place in the cell and its share of the cell's volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadraturePoint {
    /// Own coordinates; unused ones are 0.
    pub at: [f64; 3],
    /// Weight in own coordinates.
    pub weight: f64,
}

impl Cell {
    /// Points of the stiffness: exact for the straight element, and full, so that no mode has zero energy.
    pub fn stiffness_rule(self) -> Vec<QuadraturePoint> {
        match self {
            Self::Triangle3 => centre(2),
            Self::Triangle6 => triangle(&[(1.0 / 6.0, 1.0 / 6.0)]),
            Self::Tetrahedron4 => centre(3),
            Self::Tetrahedron10 => tetrahedron(&[((5.0 - 5.0f64.sqrt()) / 20.0, 1.0 / 24.0)], None),
            _ => self.mass_rule(),
        }
    }

    /// Points of products of two shape functions.
    pub fn mass_rule(self) -> Vec<QuadraturePoint> {
        match self {
            Self::Triangle3 => triangle(&[(1.0 / 6.0, 1.0 / 6.0)]),
            // Dunavant 1985, degree 4.
            Self::Triangle6 => triangle(&[
                (0.445948490915965, 0.5 * 0.223381589678011),
                (0.091576213509771, 0.5 * 0.109951743655322),
            ]),
            Self::Tetrahedron4 => tetrahedron(&[((5.0 - 5.0f64.sqrt()) / 20.0, 1.0 / 24.0)], None),
            // Walkington 2000, degree 5.
            Self::Tetrahedron10 => tetrahedron(
                &[(0.3108859192633005, 0.01878132095300264), (0.09273525031089123, 0.01224884051939366)],
                Some((0.4544962958743506, 0.007091003462846911)),
            ),
            _ => self.gauss(if self.is_quadratic() { 3 } else { 2 }),
        }
    }

    /// Gauss points per axis; two of them in the order of the corners.
    fn gauss(self, count: usize) -> Vec<QuadraturePoint> {
        let (d, far) = (self.dimension(), 0.6f64.sqrt());
        if count == 2 {
            let near = 1.0 / 3.0f64.sqrt();
            let place = |corner: usize| self.node(corner).map(|x| near * x);
            return (0..self.corners()).map(|c| QuadraturePoint { at: place(c), weight: 1.0 }).collect();
        }
        let line = [(-far, 5.0 / 9.0), (0.0, 8.0 / 9.0), (far, 5.0 / 9.0)];
        let point = |number: usize| {
            let index = [number % 3, number / 3 % 3, number / 9];
            let at = std::array::from_fn(|i| if i < d { line[index[i]].0 } else { 0.0 });
            QuadraturePoint { at, weight: (0..d).map(|i| line[index[i]].1).product() }
        };
        (0..3usize.pow(d as u32)).map(point).collect()
    }
}

fn centre(dimension: usize) -> Vec<QuadraturePoint> {
    let at = std::array::from_fn(|i| if i < dimension { 1.0 / (dimension + 1) as f64 } else { 0.0 });
    vec![QuadraturePoint { at, weight: if dimension == 2 { 0.5 } else { 1.0 / 6.0 } }]
}

/// Orbits (a, a, 1 - 2a) with the weight of each of their three points.
fn triangle(orbits: &[(f64, f64)]) -> Vec<QuadraturePoint> {
    let point = |&(a, weight): &(f64, f64)| {
        let far = 1.0 - 2.0 * a;
        [[a, a], [far, a], [a, far]].map(|[x, y]| QuadraturePoint { at: [x, y, 0.0], weight })
    };
    orbits.iter().flat_map(point).collect()
}

/// Orbits (a, a, a, 1 - 3a), and one (a, a, 1/2 - a, 1/2 - a), with the weight of each of their points.
fn tetrahedron(orbits: &[(f64, f64)], pairs: Option<(f64, f64)>) -> Vec<QuadraturePoint> {
    let corner = |&(a, weight): &(f64, f64)| {
        let far = 1.0 - 3.0 * a;
        [[a, a, a], [far, a, a], [a, far, a], [a, a, far]].map(|at| QuadraturePoint { at, weight })
    };
    let edge = |(a, weight): (f64, f64)| {
        let b = 0.5 - a;
        [[a, a, b], [a, b, a], [b, a, a], [a, b, b], [b, a, b], [b, b, a]]
            .map(|at| QuadraturePoint { at, weight })
    };
    orbits.iter().flat_map(corner).chain(pairs.into_iter().flat_map(edge)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::ALL;

    /// Monomials up to the degree of the mass, and up to that of the stiffness.
    #[test]
    fn rules_are_exact_to_their_degree() {
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        let exact = |cell: Cell, p: [i32; 3]| {
            let d = cell.dimension();
            if cell.is_simplex() {
                let up: f64 = p[..d].iter().map(|&n| factorial(n)).product();
                return up / factorial(p.iter().sum::<i32>() + d as i32);
            }
            p[..d].iter().map(|&n| if n % 2 == 1 { 0.0 } else { 2.0 / f64::from(n + 1) }).product()
        };
        for cell in ALL {
            let order = if cell.is_quadratic() { 2 } else { 1 };
            for (rule, degree) in [(cell.mass_rule(), 2 * order), (cell.stiffness_rule(), 2 * order - 2)] {
                for p in (0..125).map(|n| [n % 5, n / 5 % 5, n / 25]) {
                    let unused = p[cell.dimension()..].iter().any(|&n| n > 0);
                    if unused || p.iter().sum::<i32>() > degree {
                        continue;
                    }
                    let value = |q: &QuadraturePoint| (0..3).map(|i| q.at[i].powi(p[i])).product::<f64>();
                    let sum: f64 = rule.iter().map(|q| q.weight * value(q)).sum();
                    assert!((sum - exact(cell, p)).abs() < 1e-14, "{cell:?} {p:?} {sum}");
                }
            }
        }
    }
}
