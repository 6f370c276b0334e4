//! Gmsh MSH 2.2 and 4.1 in text form. Physical groups of one dimension less become named surfaces.
//!
//! Source: Gmsh reference manual, "MSH file format".

use std::collections::BTreeMap;

use super::{MeshError, Raw, RawElement, RawNode, RawSurface};
use crate::cell::Cell;

/// Lines with their numbers.
struct Lines<'t> {
    lines: std::iter::Enumerate<std::str::Lines<'t>>,
    number: usize,
}

impl<'t> Lines<'t> {
    fn next(&mut self) -> Result<&'t str, MeshError> {
        match self.lines.next() {
            Some((index, line)) => {
                self.number = index + 1;
                Ok(line.trim())
            }
            None => Err(self.fail("the file ends too early")),
        }
    }

    fn fail(&self, what: impl Into<String>) -> MeshError {
        MeshError { line: self.number, what: what.into() }
    }

    /// The numbers of the next line, at least `count`.
    fn numbers<T: std::str::FromStr>(&mut self, count: usize) -> Result<Vec<T>, MeshError> {
        let line = self.next()?;
        let numbers: Option<Vec<T>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
        numbers
            .filter(|numbers| numbers.len() >= count)
            .ok_or_else(|| self.fail(format!("\"{line}\" is not a row of at least {count} numbers")))
    }
}

/// What is gathered on the way.
#[derive(Default)]
struct Reader {
    raw: Raw,
    /// Physical tag and dimension to name.
    names: BTreeMap<(usize, i64), String>,
    /// Entity tag and dimension to its physical tags (4.1).
    entities: BTreeMap<(usize, i64), Vec<i64>>,
    facets: BTreeMap<i64, (Cell, Vec<Vec<u64>>)>,
    dimension: usize,
}

pub(super) fn parse(text: &str, dimension: usize) -> Result<Raw, MeshError> {
    let mut lines = Lines { lines: text.lines().enumerate(), number: 0 };
    let mut reader = Reader { dimension, ..Reader::default() };
    let mut version = 0.0;
    while let Ok(line) = lines.next() {
        match line {
            "" => {}
            "$MeshFormat" => version = read_format(&mut lines)?,
            "$PhysicalNames" => reader.read_names(&mut lines)?,
            "$Entities" => reader.read_entities(&mut lines)?,
            "$Nodes" if version < 3.0 => reader.read_nodes_2(&mut lines)?,
            "$Nodes" => reader.read_nodes_4(&mut lines)?,
            "$Elements" if version < 3.0 => reader.read_elements_2(&mut lines)?,
            "$Elements" => reader.read_elements_4(&mut lines)?,
            other if other.starts_with("$End") => {}
            other if other.starts_with('$') => {
                // A section this program has no use for.
                let end = other.replacen('$', "$End", 1);
                while lines.next()? != end {}
            }
            other => return Err(lines.fail(format!("\"{other}\" stands outside any section"))),
        }
    }
    for (tag, (cell, facets)) in reader.facets {
        let name = reader.names.get(&(dimension - 1, tag)).cloned().unwrap_or_else(|| tag.to_string());
        reader.raw.surfaces.push((name, RawSurface::Facets(cell, facets)));
    }
    Ok(reader.raw)
}

fn read_format(lines: &mut Lines<'_>) -> Result<f64, MeshError> {
    let format: Vec<f64> = lines.numbers(3)?;
    if ![2.2, 4.1].contains(&format[0]) || format[1] != 0.0 {
        let what = format!(
            "version {}, file type {}: 2.2 or 4.1 in text form (type 0) is read",
            format[0], format[1]
        );
        return Err(lines.fail(format!("{what}; gmsh -save -format msh22 writes one")));
    }
    Ok(format[0])
}

impl Reader {
    fn read_names(&mut self, lines: &mut Lines<'_>) -> Result<(), MeshError> {
        let count: usize = lines.numbers(1)?[0];
        for _ in 0..count {
            let line = lines.next()?;
            let mut words = line.splitn(3, char::is_whitespace);
            let parsed = words
                .next()
                .and_then(|dimension| dimension.parse().ok())
                .zip(words.next().and_then(|tag| tag.parse().ok()))
                .zip(words.next());
            let ((dimension, tag), name) =
                parsed.ok_or_else(|| lines.fail(format!("\"{line}\" is no physical name")))?;
            self.names.insert((dimension, tag), name.trim().trim_matches('"').to_owned());
        }
        Ok(())
    }

    fn read_entities(&mut self, lines: &mut Lines<'_>) -> Result<(), MeshError> {
        let counts: Vec<usize> = lines.numbers(4)?;
        for (dimension, &count) in counts.iter().enumerate().take(4) {
            for _ in 0..count {
                let row: Vec<f64> = lines.numbers(if dimension == 0 { 5 } else { 8 })?;
                // Tag, then a point or a box, then the number of physical tags and the tags.
                let at = if dimension == 0 { 4 } else { 7 };
                let tags = row.iter().skip(at + 1).take(row[at] as usize).map(|&tag| tag as i64).collect();
                self.entities.insert((dimension, row[0] as i64), tags);
            }
        }
        Ok(())
    }

    fn read_nodes_2(&mut self, lines: &mut Lines<'_>) -> Result<(), MeshError> {
        let count: usize = lines.numbers(1)?[0];
        for _ in 0..count {
            let row: Vec<f64> = lines.numbers(4)?;
            let position = [row[1], row[2], row[3]];
            self.raw.nodes.push(RawNode { number: row[0] as u64, position, line: lines.number });
        }
        Ok(())
    }

    fn read_nodes_4(&mut self, lines: &mut Lines<'_>) -> Result<(), MeshError> {
        let blocks: usize = lines.numbers(4)?[0];
        for _ in 0..blocks {
            let count: usize = lines.numbers(4)?[3];
            let mut numbers = Vec::with_capacity(count);
            for _ in 0..count {
                numbers.push((lines.numbers::<u64>(1)?[0], lines.number));
            }
            for (number, _) in numbers {
                let row: Vec<f64> = lines.numbers(3)?;
                let position = [row[0], row[1], row[2]];
                self.raw.nodes.push(RawNode { number, position, line: lines.number });
            }
        }
        Ok(())
    }

    fn read_elements_2(&mut self, lines: &mut Lines<'_>) -> Result<(), MeshError> {
        let count: usize = lines.numbers(1)?[0];
        for _ in 0..count {
            let row: Vec<u64> = lines.numbers(4)?;
            let tags = row[2] as usize;
            let physical = if tags > 0 { row[3] as i64 } else { 0 };
            let nodes = row.get(3 + tags..).unwrap_or_default();
            self.take(lines, (row[0], row[1]), &[physical], nodes)?;
        }
        Ok(())
    }

    fn read_elements_4(&mut self, lines: &mut Lines<'_>) -> Result<(), MeshError> {
        let blocks: usize = lines.numbers(4)?[0];
        for _ in 0..blocks {
            let block: Vec<u64> = lines.numbers(4)?;
            let tags = self.entities.get(&(block[0] as usize, block[1] as i64)).cloned().unwrap_or_default();
            for _ in 0..block[3] {
                let row: Vec<u64> = lines.numbers(2)?;
                self.take(lines, (row[0], block[2]), &tags, &row[1..])?;
            }
        }
        Ok(())
    }

    /// Takes one element of the file: one of the body, a facet of a surface, or one of no use (points, edges in space).
    fn take(
        &mut self,
        lines: &Lines<'_>,
        (number, kind): (u64, u64),
        tags: &[i64],
        nodes: &[u64],
    ) -> Result<(), MeshError> {
        let Some((cell, order)) = cell_of(kind) else {
            // A point.
            if kind == 15 {
                return Ok(());
            }
            let what = format!("element {number} is of type {kind}, which is not read");
            return Err(lines.fail(format!("{what}: 1 to 5, 8, 9, 11, 16 and 17 are")));
        };
        if nodes.len() != cell.nodes() {
            let what = format!("element {number} has {} nodes, a {cell:?} has {}", nodes.len(), cell.nodes());
            return Err(lines.fail(what));
        }
        let nodes: Vec<u64> = match order {
            None => nodes.to_vec(),
            Some(order) => order.iter().map(|&local| nodes[local]).collect(),
        };
        if cell.dimension() == self.dimension {
            self.raw.elements.push(RawElement { number, cell, nodes, line: lines.number });
        } else if cell.dimension() + 1 == self.dimension {
            for &tag in tags.iter().filter(|&&tag| tag != 0) {
                self.facets.entry(tag).or_insert_with(|| (cell, Vec::new())).1.push(nodes.clone());
            }
        }
        Ok(())
    }
}

/// Gmsh's numbering of the edges of the two quadratic cells in space differs.
const TETRAHEDRON: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8];
const HEXAHEDRON: [usize; 20] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15];

/// The cell of a type, and where its nodes stand in the file.
fn cell_of(kind: u64) -> Option<(Cell, Option<&'static [usize]>)> {
    Some(match kind {
        1 => (Cell::Segment2, None),
        2 => (Cell::Triangle3, None),
        3 => (Cell::Quadrilateral4, None),
        4 => (Cell::Tetrahedron4, None),
        5 => (Cell::Hexahedron8, None),
        8 => (Cell::Segment3, None),
        9 => (Cell::Triangle6, None),
        11 => (Cell::Tetrahedron10, Some(&TETRAHEDRON)),
        16 => (Cell::Quadrilateral8, None),
        17 => (Cell::Hexahedron20, Some(&HEXAHEDRON)),
        _ => return None,
    })
}
