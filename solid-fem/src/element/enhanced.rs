//! Enhanced assumed strain: E = (H + H' + H'H)/2 + M alpha, with 2-point Gauss integration per axis.
//!
//! Source: J. C. Simo and M. S. Rifai, Int. J. Numer. Methods Eng. 29 (1990) 1595; in the Green-Lagrange strain
//! S. Klinkel and W. Wagner, ibid. 40 (1997) 4529. M(xi) = (det J0 / det J) T0 M_xi, T0 the transformation of a strain
//! from the element's axes to the global ones at its centre, which keeps the patch test.
//!
//! The parameters alpha make the enhanced work vanish, integral M'S = 0. St.Venant-Kirchhoff is linear in E and hence
//! in alpha: alpha = -Kaa^-1 integral M'C E(u) with a constant Kaa = integral M'C M, exact at any displacement. So
//! alpha is a function of u and is saved and restored with it; a law that is not linear would have to iterate here and
//! keep alpha with the state. Tangent: K - L Kaa^-1 L', L = integral B'C M.

use nalgebra::SMatrix;

use super::kinematics::{
    Point, SHEAR, deformation_gradient, determinant, green_lagrange_strain, inverse, mirror, product,
    stress_tensor,
};
use super::{Element, Inverted};
use crate::material::StVenantKirchhoff;
use crate::mesh::Mesh;

/// Strain modes in the element's own axes at a point: M_xi, `[S, A]`, engineering shear.
pub(super) type Modes<const D: usize, const S: usize, const A: usize> = fn(&[f64; D]) -> [[f64; A]; S];

/// Corner signs of the element in VTK order, `[N, D]`.
pub(super) type Corners<const D: usize, const N: usize> = [[f64; D]; N];

/// A quadrilateral (D 2, S 3, N 4) or hexahedron (D 3, S 6, N 8) with A enhanced modes; it has as many integration
/// points as corners.
pub struct Enhanced<const D: usize, const S: usize, const N: usize, const A: usize> {
    class: Vec<u32>,
    shapes: Vec<Shape<D, S, N, A>>,
    material: StVenantKirchhoff,
}

/// What depends on the reference shape only.
struct Shape<const D: usize, const S: usize, const N: usize, const A: usize> {
    points: [Point<D, N>; N],
    /// Shape functions at the points, `[points, N]`.
    values: [[f64; N]; N],
    /// M at the points.
    modes: [[[f64; A]; S]; N],
    /// w C M at the points, N m / m3 times volume.
    mode_stress: [[[f64; A]; S]; N],
    /// Lower triangular G with Kaa^-1 = G' G.
    root: [[f64; A]; A],
}

/// State of an element at a displacement: enhanced strains at the points.
struct Strained<const D: usize, const S: usize, const N: usize> {
    gradient: [[[f64; D]; D]; N],
    strain: [[f64; S]; N],
}

impl<const D: usize, const S: usize, const N: usize, const A: usize> Enhanced<D, S, N, A> {
    pub(super) fn new(
        mesh: &Mesh,
        material: StVenantKirchhoff,
        corners: &Corners<D, N>,
        modes: Modes<D, S, A>,
    ) -> Self {
        let (class, shapes) = mesh.shapes();
        let shapes = shapes.iter().map(|shape| Shape::new(shape, &material, corners, modes)).collect();
        Self { class, shapes, material }
    }

    fn shape(&self, element: usize) -> &Shape<D, S, N, A> {
        &self.shapes[self.class[element] as usize]
    }
}

impl<const D: usize, const S: usize, const N: usize, const A: usize> Shape<D, S, N, A> {
    fn new(
        position: &[f64],
        material: &StVenantKirchhoff,
        corners: &Corners<D, N>,
        modes: Modes<D, S, A>,
    ) -> Self {
        let gauss = 1.0 / 3.0f64.sqrt();
        let at = |q: usize| corners[q].map(|sign| sign * gauss);
        let centre = jacobian(position, corners, &[0.0; D]);
        let (centre_inverse, centre_determinant) = (inverse(&centre), determinant(&centre));
        let points = std::array::from_fn(|q| point(position, corners, &at(q)));
        let modes = std::array::from_fn(|q| {
            let scale = centre_determinant / determinant(&jacobian(position, corners, &at(q)));
            turn_modes(&modes(&at(q)), &centre_inverse, scale)
        });
        let mode_stress = std::array::from_fn(|q| mode_stress(material, &points[q], &modes[q]));
        let values = std::array::from_fn(|q| shape_values(corners, &at(q)));
        Self { points, values, root: root(&modes, &mode_stress), modes, mode_stress }
    }

    #[inline]
    fn strained(&self, displacement: &[f64]) -> Strained<D, S, N> {
        let gradient: [_; N] = std::array::from_fn(|q| self.points[q].displacement_gradient(displacement));
        let mut strain: [[f64; S]; N] = std::array::from_fn(|q| green_lagrange_strain(&gradient[q]));
        let mut work = [0.0; A];
        for q in 0..N {
            for s in 0..S {
                for m in 0..A {
                    work[m] += self.mode_stress[q][s][m] * strain[q][s];
                }
            }
        }
        let (mut half, mut alpha) = ([0.0; A], [0.0; A]);
        for m in 0..A {
            for k in 0..=m {
                half[m] += self.root[m][k] * work[k];
            }
        }
        for m in 0..A {
            for k in m..A {
                alpha[m] -= self.root[k][m] * half[k];
            }
        }
        for q in 0..N {
            for s in 0..S {
                for m in 0..A {
                    strain[q][s] += self.modes[q][s][m] * alpha[m];
                }
            }
        }
        Strained { gradient, strain }
    }

    /// L G', `[N D, A]`: L_(a,i),m = sum_q (F T_m)_ij g_aj, T_m the tensor of column m of w C M.
    #[inline]
    fn coupling(&self, deformation: &[[[f64; D]; D]; N], coupling: &mut [[[f64; A]; D]; N]) {
        for q in 0..N {
            let mut turned = [[[0.0; A]; D]; D];
            for i in 0..D {
                for j in 0..D {
                    for k in 0..D {
                        let row = &self.mode_stress[q][voigt::<D>(k, j)];
                        for m in 0..A {
                            turned[i][j][m] += deformation[q][i][k] * row[m];
                        }
                    }
                }
            }
            for a in 0..N {
                for i in 0..D {
                    for j in 0..D {
                        let g = self.points[q].gradient[a][j];
                        for m in 0..A {
                            coupling[a][i][m] += g * turned[i][j][m];
                        }
                    }
                }
            }
        }
        for row in coupling.as_flattened_mut() {
            let plain = *row;
            for m in 0..A {
                row[m] = 0.0;
                for k in 0..=m {
                    row[m] += self.root[m][k] * plain[k];
                }
            }
        }
    }
}

impl<const D: usize, const S: usize, const N: usize, const A: usize> Element for Enhanced<D, S, N, A> {
    fn internal_force(
        &self,
        element: usize,
        displacement: &[f64],
        force: &mut [f64],
    ) -> Result<(), Inverted> {
        let shape = self.shape(element);
        let state = shape.strained(displacement);
        force.fill(0.0);
        for q in 0..N {
            let deformation = deformation_gradient(&state.gradient[q])?;
            let stress = self.material.second_pk_stress::<D, S>(&state.strain[q]);
            shape.points[q].add_force(&product(&deformation, &stress_tensor(&stress)), force);
        }
        Ok(())
    }

    fn tangent(
        &self,
        element: usize,
        displacement: &[f64],
        force: &mut [f64],
        tangent: &mut [f64],
    ) -> Result<(), Inverted> {
        let shape = self.shape(element);
        let state = shape.strained(displacement);
        force.fill(0.0);
        tangent.fill(0.0);
        let mut deformation = [[[0.0; D]; D]; N];
        for q in 0..N {
            deformation[q] = deformation_gradient(&state.gradient[q])?;
            let stress = stress_tensor(&self.material.second_pk_stress::<D, S>(&state.strain[q]));
            shape.points[q].add_force(&product(&deformation[q], &stress), force);
            shape.points[q].add_tangent(&self.material, &deformation[q], &stress, tangent);
        }
        let mut coupling = [[[0.0; A]; D]; N];
        shape.coupling(&deformation, &mut coupling);
        let rows = coupling.as_flattened();
        for (row, left) in rows.iter().enumerate() {
            for (column, right) in rows.iter().enumerate().skip(row / D * D) {
                let mut sum = 0.0;
                for m in 0..A {
                    sum += left[m] * right[m];
                }
                tangent[row * N * D + column] -= sum;
            }
        }
        mirror::<D, N>(tangent);
        Ok(())
    }

    fn strain_energy(&self, element: usize, displacement: &[f64]) -> f64 {
        let shape = self.shape(element);
        let state = shape.strained(displacement);
        (0..N).map(|q| shape.points[q].weight * self.material.energy_density::<D, S>(&state.strain[q])).sum()
    }

    /// By the element's own integration rule; exact for parallelepipeds.
    fn shape_product(&self, element: usize, product: &mut [f64]) {
        let shape = self.shape(element);
        product.fill(0.0);
        for q in 0..N {
            for a in 0..N {
                for b in 0..N {
                    product[a * N + b] += shape.points[q].weight * shape.values[q][a] * shape.values[q][b];
                }
            }
        }
    }
}

/// Voigt number of a tensor component.
#[inline]
const fn voigt<const D: usize>(i: usize, j: usize) -> usize {
    if i == j {
        i
    } else if i + j == 1 {
        D
    } else if i + j == 3 {
        D + 1
    } else {
        D + 2
    }
}

fn shape_values<const D: usize, const N: usize>(corners: &Corners<D, N>, xi: &[f64; D]) -> [f64; N] {
    std::array::from_fn(|a| (0..D).map(|i| 0.5 * (1.0 + corners[a][i] * xi[i])).product())
}

/// Derivatives by the element's own coordinates, `[N, D]`.
fn shape_derivatives<const D: usize, const N: usize>(
    corners: &Corners<D, N>,
    xi: &[f64; D],
) -> [[f64; D]; N] {
    let factor = |a: usize, i: usize| 0.5 * (1.0 + corners[a][i] * xi[i]);
    std::array::from_fn(|a| {
        std::array::from_fn(|j| {
            let others: f64 = (0..D).filter(|&i| i != j).map(|i| factor(a, i)).product();
            0.5 * corners[a][j] * others
        })
    })
}

/// J_ij = dX_i / dxi_j, m.
fn jacobian<const D: usize, const N: usize>(
    position: &[f64],
    corners: &Corners<D, N>,
    xi: &[f64; D],
) -> [[f64; D]; D] {
    let derivatives = shape_derivatives(corners, xi);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..N).map(|a| position[a * D + i] * derivatives[a][j]).sum())
    })
}

fn point<const D: usize, const N: usize>(
    position: &[f64],
    corners: &Corners<D, N>,
    xi: &[f64; D],
) -> Point<D, N> {
    let jacobian = jacobian(position, corners, xi);
    let inverse = inverse(&jacobian);
    let derivatives = shape_derivatives(corners, xi);
    let gradient = std::array::from_fn(|a| {
        std::array::from_fn(|i| (0..D).map(|j| derivatives[a][j] * inverse[j][i]).sum())
    });
    Point { weight: determinant(&jacobian), gradient }
}

/// M = scale T0 M_xi: every mode as a tensor, E = J0^-T E_xi J0^-1.
fn turn_modes<const D: usize, const S: usize, const A: usize>(
    modes: &[[f64; A]; S],
    inverse: &[[f64; D]; D],
    scale: f64,
) -> [[f64; A]; S] {
    let mut turned = [[0.0; A]; S];
    for m in 0..A {
        let own = |k: usize, l: usize| modes[voigt::<D>(k, l)][m] * if k == l { 1.0 } else { 0.5 };
        let component = |i: usize, j: usize| {
            let mut sum = 0.0;
            for k in 0..D {
                for l in 0..D {
                    sum += inverse[k][i] * own(k, l) * inverse[l][j];
                }
            }
            scale * sum
        };
        for i in 0..D {
            turned[i][m] = component(i, i);
        }
        for shear in D..S {
            let (i, j) = SHEAR[shear - D];
            turned[shear][m] = 2.0 * component(i, j);
        }
    }
    turned
}

fn mode_stress<const D: usize, const S: usize, const N: usize, const A: usize>(
    material: &StVenantKirchhoff,
    point: &Point<D, N>,
    modes: &[[f64; A]; S],
) -> [[f64; A]; S] {
    let mut result = [[0.0; A]; S];
    for m in 0..A {
        let stress = material.second_pk_stress::<D, S>(&std::array::from_fn(|s| modes[s][m]));
        for s in 0..S {
            result[s][m] = point.weight * stress[s];
        }
    }
    result
}

/// G lower triangular with Kaa^-1 = G' G, by the Cholesky factor of Kaa = integral M'C M.
fn root<const S: usize, const N: usize, const A: usize>(
    modes: &[[[f64; A]; S]; N],
    mode_stress: &[[[f64; A]; S]; N],
) -> [[f64; A]; A] {
    let mut stiffness = SMatrix::<f64, A, A>::zeros();
    for q in 0..N {
        for (mode, stress) in modes[q].iter().zip(&mode_stress[q]) {
            for m in 0..A {
                for n in 0..A {
                    stiffness[(m, n)] += mode[m] * stress[n];
                }
            }
        }
    }
    let factor = stiffness.cholesky().expect("independent modes have a positive definite stiffness").l();
    let mut root = [[0.0; A]; A];
    for column in 0..A {
        for row in column..A {
            let known: f64 = (column..row).map(|k| factor[(row, k)] * root[k][column]).sum();
            root[row][column] = (if row == column { 1.0 } else { 0.0 } - known) / factor[(row, row)];
        }
    }
    root
}
