//! Nested dissection by coordinates: the order of elimination for large meshes.
//!
//! The nodes are halved across the longest edge of their box; those of one half that touch the other separate the two
//! and are eliminated last; so on in both parts. Source: A. George, SIAM J. Numer. Anal. 10 (1973) 345. In space it leaves
//! about half the fill of minimum degree above 200,000 unknowns.

use super::block_matrix::BlockPattern;

/// Parts of this many nodes are not halved further.
const LEAF: usize = 60;

/// Nodes in the order of elimination, `[n]`.
pub(crate) fn nested_dissection(pattern: &BlockPattern, position: &[f64]) -> Vec<usize> {
    let mut order = Vec::with_capacity(pattern.node_count());
    let mut side = vec![0; pattern.node_count()];
    let mut stamp = 0;
    dissect(
        (0..pattern.node_count()).collect(),
        &mut |nodes| {
            (nodes.len() > LEAF).then(|| {
                stamp += 2;
                halve(pattern, position, nodes, (&mut side, stamp))
            })
        },
        &mut order,
    );
    order
}

/// Both halves and their separator.
type Parts = [Vec<usize>; 3];

fn dissect(nodes: Vec<usize>, halve: &mut dyn FnMut(&[usize]) -> Option<Parts>, order: &mut Vec<usize>) {
    match halve(&nodes) {
        Some([low, high, separator]) if !low.is_empty() && !high.is_empty() => {
            dissect(low, halve, order);
            dissect(high, halve, order);
            order.extend(separator);
        }
        _ => order.extend(nodes),
    }
}

/// `side` marks the halves of this cut by `stamp` and `stamp + 1`.
fn halve(
    pattern: &BlockPattern,
    position: &[f64],
    nodes: &[usize],
    (side, stamp): (&mut [usize], usize),
) -> Parts {
    let d = pattern.dimension;
    let extent = |axis: usize| {
        let along = nodes.iter().map(|&node| position[node * d + axis]);
        let (low, high) =
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        high - low
    };
    let axis = (0..d).max_by(|&a, &b| extent(a).total_cmp(&extent(b))).expect("a mesh has axes");
    let mut sorted = nodes.to_vec();
    sorted.sort_by(|&a, &b| position[a * d + axis].total_cmp(&position[b * d + axis]).then(a.cmp(&b)));
    let middle = position[sorted[sorted.len() / 2] * d + axis];
    for &node in nodes {
        side[node] = if position[node * d + axis] < middle { stamp } else { stamp + 1 };
    }
    let (low, mut high): (Vec<_>, Vec<_>) = nodes.iter().partition(|&&node| side[node] == stamp);
    let touches = |&node: &usize| {
        let row = pattern.row_start[node]..pattern.row_start[node + 1];
        pattern.column[row].iter().any(|&other| side[other as usize] == stamp)
    };
    let separator: Vec<usize> = high.iter().copied().filter(touches).collect();
    high.retain(|node| !touches(node));
    [low, high, separator]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::box_grid::BoxGrid;
    use crate::cell::Cell;
    use crate::mesh::Mesh;

    #[test]
    fn every_node_is_eliminated_once() {
        let grid = BoxGrid { dimension: 3, minimum: [0.0; 3], maximum: [1.0, 2.0, 3.0], cells: [5, 9, 12] };
        let mesh = Mesh::of_box(&grid, Cell::Hexahedron8);
        let mut order = nested_dissection(&BlockPattern::new(&mesh), &mesh.reference_position);
        order.sort_unstable();
        assert!(order.iter().copied().eq(0..mesh.node_count()));
    }
}
