//! What the solid records: its gauges as series, its fields as frames.

use std::path::{Path, PathBuf};

use protocol::case::{Gauge, GaugeKind, Shared};
use protocol::failure::Failure;
use protocol::series::{Series, unwritable};
use protocol::vtk::{self, Cells, Column};

use crate::material::tensor;
use crate::mesh::Mesh;
use crate::modes::Mode;
use crate::probe::Probe;
use crate::solid::Solid;

const DISPLACEMENT: [&str; 3] = ["ux_m", "uy_m", "uz_m"];
const REACTION_2D: [&str; 3] = ["fx_n", "fy_n", "mz_nm"];
const REACTION_3D: [&str; 6] = ["fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm"];
const FREQUENCY: [&str; 1] = ["f_hz"];
const ENERGY: [&str; 3] = ["kinetic_j", "potential_j", "strain_j"];

/// What one series holds.
enum Measure {
    Displacement(Probe),
    Reaction,
    Energy,
    Frequency,
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

    /// Time before which each series has no row, s.
    pub(crate) fn due(&self) -> Vec<f64> {
        self.series.iter().map(|(_, series)| series.due()).collect()
    }

    /// Goes on where a series of another run has ended.
    pub(crate) fn wait_until(&mut self, due: &[f64]) {
        self.series.iter_mut().zip(due).for_each(|((_, series), due)| series.wait_until(*due));
    }

    /// The row of a mode in the series of frequencies and displacements; its number stands for the time.
    pub(crate) fn record_mode(&mut self, number: f64, mode: &Mode, dimension: usize) -> Result<(), Failure> {
        self.shown = Some((FREQUENCY[0].to_owned(), mode.frequency));
        for (measure, series) in &mut self.series {
            match measure {
                Measure::Frequency => series.row(number, &[mode.frequency])?,
                Measure::Displacement(probe) => {
                    series.row(number, &probe.value(&mode.shape, dimension)[..dimension])?;
                }
                Measure::Reaction | Measure::Energy => {}
            }
        }
        Ok(())
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
        self.flush()?;
        let Some(folder) = self.fields.clone() else { return Ok(()) };
        let name = format!("solid_{frame:05}.vtu");
        write_state(&folder, &name, solid)?;
        self.list(&folder, time, name)
    }

    /// The same for a mode: its shape as displacement, its number as time.
    pub(crate) fn output_mode(&mut self, number: f64, mode: &Mode, solid: &Solid) -> Result<(), Failure> {
        self.flush()?;
        let Some(folder) = self.fields.clone() else { return Ok(()) };
        let name = format!("solid_{number:05}.vtu");
        let components = solid.mesh().dimension;
        let column = Column { name: "displacement_m", components, values: &mode.shape };
        write_frame(&folder, &name, solid.mesh(), &mode.shape, &[column])?;
        self.list(&folder, number, name)
    }

    /// Writes the state a failed step started from, whether or not the case asks for frames.
    pub(crate) fn last_good(&mut self, folder: &Path, solid: &Solid) -> Result<(), Failure> {
        self.flush()?;
        write_state(&folder.join("fields"), "solid_last_good.vtu", solid)
    }

    fn flush(&mut self) -> Result<(), Failure> {
        self.series.iter_mut().try_for_each(|(_, series)| series.flush())
    }

    fn list(&mut self, folder: &Path, time: f64, name: String) -> Result<(), Failure> {
        add_frame(&mut self.frames, time, name);
        let list = folder.join("solid.pvd");
        vtk::write_collection(&list, &self.frames).map_err(|error| unwritable(&list, &error))
    }
}

/// Writes motion and stress of a state.
fn write_state(folder: &Path, name: &str, solid: &Solid) -> Result<(), Failure> {
    let vector = |name, values| Column { name, components: solid.mesh().dimension, values };
    let stress = Stresses::of(solid);
    let columns = [
        vector("displacement_m", solid.displacement()),
        vector("velocity_m_s", solid.velocity()),
        vector("acceleration_m_s2", solid.acceleration()),
        Column { name: "von_mises_pa", components: 1, values: &stress.von_mises },
        Column { name: "principal_stress_pa", components: 3, values: &stress.principal },
        Column { name: "normal_stress_pa", components: 3, values: &stress.normal },
        Column { name: "shear_stress_pa", components: 3, values: &stress.shear },
    ];
    write_frame(folder, name, solid.mesh(), solid.displacement(), &columns)
}

fn write_frame(
    folder: &Path,
    name: &str,
    mesh: &Mesh,
    displacement: &[f64],
    columns: &[Column<'_>],
) -> Result<(), Failure> {
    std::fs::create_dir_all(folder).map_err(|error| unwritable(folder, &error))?;
    let position = mesh.reference_position.iter().zip(displacement);
    let position: Vec<f64> = position.map(|(x, u)| x + u).collect();
    let cells = Cells::Uniform {
        kind: mesh.cell.vtk(),
        nodes: mesh.nodes_per_element(),
        connectivity: &mesh.connectivity,
    };
    let path = folder.join(name);
    vtk::write(&path, mesh.dimension, &position, cells, columns).map_err(|error| unwritable(&path, &error))
}

/// Cauchy stress at the nodes as it is written.
struct Stresses {
    /// `[n]` Pa.
    von_mises: Vec<f64>,
    /// Greatest first, `[n, 3]` Pa.
    principal: Vec<f64>,
    /// xx yy zz, `[n, 3]` Pa.
    normal: Vec<f64>,
    /// xy yz zx, `[n, 3]` Pa.
    shear: Vec<f64>,
}

impl Stresses {
    fn of(solid: &Solid) -> Self {
        let nodal = solid.nodal_stress();
        let invariants: Vec<_> = nodal.iter().map(tensor::invariants).collect();
        Self {
            von_mises: invariants.iter().map(|invariant| invariant.1).collect(),
            principal: invariants.iter().flat_map(|invariant| invariant.0).collect(),
            normal: nodal.iter().flat_map(|stress| stress[..3].to_vec()).collect(),
            shear: nodal.iter().flat_map(|stress| stress[3..].to_vec()).collect(),
        }
    }
}

/// Adds a frame to the list; one of the same name replaces the last.
pub(crate) fn add_frame(frames: &mut Vec<(f64, String)>, time: f64, name: String) {
    frames.retain(|known| known.1 != name);
    frames.push((time, name));
}

fn measure(gauge: &Gauge, dimension: usize, solid: &Solid) -> Option<(Measure, &'static [&'static str])> {
    match &gauge.kind {
        GaugeKind::Displacement { point } => {
            let probe = Probe::at(solid.mesh(), point)?;
            Some((Measure::Displacement(probe), &DISPLACEMENT[..dimension]))
        }
        GaugeKind::Reaction if dimension == 2 => Some((Measure::Reaction, &REACTION_2D)),
        GaugeKind::Reaction => Some((Measure::Reaction, &REACTION_3D)),
        GaugeKind::Energy { .. } => Some((Measure::Energy, &ENERGY)),
        GaugeKind::Frequency => Some((Measure::Frequency, &FREQUENCY)),
        _ => None,
    }
}

fn shown_name(measure: &Measure, dimension: usize) -> &'static str {
    match measure {
        Measure::Displacement(_) => DISPLACEMENT[0],
        Measure::Reaction if dimension == 2 => REACTION_2D[0],
        Measure::Reaction => REACTION_3D[0],
        Measure::Energy => ENERGY[0],
        Measure::Frequency => FREQUENCY[0],
    }
}

fn row(measure: &Measure, dimension: usize, solid: &mut Solid) -> ([f64; 6], usize) {
    match measure {
        Measure::Displacement(probe) => {
            let [x, y, z] = probe.value(solid.displacement(), dimension);
            ([x, y, z, 0.0, 0.0, 0.0], dimension)
        }
        Measure::Reaction => reaction_row(dimension, solid.reaction().force, solid.reaction().moment),
        // Only modes have a frequency, and they are recorded on their own.
        Measure::Frequency => ([f64::NAN; 6], 1),
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
