//! What a run writes of the water: series of the gauges, frames for ParaView.

use std::path::{Path, PathBuf};

use protocol::case::{BoxFace, Gauge, GaugeKind};
use protocol::failure::Failure;
use protocol::series::{Series, unwritable};
use protocol::vtk::{Cells, Column, write, write_collection};

use crate::fluid::Fluid;
use crate::gauges::ForceAndMoment;
use crate::scene::Face;
use crate::vector::Vector;

/// Names of the components.
const AXES: [&str; 3] = ["x", "y", "z"];

/// The gauges of the water with their files.
pub struct GaugeSeries<const D: usize> {
    gauges: Vec<(Gauge, Series)>,
    values: Vec<f64>,
}

impl<const D: usize> GaugeSeries<D> {
    /// Starts the files of all gauges that are the water's.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn create(folder: &Path, gauges: &[Gauge], every: f64) -> Result<Self, Failure> {
        let own = gauges.iter().filter(|gauge| gauge.kind.is_of_fluid());
        let start = |gauge: &Gauge| {
            let columns = columns::<D>(&gauge.kind);
            let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
            Ok((gauge.clone(), Series::create(folder, &gauge.name, &columns, every)?))
        };
        Ok(Self { gauges: own.map(start).collect::<Result<_, Failure>>()?, values: Vec::new() })
    }

    /// Whether the water has no gauge.
    pub fn is_empty(&self) -> bool {
        self.gauges.is_empty()
    }

    /// Writes one row of every gauge; returns name and first value of the first one.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn record(&mut self, time: f64, fluid: &Fluid<D>) -> Result<Option<(String, f64)>, Failure> {
        let mut shown = None;
        for (gauge, series) in &mut self.gauges {
            self.values.clear();
            measure(&gauge.kind, fluid, &mut self.values);
            series.row(time, &self.values)?;
            shown = shown.or_else(|| self.values.first().map(|&value| (gauge.name.clone(), value)));
        }
        Ok(shown)
    }

    /// Time before which each series has no row, s.
    pub fn due(&self) -> Vec<f64> {
        self.gauges.iter().map(|(_, series)| series.due()).collect()
    }

    /// Goes on where a series of another run has ended.
    pub fn wait_until(&mut self, due: &[f64]) {
        self.gauges.iter_mut().zip(due).for_each(|((_, series), due)| series.wait_until(*due));
    }

    /// Brings all rows to the disk.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn flush(&mut self) -> Result<(), Failure> {
        self.gauges.iter_mut().try_for_each(|(_, series)| series.flush())
    }
}

fn columns<const D: usize>(kind: &GaugeKind) -> Vec<String> {
    let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
    match kind {
        GaugeKind::Pressure { .. } => names(&["p_pa"]),
        GaugeKind::Front { axis } => vec![format!("{}_m", AXES[*axis])],
        GaugeKind::WaterLevel { .. } => names(&["level_m"]),
        GaugeKind::Force { .. } => {
            let forces = AXES[..D].iter().map(|axis| format!("f{axis}_n"));
            let moments = AXES[if D == 2 { 2 } else { 0 }..].iter().map(|axis| format!("m{axis}_nm"));
            forces.chain(moments).collect()
        }
        GaugeKind::Energy { .. } => names(&["kinetic_j", "potential_j", "work_j"]),
        GaugeKind::Volume => names(&["volume_m3"]),
        GaugeKind::HydrostaticError => names(&["l2_relative"]),
        GaugeKind::Centre => AXES[..D].iter().map(|axis| format!("c{axis}_m")).collect(),
        GaugeKind::Momentum => {
            let momenta = AXES[..D].iter().map(|axis| format!("p{axis}_ns"));
            let moments = AXES[if D == 2 { 2 } else { 0 }..].iter().map(|axis| format!("l{axis}_nms"));
            momenta.chain(moments).collect()
        }
        GaugeKind::Displacement { .. } | GaugeKind::Reaction | GaugeKind::Frequency => Vec::new(),
    }
}

fn measure<const D: usize>(kind: &GaugeKind, fluid: &Fluid<D>, values: &mut Vec<f64>) {
    let at = |point: &[f64]| -> Vector<D> { std::array::from_fn(|k| point[k]) };
    let tank = &fluid.scene().tank;
    match kind {
        GaugeKind::Pressure { points } => {
            let sum: f64 = points.iter().map(|point| fluid.pressure_at(&at(point))).sum();
            values.push(sum / points.len() as f64);
        }
        GaugeKind::Front { axis } => {
            let front = fluid.front(*axis, true);
            values.push(if front.is_nan() { tank.min[*axis] } else { front });
        }
        GaugeKind::WaterLevel { point } => {
            let level = fluid.level(&at(point)) - tank.min[1];
            values.push(if level.is_nan() { 0.0 } else { level });
        }
        GaugeKind::Force { on } => {
            let origin = [0.0; D];
            let total = match BoxFace::from_name(on) {
                Some(face) => {
                    fluid.force_on_face(Face { axis: face.axis(), upper: face.sign() > 0.0 }, &origin)
                }
                None if on == "obstacles" => fluid.force_on_obstacles(&origin),
                None => fluid.force_on_body(&origin),
            };
            push_force(total, values);
        }
        GaugeKind::Energy { .. } => values.extend(<[f64; 3]>::from(fluid.energy())),
        GaugeKind::Volume => values.push(fluid.volume()),
        GaugeKind::HydrostaticError => values.push(fluid.hydrostatic_error()),
        GaugeKind::Centre => values.extend(fluid.centre()),
        GaugeKind::Momentum => {
            values.extend(fluid.momentum());
            values.extend(&fluid.angular_momentum(&[0.0; D])[if D == 2 { 2 } else { 0 }..]);
        }
        GaugeKind::Displacement { .. } | GaugeKind::Reaction | GaugeKind::Frequency => {}
    }
}

fn push_force<const D: usize>(total: ForceAndMoment<D>, values: &mut Vec<f64>) {
    values.extend(total.force);
    values.extend(&total.moment[if D == 2 { 2 } else { 0 }..]);
}

/// Frames of the particles in `fields/`.
pub struct Frames {
    folder: PathBuf,
    written: Vec<(f64, String)>,
}

impl Frames {
    /// Frames in `fields/` of the run folder.
    pub fn new(folder: PathBuf) -> Self {
        Self { folder: folder.join("fields"), written: Vec::new() }
    }

    /// Writes positions, velocities, pressures and densities of all water particles, and the list of frames.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn write<const D: usize>(&mut self, frame: u32, time: f64, fluid: &Fluid<D>) -> Result<(), Failure> {
        let name = format!("fluid_{frame:05}.vtp");
        let path = self.folder.join(&name);
        let water = fluid.water();
        let position: Vec<f64> = water.position.iter().flatten().copied().collect();
        let velocity: Vec<f64> = water.velocity.iter().flatten().copied().collect();
        let pressure: Vec<f64> = water.pressure.iter().map(|&p| f64::from(p)).collect();
        let lattice = fluid.lattice_density();
        let density: Vec<f64> = water.number_density.iter().map(|&n| f64::from(n) / lattice).collect();
        let columns = [
            Column { name: "velocity_m_s", components: D, values: &velocity },
            Column { name: "pressure_pa", components: 1, values: &pressure },
            Column { name: "density_ratio", components: 1, values: &density },
        ];
        let result = std::fs::create_dir_all(&self.folder)
            .and_then(|()| write(&path, D, &position, Cells::Vertices, &columns));
        result.map_err(|error| unwritable(&path, &error))?;
        // The frame at the end of a run may be the last one written once more.
        self.written.retain(|(_, written)| *written != name);
        self.written.push((time, name));
        let list = self.folder.join("fluid.pvd");
        write_collection(&list, &self.written).map_err(|error| unwritable(&list, &error))
    }
}
