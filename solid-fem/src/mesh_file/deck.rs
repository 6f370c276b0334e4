//! The subset of the Abaqus/CalculiX input deck that describes a mesh: *NODE, *ELEMENT, *NSET, *ELSET, *SURFACE.
//!
//! Other keywords (materials, steps) are passed over, as they do not change the mesh; *INCLUDE and *PART would, and are
//! refused. Source: CalculiX CrunchiX user's manual, "Input deck format".

use std::collections::HashMap;

use super::{MeshError, Raw, RawElement, RawFace, RawNode, RawSurface};
use crate::cell::Cell;

/// What the data lines of the present keyword are.
#[derive(Default)]
enum Block {
    #[default]
    Nothing,
    Nodes(Option<String>),
    Elements(Cell, Option<String>),
    NodeSet(String, bool),
    ElementSet(String, bool),
    Surface,
}

#[derive(Default)]
struct Reader {
    raw: Raw,
    block: Block,
    node_sets: HashMap<String, Vec<u64>>,
    element_sets: HashMap<String, Vec<u64>>,
    surfaces: Vec<(String, Vec<RawFace>)>,
    /// An element whose nodes go on in the next line.
    open: Option<RawElement>,
}

pub(super) fn parse(text: &str, dimension: usize) -> Result<Raw, MeshError> {
    let mut reader = Reader::default();
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        let fail = |what: String| MeshError { line: index + 1, what };
        if line.starts_with("**") || line.is_empty() {
            continue;
        }
        match line.strip_prefix('*') {
            Some(keyword) => reader.block = reader.keyword(keyword, dimension).map_err(fail)?,
            None => reader.data(line, index + 1).map_err(fail)?,
        }
    }
    let mut sets: Vec<_> = reader.node_sets.into_iter().collect();
    sets.sort();
    reader.raw.node_sets = sets;
    for (name, faces) in reader.surfaces {
        reader.raw.surfaces.push((name, RawSurface::Faces(faces)));
    }
    Ok(reader.raw)
}

impl Reader {
    fn keyword(&mut self, line: &str, dimension: usize) -> Result<Block, String> {
        if let Some(open) = self.open.take() {
            return Err(format!(
                "element {} has {} nodes, a {:?} has {}",
                open.number,
                open.nodes.len(),
                open.cell,
                open.cell.nodes()
            ));
        }
        let mut words = line.split(',').map(str::trim);
        let keyword = words.next().unwrap_or_default().to_uppercase();
        let options: HashMap<String, String> = words
            .map(|word| word.split_once('=').unwrap_or((word, "")))
            .map(|(key, value)| (key.trim().to_uppercase(), value.trim().to_owned()))
            .collect();
        let name = |key: &str| options.get(key).cloned().ok_or_else(|| format!("*{keyword} needs {key}="));
        Ok(match keyword.as_str() {
            "NODE" => Block::Nodes(options.get("NSET").cloned()),
            "ELEMENT" => match cell_of(&name("TYPE")?.to_uppercase()) {
                Some(cell) if cell.dimension() == dimension => {
                    Block::Elements(cell, options.get("ELSET").cloned())
                }
                Some(cell) => return Err(format!("a {cell:?} in a case of {dimension} dimensions")),
                None => {
                    let known =
                        "C3D4, C3D10, C3D8, C3D8I, C3D20, CPE3, CPE4, CPE6, CPE8, CPS3, CPS4, CPS6, CPS8";
                    return Err(format!("elements of type {} are not read: {known} are", name("TYPE")?));
                }
            },
            "NSET" => Block::NodeSet(name("NSET")?, options.contains_key("GENERATE")),
            "ELSET" => Block::ElementSet(name("ELSET")?, options.contains_key("GENERATE")),
            "SURFACE" => {
                if options.get("TYPE").is_some_and(|kind| !kind.eq_ignore_ascii_case("ELEMENT")) {
                    return Err("a *SURFACE of nodes has no facets: TYPE=ELEMENT is read".to_owned());
                }
                let name = name("NAME")?;
                self.surfaces.push((name, Vec::new()));
                Block::Surface
            }
            "INCLUDE" | "PART" | "INSTANCE" | "ASSEMBLY" => {
                return Err(format!("*{keyword} is not read: write one flat deck"));
            }
            _ => Block::Nothing,
        })
    }

    fn data(&mut self, line: &str, number: usize) -> Result<(), String> {
        let words: Vec<&str> = line.split(',').map(str::trim).filter(|word| !word.is_empty()).collect();
        match &self.block {
            Block::Nothing => {}
            Block::Nodes(set) => {
                let values = floats(&words)?;
                if !(3..=4).contains(&values.len()) {
                    return Err(format!("\"{line}\" is no node: number, x, y, z"));
                }
                let position = [values[1], values[2], values.get(3).copied().unwrap_or_default()];
                let node = values[0] as u64;
                self.raw.nodes.push(RawNode { number: node, position, line: number });
                if let Some(set) = set {
                    self.node_sets.entry(set.clone()).or_default().push(node);
                }
            }
            Block::Elements(cell, set) => {
                let mut values = integers(&words)?.into_iter();
                let mut element = match self.open.take() {
                    Some(open) => open,
                    None => {
                        let number_of = values.next().ok_or("an element without a number")?;
                        if let Some(set) = set {
                            self.element_sets.entry(set.clone()).or_default().push(number_of);
                        }
                        RawElement { number: number_of, cell: *cell, nodes: Vec::new(), line: number }
                    }
                };
                element.nodes.extend(values);
                match element.nodes.len().cmp(&cell.nodes()) {
                    std::cmp::Ordering::Less => self.open = Some(element),
                    std::cmp::Ordering::Equal => self.raw.elements.push(element),
                    std::cmp::Ordering::Greater => {
                        let (found, wanted) = (element.nodes.len(), cell.nodes());
                        return Err(format!(
                            "element {} has {found} nodes, a {cell:?} has {wanted}",
                            element.number
                        ));
                    }
                }
            }
            Block::NodeSet(name, generate) => {
                let numbers = members(&words, *generate, &self.node_sets)?;
                self.node_sets.entry(name.clone()).or_default().extend(numbers);
            }
            Block::ElementSet(name, generate) => {
                let numbers = members(&words, *generate, &self.element_sets)?;
                self.element_sets.entry(name.clone()).or_default().extend(numbers);
            }
            Block::Surface => {
                let [of, face] = words[..] else {
                    return Err(format!("\"{line}\" is no face of a surface: element or set, S1 .. S6"));
                };
                let face = face.strip_prefix(['S', 's']).and_then(|face| face.parse::<usize>().ok());
                let face = face.and_then(|face| face.checked_sub(1)).ok_or("a face is S1 .. S6")?;
                let elements = match of.parse() {
                    Ok(element) => vec![element],
                    Err(_) => self
                        .element_sets
                        .get(of)
                        .cloned()
                        .ok_or_else(|| format!("there is no element set {of}"))?,
                };
                let (_, faces) = self.surfaces.last_mut().ok_or("a face outside any surface")?;
                faces.extend(elements.into_iter().map(|element| (element, face, number)));
            }
        }
        Ok(())
    }
}

fn floats(words: &[&str]) -> Result<Vec<f64>, String> {
    // Fortran writes 1.0D+00.
    let parse =
        |word: &&str| word.replace(['D', 'd'], "e").parse().map_err(|_| format!("\"{word}\" is no number"));
    words.iter().map(parse).collect()
}

fn integers(words: &[&str]) -> Result<Vec<u64>, String> {
    words.iter().map(|word| word.parse().map_err(|_| format!("\"{word}\" is no whole number"))).collect()
}

/// Members of a set: numbers, names of other sets, or first, last, step.
fn members(words: &[&str], generate: bool, sets: &HashMap<String, Vec<u64>>) -> Result<Vec<u64>, String> {
    if generate {
        let range = integers(words)?;
        let [first, last, ref step @ ..] = range[..] else {
            return Err("GENERATE needs first, last and step".to_owned());
        };
        let step = step.first().copied().unwrap_or(1).max(1);
        return Ok((first..=last).step_by(step as usize).collect());
    }
    let mut numbers = Vec::new();
    for word in words {
        match word.parse() {
            Ok(number) => numbers.push(number),
            Err(_) => numbers.extend(sets.get(*word).ok_or_else(|| format!("there is no set {word}"))?),
        }
    }
    Ok(numbers)
}

fn cell_of(kind: &str) -> Option<Cell> {
    Some(match kind {
        "C3D4" => Cell::Tetrahedron4,
        "C3D10" | "C3D10T" => Cell::Tetrahedron10,
        "C3D8" | "C3D8I" | "C3D8R" => Cell::Hexahedron8,
        "C3D20" | "C3D20R" => Cell::Hexahedron20,
        "CPE3" | "CPS3" => Cell::Triangle3,
        "CPE4" | "CPS4" => Cell::Quadrilateral4,
        "CPE6" | "CPS6" => Cell::Triangle6,
        "CPE8" | "CPS8" => Cell::Quadrilateral8,
        _ => return None,
    })
}
