//! Order of convergence in L2, on the exact solution u = grad phi with phi harmonic: it balances without body force for
//! any constants. The boundary moves exactly, the inside is solved.

use super::*;
use crate::assembly::{Assembly, At};
use crate::box_grid::BoxGrid;
use crate::linear::block_matrix::BlockMatrix;
use crate::linear::cholesky::Cholesky;

/// phi = exp(x) cos y in the plane, exp(r x) cos y cos z with r^2 = 2 in space.
fn exact(x: &[f64]) -> [f64; 3] {
    if let [x, y] = x {
        return [x.exp() * y.cos(), -x.exp() * y.sin(), 0.0];
    }
    let (r, [x, y, z]) = (2.0f64.sqrt(), [x[0], x[1], x[2]]);
    let e = (r * x).exp();
    [r * e * y.cos() * z.cos(), -e * y.sin() * z.cos(), -e * y.cos() * z.sin()]
}

/// L2 error of a mesh of `cells` per axis, its inner nodes shifted so that the elements are no boxes.
fn error(kind: ElementKind, cells: usize) -> f64 {
    let d = kind.dimension();
    let grid = BoxGrid { dimension: d, minimum: [0.0; 3], maximum: [1.0; 3], cells: [cells; 3] };
    let mut mesh = Mesh::of_box(&grid, kind.cell().linear());
    for x in mesh.reference_position.chunks_exact_mut(d) {
        let bump: f64 = x.iter().map(|x| (std::f64::consts::PI * x).sin()).product();
        x.iter_mut().enumerate().for_each(|(i, x)| *x += 0.05 * bump * (1.0 + i as f64));
    }
    if kind.cell().is_quadratic() {
        mesh = mesh.into_quadratic();
    }
    let mut displacement: Vec<f64> =
        mesh.reference_position.chunks_exact(d).flat_map(|x| exact(x)[..d].to_vec()).collect();
    let mut is_fixed = vec![false; displacement.len()];
    let boundary = mesh.boundary();
    boundary.iter().for_each(|&node| is_fixed[node * d..node * d + d].fill(true));
    displacement.iter_mut().zip(&is_fixed).filter(|(_, fixed)| !**fixed).for_each(|(u, _)| *u = 0.0);
    let linear = Substance { kinematics: Kinematics::Linear, ..tests::elastic(1.0, 0.3) };
    let mut assembly = Assembly::new(mesh.clone(), kind.build(&mesh, &linear));
    let mut stiffness = BlockMatrix::zeros(&assembly.pattern);
    let history = vec![0.0; assembly.history_len()];
    assembly.tangent(At { displacement: &displacement, history: &history }, &mut stiffness).unwrap();
    let mut residual = vec![0.0; displacement.len()];
    stiffness.multiply(&displacement, &mut residual);
    residual.iter_mut().zip(&is_fixed).for_each(|(r, fixed)| *r = if *fixed { 0.0 } else { -*r });
    stiffness.fix(&is_fixed);
    let mut factor = Cholesky::new(&stiffness.pattern, &mesh.reference_position);
    factor.factorize(&stiffness).unwrap();
    factor.solve(&mut residual);
    displacement.iter_mut().zip(&residual).for_each(|(u, du)| *u += du);
    l2_error(&mesh, &displacement)
}

fn l2_error(mesh: &Mesh, displacement: &[f64]) -> f64 {
    let (d, mut sum) = (mesh.dimension, 0.0);
    let rule = mesh.cell.quadratic().mass_rule();
    for element in 0..mesh.element_count() {
        for q in &rule {
            let shape = mesh.cell.shape(&q.at);
            let mut difference = [0.0; 3];
            let (mut x, mut jacobian) = (vec![0.0; d], [[0.0; 3]; 3]);
            jacobian[2][2] = if d == 2 { 1.0 } else { 0.0 };
            for (a, &node) in mesh.element(element).iter().enumerate() {
                for i in 0..d {
                    let position = mesh.reference_position[node * d + i];
                    x[i] += shape.value[a] * position;
                    difference[i] += shape.value[a] * displacement[node * d + i];
                    for j in 0..d {
                        jacobian[i][j] += shape.derivative[a][j] * position;
                    }
                }
            }
            let exact = exact(&x);
            let square: f64 = (0..d).map(|i| (difference[i] - exact[i]).powi(2)).sum();
            sum += q.weight * matrix::determinant(&jacobian) * square;
        }
    }
    sum.sqrt()
}

/// Linear and enhanced elements 2, quadratic ones 3.
#[test]
fn elements_converge_at_their_order() {
    let mut orders = Vec::new();
    for kind in ElementKind::ALL {
        let expected = if kind.cell().is_quadratic() { 3.0 } else { 2.0 };
        let cells = match (kind.dimension(), kind.cell().is_quadratic()) {
            (2, _) => 16,
            (_, true) => 6,
            (_, false) => 10,
        };
        let order = (error(kind, cells / 2) / error(kind, cells)).log2();
        // In space the meshes are still coarse: the 20-node hexahedron comes down to 3 from above.
        let tolerance = if kind.dimension() == 2 { 0.1 } else { 0.25 };
        orders.push((kind.name(), expected, order, (order - expected).abs() < tolerance));
    }
    assert!(orders.iter().all(|row| row.3), "{orders:?}");
}
