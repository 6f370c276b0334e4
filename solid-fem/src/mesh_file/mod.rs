//! Meshes from files: Gmsh MSH 2.2 and 4.1 (text), and a subset of the Abaqus/CalculiX input deck.
//!
//! A file is read into `Raw`, the same for all formats, checked (`check.rs`) and made a [`Mesh`]. Every complaint names
//! the line it is about.

mod check;
mod deck;
mod gmsh;

use std::collections::HashMap;
use std::path::Path;

use crate::cell::Cell;
use crate::mesh::{Mesh, NamedFace};

/// What is wrong with a mesh file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct MeshError {
    /// Line, from 1.
    pub line: usize,
    /// What is wrong, with the offending value and what is allowed.
    pub what: String,
}

/// A file as read: nodes and elements by the numbers it gives them.
#[derive(Debug, Default)]
struct Raw {
    nodes: Vec<RawNode>,
    elements: Vec<RawElement>,
    /// Facets of named surfaces.
    surfaces: Vec<(String, RawSurface)>,
    /// Named sets of nodes.
    node_sets: Vec<(String, Vec<u64>)>,
}

#[derive(Debug, Clone, Copy)]
struct RawNode {
    number: u64,
    position: [f64; 3],
    line: usize,
}

#[derive(Debug, Clone)]
struct RawElement {
    number: u64,
    cell: Cell,
    /// In the order of [`Cell`].
    nodes: Vec<u64>,
    line: usize,
}

/// How a file gives a surface.
#[derive(Debug, Clone)]
enum RawSurface {
    /// By the nodes of its facets, of this shape.
    Facets(Cell, Vec<Vec<u64>>),
    /// By elements and their faces.
    Faces(Vec<RawFace>),
}

/// Element, number of its face from 0, line.
type RawFace = (u64, usize, usize);

/// Numbers of a format turned into positions in the lists.
struct Numbers {
    node: HashMap<u64, usize>,
    element: HashMap<u64, usize>,
}

/// Reads and checks a mesh file of elements of one kind in `dimension` dimensions; its plane sides get names too where
/// the file gives none.
///
/// # Errors
/// The first mistake in the file.
pub fn read(path: &Path, dimension: usize) -> Result<Mesh, MeshError> {
    let text = std::fs::read_to_string(path)
        .map_err(|error| MeshError { line: 0, what: format!("cannot read {}: {error}", path.display()) })?;
    parse(&text, dimension)
}

/// The same of a text: an input deck begins with a keyword line `*`, a Gmsh file with `$MeshFormat`.
///
/// # Errors
/// As [`read`].
pub fn parse(text: &str, dimension: usize) -> Result<Mesh, MeshError> {
    let first = text.lines().map(str::trim).find(|line| !line.is_empty()).unwrap_or_default();
    let raw = if first.starts_with("$") {
        gmsh::parse(text, dimension)?
    } else if first.starts_with('*') {
        deck::parse(text, dimension)?
    } else {
        let what = format!("\"{first}\" begins neither a Gmsh file ($MeshFormat) nor an input deck (*)");
        return Err(MeshError { line: 1, what });
    };
    let numbers = check::numbers(&raw, dimension)?;
    let mut mesh = assemble(&raw, &numbers, dimension)?;
    mesh.name_plane_sides();
    Ok(mesh)
}

fn assemble(raw: &Raw, numbers: &Numbers, dimension: usize) -> Result<Mesh, MeshError> {
    let connectivity = raw.elements.iter().flat_map(|element| &element.nodes);
    let mut mesh = Mesh {
        dimension,
        cell: raw.elements[0].cell,
        reference_position: raw.nodes.iter().flat_map(|node| node.position[..dimension].to_vec()).collect(),
        connectivity: connectivity.map(|number| numbers.node[number]).collect(),
        faces: Vec::new(),
    };
    let boundary = boundary_facets(&mesh);
    for (name, surface) in &raw.surfaces {
        let facets = match surface {
            RawSurface::Faces(faces) => faces_of(&mesh, numbers, faces)?,
            RawSurface::Facets(cell, facets) => {
                let mut all = Vec::new();
                for facet in facets {
                    let corners = facet.iter().take(cell.corners());
                    let mut key: Vec<usize> = corners.map(|number| numbers.node[number]).collect();
                    key.sort_unstable();
                    // The file's own order may point inward: the element's face is taken.
                    let outward = boundary.get(&key).ok_or_else(|| MeshError {
                        line: 0,
                        what: format!("a facet of the surface \"{name}\" is no outer face of any element"),
                    })?;
                    all.extend_from_slice(outward);
                }
                all
            }
        };
        mesh.faces.push(NamedFace::of_facets(name, facets));
    }
    for (name, nodes) in &raw.node_sets {
        let mut nodes: Vec<usize> = nodes.iter().map(|number| numbers.node[number]).collect();
        nodes.sort_unstable();
        nodes.dedup();
        if mesh.face(name).is_none() {
            mesh.faces.push(NamedFace { name: name.clone(), facets: Vec::new(), nodes });
        }
    }
    Ok(mesh)
}

/// Outer facets by their sorted corners.
fn boundary_facets(mesh: &Mesh) -> HashMap<Vec<usize>, Vec<usize>> {
    let facet = mesh.cell.facet();
    let facets = mesh.boundary();
    let by_corners = facets.chunks_exact(facet.nodes()).map(|nodes| {
        let mut key = nodes[..facet.corners()].to_vec();
        key.sort_unstable();
        (key, nodes.to_vec())
    });
    by_corners.collect()
}

fn faces_of(mesh: &Mesh, numbers: &Numbers, faces: &[(u64, usize, usize)]) -> Result<Vec<usize>, MeshError> {
    let mut facets = Vec::new();
    for &(number, face, line) in faces {
        let element = numbers
            .element
            .get(&number)
            .ok_or_else(|| MeshError { line, what: format!("there is no element {number}") })?;
        if face >= mesh.cell.face_corners().len() {
            let what =
                format!("face S{} of a {:?}: it has {}", face + 1, mesh.cell, mesh.cell.face_corners().len());
            return Err(MeshError { line, what });
        }
        let nodes = mesh.element(*element);
        facets.extend(mesh.cell.face_nodes(face).iter().map(|&local| nodes[local]));
    }
    Ok(facets)
}

#[cfg(test)]
mod tests;
