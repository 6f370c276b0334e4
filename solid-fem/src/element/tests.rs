use super::*;
use crate::box_grid::BoxGrid;
use crate::material::History;

const MODULUS: f64 = 1000.0;

/// Every law with every kinematics an element admits, in plane strain and plane stress.
fn substances(kind: ElementKind) -> Vec<Substance> {
    let laws = [
        LawKind::StVenantKirchhoff,
        LawKind::NeoHookean,
        LawKind::Plasticity { hardening: vec![(0.0, 20.0), (0.1, 40.0), (0.4, 60.0)] },
    ];
    let mut substances = Vec::new();
    for law in laws {
        for kinematics in Kinematics::ALL {
            for is_plane_stress in [false, true] {
                if kinematics == Kinematics::UpdatedLagrangian && kind.is_enhanced()
                    || is_plane_stress && kind.dimension() == 3
                {
                    continue;
                }
                let (law, poisson_ratio) = (law.clone(), 0.3);
                let young_modulus = MODULUS;
                substances.push(Substance { law, young_modulus, poisson_ratio, is_plane_stress, kinematics });
            }
        }
    }
    substances
}

pub(super) fn elastic(young_modulus: f64, poisson_ratio: f64) -> Substance {
    Substance {
        law: LawKind::StVenantKirchhoff,
        young_modulus,
        poisson_ratio,
        is_plane_stress: false,
        kinematics: Kinematics::TotalLagrangian,
    }
}

/// Height of the small box: the enhanced elements treat slender cells in a way of their own.
fn height(kind: ElementKind) -> f64 {
    if kind.is_enhanced() { 0.3 } else { 1.2 }
}

/// A small box of 3 x 3 (x 3) cells, inner nodes moved; deterministic "random" numbers.
fn distorted(kind: ElementKind) -> (Mesh, Vec<bool>) {
    let grid = BoxGrid {
        dimension: kind.dimension(),
        minimum: [0.0; 3],
        maximum: [1.0, height(kind), 0.9],
        cells: [3, 3, 3],
    };
    let mut mesh = Mesh::of_box(&grid, kind.cell().linear());
    let d = mesh.dimension;
    let mut seed = 1u64;
    let is_inner = |x: &[f64]| (0..d).all(|i| x[i] > 1e-9 && x[i] < grid.maximum[i] - 1e-9);
    for node in 0..mesh.node_count() {
        let inside = is_inner(&mesh.reference_position[node * d..node * d + d]);
        for axis in 0..d {
            let shift = 0.08 * random(&mut seed) * grid.maximum[axis];
            if inside {
                mesh.reference_position[node * d + axis] += shift;
            }
        }
    }
    let mesh = if kind.cell().is_quadratic() { mesh.into_quadratic() } else { mesh };
    let inner = mesh.reference_position.chunks_exact(d).map(is_inner).collect();
    (mesh, inner)
}

/// In (-1, 1), Knuth's multiplier.
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Force of a displacement on fresh material.
fn total_force(mesh: &Mesh, element: &dyn Element, displacement: &[f64]) -> Vec<f64> {
    let d = mesh.dimension;
    let mut total = vec![0.0; displacement.len()];
    let mut force = vec![0.0; mesh.nodes_per_element() * d];
    for e in 0..mesh.element_count() {
        let u = local(mesh, e, displacement);
        let (old, mut new) = fresh(element);
        element.internal_force(e, &u, History { old: &old, new: &mut new }, &mut force).unwrap();
        for (a, &node) in mesh.element(e).iter().enumerate() {
            for i in 0..d {
                total[node * d + i] += force[a * d + i];
            }
        }
    }
    total
}

fn fresh(element: &dyn Element) -> (Vec<f64>, Vec<f64>) {
    (vec![0.0; element.history_len()], vec![0.0; element.history_len()])
}

fn local(mesh: &Mesh, e: usize, displacement: &[f64]) -> Vec<f64> {
    let d = mesh.dimension;
    mesh.element(e).iter().flat_map(|&n| displacement[n * d..n * d + d].iter().copied()).collect()
}

fn affine(mesh: &Mesh, h: &[[f64; 3]; 3]) -> Vec<f64> {
    let d = mesh.dimension;
    mesh.reference_position
        .chunks_exact(d)
        .flat_map(|x| (0..d).map(|i| (0..d).map(|j| h[i][j] * x[j]).sum()).collect::<Vec<f64>>())
        .collect()
}

/// Patch test at finite strain: under an affine displacement the inner nodes are in balance, for every element, law and
/// kinematics.
#[test]
fn patch_test_at_finite_strain() {
    let h = [[0.2, 0.3, -0.1], [-0.15, -0.1, 0.25], [0.05, 0.1, 0.3]];
    for kind in ElementKind::ALL {
        let (mesh, inner) = distorted(kind);
        for substance in substances(kind) {
            let element = kind.build(&mesh, &substance);
            let force = total_force(&mesh, element.as_ref(), &affine(&mesh, &h));
            let largest = force.iter().fold(0.0f64, |m, f| m.max(f.abs()));
            for (node, _) in inner.iter().enumerate().filter(|(_, inner)| **inner) {
                for i in 0..mesh.dimension {
                    let out = force[node * mesh.dimension + i] / largest;
                    assert!(out.abs() < 1e-12, "{} {substance:?} node {node}: {out:e}", kind.name());
                }
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
        for substance in substances(kind) {
            if substance.kinematics == Kinematics::Linear {
                continue;
            }
            let element = kind.build(&mesh, &substance);
            let force = total_force(&mesh, element.as_ref(), &affine(&mesh, &h));
            let largest = force.iter().fold(0.0f64, |m, f| m.max(f.abs()));
            assert!(largest < 1e-13 * MODULUS, "{} {substance:?}: {largest:e}", kind.name());
        }
    }
}

/// The updated form is the total one in other words.
#[test]
fn updated_and_total_lagrangian_agree() {
    let h = [[0.2, 0.3, -0.1], [-0.15, -0.1, 0.25], [0.05, 0.1, 0.3]];
    for kind in ElementKind::ALL.into_iter().filter(|kind| !kind.is_enhanced()) {
        let (mesh, _) = distorted(kind);
        let u = local(&mesh, 3, &affine(&mesh, &h));
        for substance in substances(kind) {
            let result = |kinematics: Kinematics| {
                let element = kind.build(&mesh, &Substance { kinematics, ..substance.clone() });
                let (old, mut new) = fresh(element.as_ref());
                let (mut force, mut tangent) = (vec![0.0; u.len()], vec![0.0; u.len() * u.len()]);
                element.internal_force(3, &u, History { old: &old, new: &mut new }, &mut force).unwrap();
                element.tangent(3, &u, History { old: &old, new: &mut new }, &mut tangent).unwrap();
                (force, tangent)
            };
            let (total, updated) =
                (result(Kinematics::TotalLagrangian), result(Kinematics::UpdatedLagrangian));
            let close = |a: &[f64], b: &[f64]| {
                let scale = a.iter().fold(0.0f64, |m, k| m.max(k.abs()));
                a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12 * scale)
            };
            assert!(
                close(&total.0, &updated.0) && close(&total.1, &updated.1),
                "{} {substance:?}",
                kind.name()
            );
        }
    }
}

/// Force against the derivative of the energy, tangent against the derivative of the force, symmetry. Plastic points have
/// no energy whose derivative is the force; their tangent is that of the algorithm, after a first plastic step.
#[test]
fn force_and_tangent_are_derivatives() {
    for kind in ElementKind::ALL {
        let (mesh, _) = distorted(kind);
        for substance in substances(kind) {
            let element = kind.build(&mesh, &substance);
            let size = mesh.nodes_per_element() * mesh.dimension;
            let mut seed = 5;
            let u: Vec<f64> = (0..size).map(|_| height(kind) / 60.0 * random(&mut seed)).collect();
            let (old, mut kept) = fresh(element.as_ref());
            let mut force = vec![0.0; size];
            let first: Vec<f64> = u.iter().map(|u| 0.6 * u).collect();
            element.internal_force(3, &first, History { old: &old, new: &mut kept }, &mut force).unwrap();
            let (old, mut new) = (kept.clone(), kept);
            let mut tangent = vec![0.0; size * size];
            element.tangent(3, &u, History { old: &old, new: &mut new }, &mut tangent).unwrap();
            element.internal_force(3, &u, History { old: &old, new: &mut new }, &mut force).unwrap();
            let scale = tangent.iter().fold(0.0f64, |m, k| m.max(k.abs()));
            let is_plastic = matches!(substance.law, LawKind::Plasticity { .. });
            let (mut up, mut down) = (vec![0.0; size], vec![0.0; size]);
            let step = 1e-6;
            for column in 0..size {
                let mut moved = u.clone();
                moved[column] = u[column] + step;
                element.internal_force(3, &moved, History { old: &old, new: &mut new }, &mut up).unwrap();
                let energy_up = element.strain_energy(3, &moved, &old);
                moved[column] = u[column] - step;
                element.internal_force(3, &moved, History { old: &old, new: &mut new }, &mut down).unwrap();
                let energy = (energy_up - element.strain_energy(3, &moved, &old)) / (2.0 * step);
                assert!(
                    is_plastic || (energy - force[column]).abs() < 1e-7 * scale,
                    "{} {substance:?}: {energy} {}",
                    kind.name(),
                    force[column]
                );
                for row in 0..size {
                    let difference = (up[row] - down[row]) / (2.0 * step);
                    let error = (difference - tangent[row * size + column]).abs() / scale;
                    assert!(error < 1e-7, "{} {substance:?} {row} {column}: {error:e}", kind.name());
                    let other = tangent[column * size + row];
                    assert!((tangent[row * size + column] - other).abs() < 1e-11 * scale);
                }
            }
        }
    }
}

/// At the strains of steel the force keeps its digits: linear in the displacement.
#[test]
fn small_strains_keep_their_digits() {
    for kind in ElementKind::ALL {
        let (mesh, _) = distorted(kind);
        for substance in substances(kind) {
            let law = match substance.law {
                LawKind::Plasticity { .. } => LawKind::Plasticity { hardening: vec![(0.0, 2.35e8)] },
                law => law,
            };
            let element =
                kind.build(&mesh, &Substance { law: law.clone(), young_modulus: 2.1e11, ..substance });
            let size = mesh.nodes_per_element() * mesh.dimension;
            let mut seed = 9;
            let u: Vec<f64> = (0..size).map(|_| 1e-10 * random(&mut seed)).collect();
            let (mut force, mut tangent) = (vec![0.0; size], vec![0.0; size * size]);
            let (old, mut new) = fresh(element.as_ref());
            let rest = vec![0.0; size];
            element.tangent(0, &rest, History { old: &old, new: &mut new }, &mut tangent).unwrap();
            element.internal_force(0, &u, History { old: &old, new: &mut new }, &mut force).unwrap();
            let largest = force.iter().fold(0.0f64, |m, f| m.max(f.abs()));
            for row in 0..size {
                let linear: f64 = (0..size).map(|column| tangent[row * size + column] * u[column]).sum();
                assert!((linear - force[row]).abs() < 1e-8 * largest, "{} {law:?}", kind.name());
            }
        }
    }
}

/// Balance of energy and angular momentum over a step of the energy-momentum method: force times displacement is the
/// change of the strain energy, and the force has no moment about the origin in the middle configuration.
#[test]
fn the_conserving_force_conserves() {
    for kind in ElementKind::ALL {
        let (mesh, _) = distorted(kind);
        let element = kind.build(&mesh, &elastic(MODULUS, 0.3));
        let (d, size) = (mesh.dimension, mesh.nodes_per_element() * mesh.dimension);
        let mut seed = 11;
        let mut draw = || -> Vec<f64> { (0..size).map(|_| 0.05 * random(&mut seed)).collect() };
        let (before, after) = (draw(), draw());
        let mut force = vec![0.0; size];
        element.conserving_force(2, [&before, &after], &mut force).unwrap();
        let work: f64 = (0..size).map(|i| force[i] * (after[i] - before[i])).sum();
        let stored = element.strain_energy(2, &after, &[]) - element.strain_energy(2, &before, &[]);
        assert!((work - stored).abs() < 1e-12 * work.abs().max(1.0), "{}: {work} {stored}", kind.name());
        let position = mesh.relative_position(2);
        let middle = |i: usize| position[i] + 0.5 * (before[i] + after[i]);
        let moment: f64 =
            (0..size / d).map(|a| middle(a * d) * force[a * d + 1] - middle(a * d + 1) * force[a * d]).sum();
        assert!(moment.abs() < 1e-12 * MODULUS, "{}: {moment:e}", kind.name());
    }
}

#[test]
fn an_inverted_element_is_reported() {
    for kind in ElementKind::ALL {
        let (mesh, _) = distorted(kind);
        let element = kind.build(&mesh, &elastic(1.0, 0.0));
        // A reflection of one axis.
        let flipped: Vec<f64> = mesh
            .relative_position(0)
            .chunks(mesh.dimension)
            .flat_map(|x| (0..x.len()).map(|i| if i == 0 { -1.5 * x[0] } else { 0.0 }).collect::<Vec<_>>())
            .collect();
        let mut force = vec![0.0; flipped.len()];
        let history = History { old: &[], new: &mut [] };
        let result = element.internal_force(0, &flipped, history, &mut force);
        assert!(matches!(result, Err(Collapse::Inverted(value)) if value < 0.0), "{}", kind.name());
    }
}

/// A uniform stress is found at all nodes: sigma = F S F'/J.
#[test]
fn a_uniform_stress_is_found_at_the_nodes() {
    let h = [[0.2, 0.3, -0.1], [-0.15, -0.1, 0.25], [0.05, 0.1, 0.3]];
    for kind in ElementKind::ALL {
        let (mesh, _) = distorted(kind);
        for substance in substances(kind) {
            let element = kind.build(&mesh, &substance);
            let (old, _) = fresh(element.as_ref());
            let mut found = Vec::new();
            for e in [0, 4] {
                let mut stress = vec![[0.0; 6]; mesh.nodes_per_element()];
                let u = local(&mesh, e, &affine(&mesh, &h));
                assert!(element.nodal_stress(e, &u, &old, &mut stress) > 0.0);
                found.extend(stress);
            }
            for stress in &found {
                for s in 0..6 {
                    assert!(
                        (stress[s] - found[0][s]).abs() < 1e-9 * MODULUS,
                        "{} {substance:?}",
                        kind.name()
                    );
                }
                if substance.is_plane_stress {
                    assert!(stress[2].abs() < 1e-9 * MODULUS, "{} {substance:?}", kind.name());
                }
            }
        }
    }
}

#[test]
fn mass_is_the_volume() {
    for kind in ElementKind::ALL {
        let (mesh, _) = distorted(kind);
        let element = kind.build(&mesh, &elastic(1.0, 0.0));
        let mut product = vec![0.0; mesh.nodes_per_element().pow(2)];
        let mut volume = 0.0;
        for e in 0..mesh.element_count() {
            element.shape_product(e, &mut product);
            volume += product.iter().sum::<f64>();
        }
        let expected = height(kind) * if mesh.dimension == 2 { 1.0 } else { 0.9 };
        assert!((volume - expected).abs() < 1e-12, "{}: {volume}", kind.name());
    }
}
