use super::*;
use crate::box_grid::BoxGrid;
use crate::element::ElementKind;

const MSH_2: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n1 7 \"foot\"\n2 1 \"body\"\n$EndPhysicalNames\n\
$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 2 0\n4 0 2 0\n$EndNodes\n$Elements\n3\n1 1 2 7 1 1 2\n2 2 2 1 1 1 2 3\n3 2 2 1 1 1 3 4\n\
$EndElements\n";

const MSH_4: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n1 7 \"foot\"\n$EndPhysicalNames\n\
$Entities\n0 1 1 0\n1 0 0 0 1 0 0 1 7 0\n1 0 0 0 1 2 0 0 0\n$EndEntities\n$Nodes\n1 4 1 4\n2 1 0 4\n1\n2\n3\n4\n\
0 0 0\n1 0 0\n1 2 0\n0 2 0\n$EndNodes\n$Elements\n2 3 1 3\n1 1 1 1\n1 2 1\n2 1 2 2\n2 1 2 3\n3 1 3 4\n$EndElements\n";

const DECK: &str = "** comment\n*NODE, NSET=all\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, 1., 2., 0.\n4, 0., 2., 0.\n\
*ELEMENT, TYPE=CPE3, ELSET=lower\n2, 1, 2, 3\n*ELEMENT, TYPE=CPE3, ELSET=upper\n3, 1, 3,\n4\n*SURFACE, NAME=foot\nlower, S1\n\
*NSET, NSET=corner\n1\n*MATERIAL, NAME=steel\n*ELASTIC\n2.1e11, 0.3\n";

#[test]
fn all_formats_give_the_same_mesh() {
    for text in [MSH_2, MSH_4, DECK] {
        let mesh = parse(text, 2).unwrap();
        assert_eq!(mesh.cell, Cell::Triangle3);
        assert_eq!(mesh.connectivity, [0, 1, 2, 0, 2, 3]);
        // The segment of the first two files runs inward; the face of the element is taken.
        assert_eq!(mesh.face("foot").unwrap().facets, [0, 1]);
        assert_eq!(mesh.face("top").unwrap().facets, [2, 3]);
        let quadratic = mesh.into_quadratic();
        assert_eq!(quadratic.node_count(), 9);
        assert_eq!(quadratic.face("foot").unwrap().nodes.len(), 3);
    }
    assert_eq!(parse(DECK, 2).unwrap().face("corner").unwrap().nodes, [0]);
}

/// Every mistake is named with the line it stands in.
#[test]
fn mistakes_are_named_with_their_line() {
    let refused = |from: &str, to: &str, line: usize, word: &str| {
        let text = DECK.replacen(from, to, 1);
        let error = parse(&text, 2).unwrap_err();
        assert!(error.line == line && error.what.contains(word), "{error} (wanted line {line}, {word})");
    };
    refused("2, 1, 2, 3", "2, 1, 3, 2", 8, "inverted");
    refused("1., 2., 0.", "1., 1e-6, 0.", 8, "sliver");
    refused("2, 1, 2, 3", "2, 1, 2, 9", 8, "node 9");
    refused("3, 1, 3,\n4", "3, 1, 3", 11, "has 2 nodes");
    refused("4, 0., 2., 0.", "4, 0., 2., 0.\n5, 9., 9., 0.", 7, "no element");
    refused("4, 0., 2., 0.", "4, 0., 2., 0.\n4, 0., 3., 0.", 7, "twice");
    refused("TYPE=CPE3, ELSET=upper", "TYPE=B31", 9, "B31");
    refused("TYPE=CPE3, ELSET=upper", "TYPE=C3D4", 9, "dimensions");
    refused("lower, S1", "lower, S4", 13, "S4");
    let long = DECK.replace("1., ", "20000., ").replace("2., 0.", "20000., 0.");
    let error = parse(&long, 2).unwrap_err();
    assert!(error.line == 3 && error.what.contains("millimetres"), "{error}");
    let error = parse(&MSH_2.replace("3 2 2 1 1 1 3 4", "3 3 2 1 1 1 2 3 4"), 2).unwrap_err();
    assert!(error.line == 20 && error.what.contains("one kind"), "{error}");
    let error = parse(&MSH_2.replace("3 2 2 1 1 1 3 4", "3 93 2 1 1 1 3 4"), 2).unwrap_err();
    assert!(error.line == 20 && error.what.contains("type 93"), "{error}");
    let error = parse(&MSH_2.replace("2.2 0 8", "2.2 1 8"), 2).unwrap_err();
    assert!(error.line == 2 && error.what.contains("text form"), "{error}");
    let error = parse(&MSH_2.replace("4 0 2 0", "4 1 2 0"), 2).unwrap_err();
    assert!(error.what.contains("inverted") || error.what.contains("one place"), "{error}");
}

type Edges = &'static [(usize, usize)];

/// Gmsh numbers the edges of quadratic cells in its own way: each middle must lie between its ends.
#[test]
fn quadratic_cells_of_gmsh_are_renumbered() {
    let gmsh_edges: [(ElementKind, u64, Edges); 2] = [
        (ElementKind::Tet10, 11, &[(0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3)]),
        (
            ElementKind::Hex20,
            17,
            &[(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)],
        ),
    ];
    let grid = BoxGrid { dimension: 3, minimum: [0.0; 3], maximum: [1.0, 2.0, 3.0], cells: [1; 3] };
    for (kind, number, edges) in gmsh_edges {
        let made = Mesh::of_box(&grid, kind.cell());
        let element = made.element(0);
        let corners = kind.cell().corners();
        let at = |node: usize| &made.reference_position[3 * node..3 * node + 3];
        let mut nodes: Vec<Vec<f64>> = element[..corners].iter().map(|&node| at(node).to_vec()).collect();
        for &(a, b) in edges {
            nodes.push((0..3).map(|i| 0.5 * (nodes[a][i] + nodes[b][i])).collect());
        }
        let mut text = format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n", nodes.len());
        for (node, x) in nodes.iter().enumerate() {
            text += &format!("{} {} {} {}\n", node + 1, x[0], x[1], x[2]);
        }
        let list: String = (1..=nodes.len()).map(|node| format!(" {node}")).collect();
        text += &format!("$EndNodes\n$Elements\n1\n1 {number} 2 0 1{list}\n$EndElements\n");
        let read = parse(&text, 3).unwrap();
        for (edge, &(a, b)) in kind.cell().edges().iter().enumerate() {
            let x = |local: usize| &read.reference_position[3 * read.element(0)[local]..][..3];
            (0..3).for_each(|i| assert_eq!(x(corners + edge)[i], 0.5 * (x(a)[i] + x(b)[i])));
        }
    }
}
