//! What must hold of a mesh before it is computed with.

use std::collections::HashMap;

use super::{MeshError, Numbers, Raw, RawElement};
use crate::element::matrix::determinant;

/// Least ratio of a simplex's or box's smallest Jacobian to the cube (square) of its longest edge: below it is a sliver.
const SLIVER: f64 = 1e-4;

/// Size in m above which a body was most likely given in millimetres.
const LARGEST: f64 = 10_000.0;

/// Numbers of nodes and elements, each once; one kind of element, right-handed, no sliver, no orphan or double node.
pub(super) fn numbers(raw: &Raw, dimension: usize) -> Result<Numbers, MeshError> {
    let fail = |line: usize, what: String| Err(MeshError { line, what });
    let Some(first) = raw.elements.first() else {
        return fail(0, format!("there is no element of {dimension} dimensions"));
    };
    let mut node = HashMap::new();
    for (place, raw) in raw.nodes.iter().enumerate() {
        if node.insert(raw.number, place).is_some() {
            return fail(raw.line, format!("node {} is there twice", raw.number));
        }
    }
    let mut element = HashMap::new();
    let mut used = vec![false; raw.nodes.len()];
    for (place, own) in raw.elements.iter().enumerate() {
        if element.insert(own.number, place).is_some() {
            return fail(own.line, format!("element {} is there twice", own.number));
        }
        if own.cell != first.cell {
            let what = format!(
                "element {} is a {:?}, the first a {:?}: one kind only",
                own.number, own.cell, first.cell
            );
            return fail(own.line, what);
        }
        for number in &own.nodes {
            match node.get(number) {
                Some(&place) => used[place] = true,
                None => {
                    return fail(own.line, format!("element {} needs node {number}: not there", own.number));
                }
            }
        }
        check_shape(raw, own, &node, dimension)?;
    }
    if let Some(orphan) = used.iter().position(|used| !used) {
        let node = raw.nodes[orphan];
        return fail(node.line, format!("node {} belongs to no element", node.number));
    }
    check_places(raw)?;
    let known = |sets: &[(String, Vec<u64>)]| {
        sets.iter().find_map(|(name, numbers)| {
            Some((name.clone(), *numbers.iter().find(|n| !node.contains_key(n))?))
        })
    };
    if let Some((name, number)) = known(&raw.node_sets) {
        return fail(0, format!("the set \"{name}\" names node {number}: not there"));
    }
    Ok(Numbers { node, element })
}

fn check_shape(
    raw: &Raw,
    element: &RawElement,
    node: &HashMap<u64, usize>,
    dimension: usize,
) -> Result<(), MeshError> {
    let cell = element.cell;
    let positions: Vec<[f64; 3]> =
        element.nodes.iter().map(|number| raw.nodes[node[number]].position).collect();
    let mut longest = 0.0f64;
    for &(a, b) in cell.edges() {
        let square: f64 = (0..3).map(|i| (positions[a][i] - positions[b][i]).powi(2)).sum();
        longest = longest.max(square.sqrt());
    }
    let mut least = f64::INFINITY;
    let places =
        cell.stiffness_rule().into_iter().map(|q| q.at).chain((0..cell.corners()).map(|a| cell.node(a)));
    for at in places {
        let shape = cell.shape(&at);
        let sum =
            |i: usize, j: usize| (0..cell.nodes()).map(|a| positions[a][i] * shape.derivative[a][j]).sum();
        let jacobian = match dimension {
            2 => determinant::<2>(&std::array::from_fn(|i| std::array::from_fn(|j| sum(i, j)))),
            _ => determinant::<3>(&std::array::from_fn(|i| std::array::from_fn(|j| sum(i, j)))),
        };
        least = least.min(jacobian / longest.powi(dimension as i32));
    }
    let fail = |what: String| Err(MeshError { line: element.line, what });
    if least <= 0.0 || least.is_nan() {
        return fail(format!(
            "element {} is inverted: Jacobian {least:.2e} of its longest edge's power, must be above 0 (nodes in the wrong order?)",
            element.number
        ));
    }
    if least < SLIVER {
        return fail(format!(
            "element {} is a sliver: Jacobian {least:.2e}, at least {SLIVER:e}",
            element.number
        ));
    }
    Ok(())
}

/// Two nodes at one place do not hang together; a body of kilometres is one of metres given in millimetres.
fn check_places(raw: &Raw) -> Result<(), MeshError> {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for node in &raw.nodes {
        for i in 0..3 {
            (low[i], high[i]) = (low[i].min(node.position[i]), high[i].max(node.position[i]));
        }
    }
    let size = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
    if size > LARGEST {
        let what =
            format!("the body is {size} m long, at most {LARGEST}: lengths are in metres, not millimetres");
        return Err(MeshError { line: raw.nodes[0].line, what });
    }
    let unit = 1e-9 * size;
    let mut places: HashMap<[i64; 3], u64> = HashMap::new();
    for node in &raw.nodes {
        let key = std::array::from_fn(|i| ((node.position[i] - low[i]) / unit).round() as i64);
        if let Some(other) = places.insert(key, node.number) {
            let what =
                format!("nodes {other} and {} lie at one place: the body falls apart there", node.number);
            return Err(MeshError { line: node.line, what });
        }
    }
    Ok(())
}
