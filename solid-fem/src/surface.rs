//! The surface that travels to the coupler: the interface faces in linear facets with compact node numbers.

use protocol::interface::{Facets, Surface};

use crate::box_grid::Face;
use crate::cell::Cell;
use crate::mesh::Mesh;

/// Interface faces of a mesh, and the mesh node of each interface node, `[n]`. Facets with nodes in the middle of their
/// edges are cut into linear ones, as the other side knows no others. `areal_mass` in kg/m2 is given to every node.
pub(crate) fn interface(mesh: &Mesh, faces: &[Face], areal_mass: f64) -> (Surface, Vec<usize>) {
    let cell = mesh.cell.facet();
    let pieces = pieces(cell);
    let mut facets = Facets { nodes_per_facet: pieces[0].len(), ..Facets::default() };
    for &face in faces {
        let own = mesh.face(face.name()).map_or(&[][..], |named| &named.facets);
        for nodes in own.chunks_exact(cell.nodes()) {
            for piece in pieces {
                facets.nodes.extend(piece.iter().map(|&local| nodes[local]));
                facets.face.push(face as usize);
            }
        }
    }
    let mut nodes = facets.nodes.clone();
    nodes.sort_unstable();
    nodes.dedup();
    for node in &mut facets.nodes {
        *node = nodes.binary_search(node).expect("the list was made of these nodes");
    }
    let d = mesh.dimension;
    let position = |&node: &usize| mesh.reference_position[node * d..(node + 1) * d].iter().copied();
    let reference_position = nodes.iter().flat_map(position).collect();
    let areal_mass = vec![areal_mass; nodes.len()];
    (Surface { dimension: d, reference_position, facets, areal_mass }, nodes)
}

/// The linear facets a facet is cut into.
fn pieces(facet: Cell) -> &'static [&'static [usize]] {
    match facet {
        Cell::Segment2 => &[&[0, 1]],
        Cell::Segment3 => &[&[0, 2], &[2, 1]],
        Cell::Triangle3 => &[&[0, 1, 2]],
        Cell::Triangle6 => &[&[0, 3, 5], &[3, 1, 4], &[5, 4, 2], &[3, 4, 5]],
        Cell::Quadrilateral8 => &[&[0, 4, 7], &[4, 1, 5], &[5, 2, 6], &[6, 3, 7], &[4, 5, 7], &[5, 6, 7]],
        _ => &[&[0, 1, 2, 3]],
    }
}
