//! What the solid records: its gauges as series, its fields as frames.

use std::path::PathBuf;

use protocol::case::{Gauge, GaugeKind, Shared};
use protocol::failure::Failure;
use protocol::series::{Series, unwritable};
use protocol::vtk::{self, Cells, Column};

use crate::probe::Probe;
use crate::solid::Solid;

const DISPLACEMENT: [&str; 3] = ["ux_m", "uy_m", "uz_m"];
const REACTION_2D: [&str; 3] = ["fx_n", "fy_n", "mz_nm"];
const REACTION_3D: [&str; 6] = ["fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm"];
const ENERGY: [&str; 3] = ["kinetic_j", "potential_j", "strain_j"];

/// What one series holds.
enum Measure {
    Displacement(Probe),
    Reaction,
    Energy,
}

/// The open series and the frames written.
pub(crate) struct Recorder {
    series: Vec<(Measure, Series)>,
    shown: Option<(String, f64)>,
    /// Folder of the frames, where there are any.
    fields: Option<PathBuf>,
    frames: Vec<(f64, String)>,
}

impl Recorder {
    pub(crate) fn create(shared: &Shared, folder: &std::path::Path, solid: &Solid) -> Result<Self, Failure> {
        let dimension = shared.header.dimension;
        let mut series = Vec::new();
        for gauge in shared.gauges.iter().filter(|gauge| !gauge.kind.is_of_fluid()) {
            let Some((measure, columns)) = measure(gauge, dimension, solid) else { continue };
            series.push((measure, Series::create(folder, &gauge.name, columns, shared.output.series_every)?));
        }
        let fields = shared.output.fields_every.map(|_| folder.join("fields"));
        Ok(Self { series, shown: None, fields, frames: Vec::new() })
    }

    /// One row in every series.
    pub(crate) fn record(&mut self, time: f64, solid: &mut Solid) -> Result<(), Failure> {
        let dimension = solid.mesh().dimension;
        for (order, (measure, series)) in self.series.iter_mut().enumerate() {
            let (row, count) = row(measure, dimension, solid);
            if order == 0 {
                self.shown = Some((shown_name(measure, dimension).to_owned(), row[0]));
            }
            series.row(time, &row[..count])?;
        }
        Ok(())
    }

    /// Name and last value of the first column of the first series.
    pub(crate) fn shown(&self) -> Option<(String, f64)> {
        self.shown.clone()
    }

    /// Brings the series to the disk and writes a frame, where the case asks for frames.
    pub(crate) fn output(&mut self, frame: u32, time: f64, solid: &Solid) -> Result<(), Failure> {
        for (_, series) in &mut self.series {
            series.flush()?;
        }
        let Some(fields) = &self.fields else { return Ok(()) };
        std::fs::create_dir_all(fields).map_err(|error| unwritable(fields, &error))?;
        let name = format!("solid_{frame:05}.vtu");
        let mesh = solid.mesh();
        let position = mesh.reference_position.iter().zip(solid.displacement());
        let position: Vec<f64> = position.map(|(x, u)| x + u).collect();
        let vector = |name, values| Column { name, components: mesh.dimension, values };
        let columns = [
            vector("displacement_m", solid.displacement()),
            vector("velocity_m_s", solid.velocity()),
            vector("acceleration_m_s2", solid.acceleration()),
        ];
        let cells = Cells::Uniform {
            kind: cell_kind(mesh.dimension, mesh.nodes_per_element),
            nodes: mesh.nodes_per_element,
            connectivity: &mesh.connectivity,
        };
        let path = fields.join(&name);
        vtk::write(&path, mesh.dimension, &position, cells, &columns)
            .map_err(|error| unwritable(&path, &error))?;
        add_frame(&mut self.frames, time, name);
        let list = fields.join("solid.pvd");
        vtk::write_collection(&list, &self.frames).map_err(|error| unwritable(&list, &error))
    }
}

/// Adds a frame to the list; one of the same name replaces the last.
pub(crate) fn add_frame(frames: &mut Vec<(f64, String)>, time: f64, name: String) {
    frames.retain(|known| known.1 != name);
    frames.push((time, name));
}

/// VTK's number of the cell.
pub(crate) fn cell_kind(dimension: usize, nodes: usize) -> u8 {
    match (dimension, nodes) {
        (2, 3) => 5,
        (2, _) => 9,
        (_, 4) => 10,
        _ => 12,
    }
}

fn measure(gauge: &Gauge, dimension: usize, solid: &Solid) -> Option<(Measure, &'static [&'static str])> {
    let scene = solid.scene();
    match &gauge.kind {
        GaugeKind::Displacement { point } => {
            let probe = Probe::at(&scene.grid, scene.element.is_simplex(), point)?;
            Some((Measure::Displacement(probe), &DISPLACEMENT[..dimension]))
        }
        GaugeKind::Reaction if dimension == 2 => Some((Measure::Reaction, &REACTION_2D)),
        GaugeKind::Reaction => Some((Measure::Reaction, &REACTION_3D)),
        GaugeKind::Energy { .. } => Some((Measure::Energy, &ENERGY)),
        _ => None,
    }
}

fn shown_name(measure: &Measure, dimension: usize) -> &'static str {
    match measure {
        Measure::Displacement(_) => DISPLACEMENT[0],
        Measure::Reaction if dimension == 2 => REACTION_2D[0],
        Measure::Reaction => REACTION_3D[0],
        Measure::Energy => ENERGY[0],
    }
}

fn row(measure: &Measure, dimension: usize, solid: &mut Solid) -> ([f64; 6], usize) {
    match measure {
        Measure::Displacement(probe) => {
            let [x, y, z] = probe.value(solid.displacement(), dimension);
            ([x, y, z, 0.0, 0.0, 0.0], dimension)
        }
        Measure::Reaction => reaction_row(dimension, solid.reaction().force, solid.reaction().moment),
        Measure::Energy => {
            let energies = solid.energies();
            ([energies.kinetic, energies.potential, energies.strain, 0.0, 0.0, 0.0], 3)
        }
    }
}

fn reaction_row(dimension: usize, force: [f64; 3], moment: [f64; 3]) -> ([f64; 6], usize) {
    let ([fx, fy, fz], [mx, my, mz]) = (force, moment);
    if dimension == 2 { ([fx, fy, mz, 0.0, 0.0, 0.0], 3) } else { ([fx, fy, fz, mx, my, mz], 6) }
}
