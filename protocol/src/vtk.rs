//! Fields of the run folder as ParaView opens them: `.vtp` (particles), `.vtu` (elements), `.pvd` (frames in time).
//!
//! XML header with raw appended binary blocks, 32-bit floats (as the VTK file formats guide describes them).
//! [`read`] reads back what [`write()`] wrote, for the pictures of the report.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::Path;

/// Values at the points: `n * components` numbers.
#[derive(Debug, Clone, Copy)]
pub struct Column<'a> {
    /// Name with its unit, such as `pressure_pa`.
    pub name: &'a str,
    /// 1 for numbers, D for vectors (written with three components).
    pub components: usize,
    /// The values, point after point.
    pub values: &'a [f64],
}

/// What connects the points.
#[derive(Debug, Clone, Copy)]
pub enum Cells<'a> {
    /// Nothing: every point is a vertex (`.vtp`).
    Vertices,
    /// Cells of one kind (`.vtu`).
    Uniform {
        /// VTK cell type: 5 triangle, 9 quadrilateral, 10 tetrahedron, 12 hexahedron; quadratic 22, 23, 24, 25.
        kind: u8,
        /// Nodes per cell.
        nodes: usize,
        /// Node numbers in VTK's order, cell after cell.
        connectivity: &'a [usize],
    },
}

/// Writes one frame; the file appears whole or not at all.
///
/// # Errors
/// The disk's own error, or [`io::ErrorKind::InvalidData`] for a value that is not finite.
pub fn write(
    path: &Path,
    dimension: usize,
    points: &[f64],
    cells: Cells<'_>,
    columns: &[Column<'_>],
) -> io::Result<()> {
    let count = points.len() / dimension;
    let mut blocks = Blocks::default();
    let mut xml = String::new();
    let (kind, piece) = match cells {
        Cells::Vertices => ("PolyData", format!("NumberOfPoints=\"{count}\" NumberOfVerts=\"{count}\"")),
        Cells::Uniform { nodes, connectivity, .. } => (
            "UnstructuredGrid",
            format!("NumberOfPoints=\"{count}\" NumberOfCells=\"{}\"", connectivity.len() / nodes),
        ),
    };
    let _ = write!(
        xml,
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n<{kind}>\n<Piece {piece}>\n<Points>\n"
    );
    xml += &blocks.floats("Points", 3, &padded(points, dimension))?;
    xml += "</Points>\n<PointData>\n";
    for column in columns {
        debug_assert_eq!(column.values.len(), count * column.components, "{}", column.name);
        if column.components == 1 {
            xml += &blocks.floats(column.name, 1, &single(column.values))?;
        } else {
            xml += &blocks.floats(column.name, 3, &padded(column.values, column.components))?;
        }
    }
    xml += "</PointData>\n";
    match cells {
        Cells::Vertices => {
            xml += "<Verts>\n";
            xml += &blocks.integers("connectivity", 0..count);
            xml += &blocks.integers("offsets", 1..=count);
            xml += "</Verts>\n";
        }
        Cells::Uniform { kind, nodes, connectivity } => {
            let cell_count = connectivity.len() / nodes;
            xml += "<Cells>\n";
            xml += &blocks.integers("connectivity", connectivity.iter().copied());
            xml += &blocks.integers("offsets", (1..=cell_count).map(|cell| cell * nodes));
            xml += &blocks.bytes("types", &vec![kind; cell_count]);
            xml += "</Cells>\n";
        }
    }
    let _ = write!(xml, "</Piece>\n</{kind}>\n<AppendedData encoding=\"raw\">\n_");
    let partial = path.with_extension("partial");
    let mut file = io::BufWriter::new(std::fs::File::create(&partial)?);
    file.write_all(xml.as_bytes())?;
    file.write_all(&blocks.data)?;
    file.write_all(b"\n</AppendedData>\n</VTKFile>\n")?;
    file.into_inner().map_err(io::IntoInnerError::into_error)?;
    std::fs::rename(&partial, path)
}

/// Writes the list of frames (time in s, file beside it).
///
/// # Errors
/// The disk's own error.
pub fn write_collection(path: &Path, frames: &[(f64, String)]) -> io::Result<()> {
    let mut xml = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n",
    );
    for (time, file) in frames {
        let _ = writeln!(xml, "<DataSet timestep=\"{time:?}\" file=\"{file}\"/>");
    }
    xml += "</Collection>\n</VTKFile>\n";
    let partial = path.with_extension("partial");
    std::fs::write(&partial, xml)?;
    std::fs::rename(&partial, path)
}

fn single(values: &[f64]) -> Vec<f32> {
    values.iter().map(|&value| value as f32).collect()
}

fn padded(values: &[f64], dimension: usize) -> Vec<f32> {
    let mut out = Vec::with_capacity(values.len() / dimension * 3);
    for point in values.chunks_exact(dimension) {
        out.extend((0..3).map(|axis| point.get(axis).map_or(0.0, |&value| value as f32)));
    }
    out
}

#[derive(Default)]
struct Blocks {
    data: Vec<u8>,
}

impl Blocks {
    fn entry(&mut self, kind: &str, name: &str, components: usize, bytes: &[u8]) -> String {
        let offset = self.data.len();
        self.data.extend_from_slice(&(bytes.len() as u64).to_le_bytes());
        self.data.extend_from_slice(bytes);
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"appended\" \
             offset=\"{offset}\"/>\n"
        )
    }

    fn floats(&mut self, name: &str, components: usize, values: &[f32]) -> io::Result<String> {
        if let Some(bad) = values.iter().position(|value| !value.is_finite()) {
            let what = format!("{name} of point {} is not finite", bad / components);
            return Err(io::Error::new(io::ErrorKind::InvalidData, what));
        }
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        Ok(self.entry("Float32", name, components, &bytes))
    }

    fn integers(&mut self, name: &str, values: impl Iterator<Item = usize>) -> String {
        let bytes: Vec<u8> = values.flat_map(|value| (value as i64).to_le_bytes()).collect();
        self.entry("Int64", name, 1, &bytes)
    }

    fn bytes(&mut self, name: &str, values: &[u8]) -> String {
        self.entry("UInt8", name, 1, values)
    }
}

/// A frame read back.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// `[n, 3]` m.
    pub points: Vec<f32>,
    /// Name, components, values.
    pub columns: Vec<(String, usize, Vec<f32>)>,
    /// Node numbers of the cells.
    pub connectivity: Vec<usize>,
    /// Nodes per cell.
    pub nodes_per_cell: usize,
}

impl Frame {
    /// The values of a column.
    pub fn column(&self, name: &str) -> Option<&[f32]> {
        self.columns.iter().find(|column| column.0 == name).map(|column| column.2.as_slice())
    }
}

/// Reads a file [`write()`] wrote.
///
/// # Errors
/// The disk's own error, or [`io::ErrorKind::InvalidData`] if it is no such file.
pub fn read(path: &Path) -> io::Result<Frame> {
    let bytes = std::fs::read(path)?;
    let garbled = || {
        io::Error::new(io::ErrorKind::InvalidData, format!("{} is no field file of Tidewall", path.display()))
    };
    let marker = b"<AppendedData encoding=\"raw\">\n_";
    let start = bytes.windows(marker.len()).position(|window| window == marker).ok_or_else(garbled)?;
    let xml = std::str::from_utf8(&bytes[..start]).map_err(|_| garbled())?;
    let data = &bytes[start + marker.len()..];
    let mut frame = Frame::default();
    let mut offsets = Vec::new();
    for line in xml.lines().filter(|line| line.starts_with("<DataArray")) {
        let attribute = |name: &str| {
            let rest = line.split_once(&format!(" {name}=\""))?.1;
            rest.split_once('"').map(|(value, _)| value)
        };
        let whole = |name: &str| attribute(name).and_then(|value| value.parse::<usize>().ok());
        let (Some(name), Some(components), Some(offset)) =
            (attribute("Name"), whole("NumberOfComponents"), whole("offset"))
        else {
            return Err(garbled());
        };
        let block = block(data, offset).ok_or_else(garbled)?;
        let integers = || {
            block.chunks_exact(8).map(|bytes| i64::from_le_bytes(bytes.try_into().expect("8 bytes")) as usize)
        };
        match (attribute("type"), name) {
            (Some("Float32"), _) => {
                let floats =
                    block.chunks_exact(4).map(|bytes| f32::from_le_bytes(bytes.try_into().expect("4 bytes")));
                if name == "Points" {
                    frame.points = floats.collect();
                } else {
                    frame.columns.push((name.to_owned(), components, floats.collect()));
                }
            }
            (Some("Int64"), "connectivity") => frame.connectivity = integers().collect(),
            (Some("Int64"), _) => offsets = integers().collect(),
            _ => {}
        }
    }
    frame.nodes_per_cell = offsets.first().copied().unwrap_or_default();
    Ok(frame)
}

fn block(data: &[u8], offset: usize) -> Option<&[u8]> {
    let header = data.get(offset..offset.checked_add(8)?)?;
    let len = u64::from_le_bytes(header.try_into().ok()?) as usize;
    data.get(offset + 8..(offset + 8).checked_add(len)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_read_back_as_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vtu");
        let points = [0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0];
        let columns = [
            Column { name: "pressure_pa", components: 1, values: &[1.0, 2.0, 3.0, 4.0] },
            Column { name: "velocity_m_s", components: 2, values: &[1.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 7.0] },
        ];
        let cells = Cells::Uniform { kind: 9, nodes: 4, connectivity: &[0, 1, 2, 3] };
        write(&path, 2, &points, cells, &columns).unwrap();
        let frame = read(&path).unwrap();
        assert_eq!(frame.points[3..6], [1.0, 0.0, 0.0]);
        assert_eq!(frame.column("pressure_pa").unwrap(), [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(frame.column("velocity_m_s").unwrap()[9..], [0.0, 7.0, 0.0]);
        assert_eq!((frame.connectivity, frame.nodes_per_cell), (vec![0, 1, 2, 3], 4));
    }

    #[test]
    fn a_value_that_is_not_finite_is_never_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vtp");
        let column = Column { name: "p", components: 1, values: &[f64::NAN] };
        assert!(write(&path, 2, &[0.0, 0.0], Cells::Vertices, &[column]).is_err());
        assert!(!path.exists());
    }
}
