use super::*;
use crate::box_grid::BoxGrid;

const MATERIAL: (f64, f64) = (1000.0, 0.3);

/// A small box of 2 x 2 (x 2) cells, inner nodes moved; deterministic "random" numbers.
fn distorted(kind: ElementKind) -> (Mesh, Vec<bool>) {
    let grid = BoxGrid {
        dimension: kind.dimension(),
        minimum: [0.0; 3],
        maximum: [1.0, 1.2, 0.9],
        cells: [3, 3, 3],
    };
    let mut mesh = if kind.is_simplex() { Mesh::of_simplices(&grid) } else { Mesh::of_boxes(&grid) };
    let d = mesh.dimension;
    let mut seed = 1u64;
    let inner: Vec<bool> = mesh
        .reference_position
        .chunks_exact(d)
        .map(|x| (0..d).all(|i| x[i] > 1e-9 && x[i] < grid.maximum[i] - 1e-9))
        .collect();
    for node in 0..mesh.node_count() {
        for axis in 0..d {
            let shift = 0.12 * random(&mut seed) / 3.0 * 2.0;
            if inner[node] {
                mesh.reference_position[node * d + axis] += shift;
            }
        }
    }
    (mesh, inner)
}

/// In (-1, 1), Knuth's multiplier.
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

fn total_force(mesh: &Mesh, element: &dyn Element, displacement: &[f64]) -> Vec<f64> {
    let d = mesh.dimension;
    let mut total = vec![0.0; displacement.len()];
    let mut force = vec![0.0; mesh.nodes_per_element * d];
    for e in 0..mesh.element_count() {
        let u: Vec<f64> =
            mesh.element(e).iter().flat_map(|&n| displacement[n * d..n * d + d].iter().copied()).collect();
        element.internal_force(e, &u, &mut force).unwrap();
        for (a, &node) in mesh.element(e).iter().enumerate() {
            for i in 0..d {
                total[node * d + i] += force[a * d + i];
            }
        }
    }
    total
}

fn affine(mesh: &Mesh, h: &[[f64; 3]; 3]) -> Vec<f64> {
    let d = mesh.dimension;
    mesh.reference_position
        .chunks_exact(d)
        .flat_map(|x| (0..d).map(|i| (0..d).map(|j| h[i][j] * x[j]).sum()).collect::<Vec<f64>>())
        .collect()
}

/// Patch test at finite strain: under an affine displacement the inner nodes are in balance.
#[test]
fn patch_test_at_finite_strain() {
    let h = [[0.2, 0.3, -0.1], [-0.15, -0.1, 0.25], [0.05, 0.1, 0.3]];
    for kind in ElementKind::ALL {
        let (mesh, inner) = distorted(kind);
        let element = kind.build(&mesh, StVenantKirchhoff::new(1.0, MATERIAL.0, MATERIAL.1));
        let force = total_force(&mesh, element.as_ref(), &affine(&mesh, &h));
        let largest = force.iter().fold(0.0f64, |m, f| m.max(f.abs()));
        for (node, _) in inner.iter().enumerate().filter(|(_, inner)| **inner) {
            for i in 0..mesh.dimension {
                let out = force[node * mesh.dimension + i] / largest;
                assert!(out.abs() < 1e-12, "{} node {node}: {out:e}", kind.name());
            }
        }
    }
}

#[test]
fn a_rotation_by_one_radian_gives_no_stress() {
    let (s, c) = 1.0f64.sin_cos();
    let h = [[c - 1.0, -s, 0.0], [s, c - 1.0, 0.0], [0.0, 0.0, 0.0]];
    for kind in ElementKind::ALL {
        let (mesh, _) = distorted(kind);
        let element = kind.build(&mesh, StVenantKirchhoff::new(1.0, MATERIAL.0, MATERIAL.1));
        let force = total_force(&mesh, element.as_ref(), &affine(&mesh, &h));
        let largest = force.iter().fold(0.0f64, |m, f| m.max(f.abs()));
        assert!(largest < 1e-13 * MATERIAL.0, "{}: {largest:e}", kind.name());
    }
}

/// Force against the derivative of the energy, tangent against the derivative of the force, symmetry.
#[test]
fn force_and_tangent_are_derivatives() {
    for kind in ElementKind::ALL {
        let (mesh, _) = distorted(kind);
        let element = kind.build(&mesh, StVenantKirchhoff::new(1.0, MATERIAL.0, MATERIAL.1));
        let size = mesh.nodes_per_element * mesh.dimension;
        let mut seed = 5;
        let u: Vec<f64> = (0..size).map(|_| 0.04 * random(&mut seed)).collect();
        let (mut force, mut tangent) = (vec![0.0; size], vec![0.0; size * size]);
        element.tangent(3, &u, &mut force, &mut tangent).unwrap();
        let scale = tangent.iter().fold(0.0f64, |m, k| m.max(k.abs()));
        let (mut up, mut down) = (vec![0.0; size], vec![0.0; size]);
        let step = 1e-5;
        for column in 0..size {
            let mut moved = u.clone();
            moved[column] = u[column] + step;
            element.internal_force(3, &moved, &mut up).unwrap();
            let energy_up = element.strain_energy(3, &moved);
            moved[column] = u[column] - step;
            element.internal_force(3, &moved, &mut down).unwrap();
            let energy = (energy_up - element.strain_energy(3, &moved)) / (2.0 * step);
            assert!((energy - force[column]).abs() < 1e-7 * scale, "{}", kind.name());
            for row in 0..size {
                let difference = (up[row] - down[row]) / (2.0 * step);
                let error = (difference - tangent[row * size + column]).abs() / scale;
                assert!(error < 1e-7, "{} {row} {column}: {error:e}", kind.name());
                let other = tangent[column * size + row];
                assert!((tangent[row * size + column] - other).abs() < 1e-13 * scale);
            }
        }
    }
}

/// At the strains of steel the force keeps its digits: linear in the displacement.
#[test]
fn small_strains_keep_their_digits() {
    for kind in ElementKind::ALL {
        let (mesh, _) = distorted(kind);
        let element = kind.build(&mesh, StVenantKirchhoff::new(1.0, 2.1e11, 0.3));
        let size = mesh.nodes_per_element * mesh.dimension;
        let mut seed = 9;
        let u: Vec<f64> = (0..size).map(|_| 1e-10 * random(&mut seed)).collect();
        let (mut force, mut tangent) = (vec![0.0; size], vec![0.0; size * size]);
        element.tangent(0, &vec![0.0; size], &mut force, &mut tangent).unwrap();
        element.internal_force(0, &u, &mut force).unwrap();
        let largest = force.iter().fold(0.0f64, |m, f| m.max(f.abs()));
        for row in 0..size {
            let linear: f64 = (0..size).map(|column| tangent[row * size + column] * u[column]).sum();
            assert!((linear - force[row]).abs() < 1e-8 * largest, "{}", kind.name());
        }
    }
}

#[test]
fn an_inverted_element_is_reported() {
    for kind in ElementKind::ALL {
        let (mesh, _) = distorted(kind);
        let element = kind.build(&mesh, StVenantKirchhoff::new(1.0, 1.0, 0.0));
        let turned: Vec<f64> = mesh
            .relative_position(0)
            .chunks(mesh.dimension)
            .flat_map(|x| x.iter().map(|x| -1.5 * x).collect::<Vec<_>>())
            .collect();
        let mut force = vec![0.0; turned.len()];
        let result = element.internal_force(0, &turned, &mut force);
        // In 2-D the point reflection is a rotation; reflect one axis instead.
        let result = if mesh.dimension == 2 {
            let flipped: Vec<f64> =
                mesh.relative_position(0).chunks(2).flat_map(|x| [-1.5 * x[0], 0.0]).collect();
            element.internal_force(0, &flipped, &mut force)
        } else {
            result
        };
        assert!(matches!(result, Err(Inverted(determinant)) if determinant < 0.0), "{}", kind.name());
    }
}

#[test]
fn mass_is_the_volume() {
    for kind in ElementKind::ALL {
        let (mesh, _) = distorted(kind);
        let element = kind.build(&mesh, StVenantKirchhoff::new(1.0, 1.0, 0.0));
        let mut product = vec![0.0; mesh.nodes_per_element * mesh.nodes_per_element];
        let mut volume = 0.0;
        for e in 0..mesh.element_count() {
            element.shape_product(e, &mut product);
            volume += product.iter().sum::<f64>();
        }
        let expected = if mesh.dimension == 2 { 1.2 } else { 1.2 * 0.9 };
        assert!((volume - expected).abs() < 1e-12, "{}: {volume}", kind.name());
    }
}
