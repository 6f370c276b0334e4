//! The interface ledger: force, moment, impulse and work on both sides at every step.
//!
//! Two things are kept apart: the *mapping balance* (the same motion and load through H and H': round-off) and the
//! *work mismatch* (what staggering in time costs: shown and bounded, never zero).

use std::path::Path;

use protocol::failure::Failure;
use protocol::series::Series;
use serde::{Deserialize, Serialize};

/// What one step exchanged. `[n, D]` arrays of the fluid's and the solid's side.
pub struct Entry<'a> {
    /// End of the step, s.
    pub time: f64,
    /// Its length, s.
    pub dt: f64,
    /// Positions of the fluid's nodes, m.
    pub fluid_position: &'a [f64],
    /// Velocity given to the fluid, m/s.
    pub fluid_velocity: &'a [f64],
    /// The solid's motion over the step, carried to the fluid's nodes by H, m.
    pub carried_motion: &'a [f64],
    /// Load that acts, on the fluid's nodes, N.
    pub fluid_load: &'a [f64],
    /// Positions of the fluid's nodes in the unloaded body, where H was made, m.
    pub fluid_reference: &'a [f64],
    /// Positions of the solid's nodes in the unloaded body, m.
    pub solid_reference: &'a [f64],
    /// Positions of the solid's nodes at the start of the step, m.
    pub solid_position: &'a [f64],
    /// Motion of the solid's nodes over the step, m.
    pub solid_motion: &'a [f64],
    /// Load that acts, on the solid's nodes, N.
    pub solid_load: &'a [f64],
    /// Load that has acted on the solid during the step: one step older than `solid_load` in the parallel scheme, N.
    pub acted_load: &'a [f64],
    /// Pair reaction on the fluid's nodes, N.
    pub pair_load: &'a [f64],
    /// Marker tractions integrated to the fluid's nodes, N.
    pub marker_load: &'a [f64],
    /// Passes over the step.
    pub passes: u32,
}

/// Sums since the start.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Totals {
    /// Impulse of the pair reaction, N s.
    pub pair_impulse: [f64; 3],
    /// Impulse of the marker tractions, N s.
    pub marker_impulse: [f64; 3],
    /// Impulse the solid has got, N s.
    pub solid_impulse: [f64; 3],
    /// Work given by the fluid, J.
    pub fluid_work: f64,
    /// Work taken by the solid, J.
    pub solid_work: f64,
    /// Sum of |F . du| over the steps, J.
    pub absolute_work: f64,
    /// Greatest force imbalance of the mapping, relative.
    pub force_imbalance: f64,
    /// Greatest moment imbalance of the mapping, relative.
    pub moment_imbalance: f64,
    /// Greatest work imbalance of the mapping, relative.
    pub work_imbalance: f64,
}

/// The ledger and its series `interface.csv`.
pub struct Ledger {
    dimension: usize,
    totals: Totals,
    series: Series,
    row: Vec<f64>,
}

impl Ledger {
    /// Starts the series.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn create(folder: &Path, dimension: usize, every: f64) -> Result<Self, Failure> {
        let axes = &["x", "y", "z"][..dimension];
        let per_axis = |name: &str, unit: &str| {
            axes.iter().map(|axis| format!("{name}{axis}_{unit}")).collect::<Vec<_>>()
        };
        let moments = |name: &str| match dimension {
            2 => vec![format!("{name}mz_nm")],
            _ => per_axis(&format!("{name}m"), "nm"),
        };
        let fluid = [per_axis("f", "n"), per_axis("marker_f", "n"), moments(""), per_axis("impulse_", "ns")];
        let solid = [per_axis("solid_f", "n"), moments("solid_"), per_axis("solid_impulse_", "ns")];
        let scalars = [
            "work_fluid_j",
            "work_solid_j",
            "load_jump",
            "mapping_force_imbalance",
            "mapping_moment_imbalance",
            "mapping_work_imbalance",
            "passes",
        ];
        let columns: Vec<String> =
            fluid.concat().into_iter().chain(solid.concat()).chain(scalars.map(str::to_owned)).collect();
        let names: Vec<&str> = columns.iter().map(String::as_str).collect();
        let series = Series::create(folder, "interface", &names, every)?;
        Ok(Self { dimension, totals: Totals::default(), series, row: Vec::with_capacity(columns.len()) })
    }

    /// Books one step; `load_jump` is the running one.
    ///
    /// # Errors
    /// The series cannot be written.
    pub fn book(&mut self, entry: &Entry<'_>, load_jump: f64) -> Result<(), Failure> {
        let dimension = self.dimension;
        let pair = sum(entry.pair_load, dimension);
        let markers = sum(entry.marker_load, dimension);
        let (given, taken) = (sum(entry.fluid_load, dimension), sum(entry.solid_load, dimension));
        let fluid_moment = moment(entry.fluid_position, entry.fluid_load, dimension);
        let acted = sum(entry.acted_load, dimension);
        let solid_moment = moment(entry.solid_position, entry.acted_load, dimension);
        let fluid_work = entry.dt * dot(entry.fluid_load, entry.fluid_velocity);
        let solid_work = dot(entry.acted_load, entry.solid_motion);
        let totals = &mut self.totals;
        for axis in 0..3 {
            totals.pair_impulse[axis] += entry.dt * pair[axis];
            totals.marker_impulse[axis] += entry.dt * markers[axis];
            totals.solid_impulse[axis] += entry.dt * acted[axis];
        }
        totals.fluid_work += fluid_work;
        totals.solid_work += solid_work;
        totals.absolute_work += solid_work.abs();
        let scale = absolute(entry.fluid_load);
        let force_imbalance = relative(largest(&[given, taken]), scale);
        totals.force_imbalance = totals.force_imbalance.max(force_imbalance);
        let moments = [
            moment(entry.fluid_reference, entry.fluid_load, dimension),
            moment(entry.solid_reference, entry.solid_load, dimension),
        ];
        let moment_imbalance = relative(largest(&moments), scale * greatest(entry.solid_reference));
        totals.moment_imbalance = totals.moment_imbalance.max(moment_imbalance);
        let work_scale = scale * greatest(entry.solid_motion);
        let carried = dot(entry.fluid_load, entry.carried_motion);
        let mapped = dot(entry.solid_load, entry.solid_motion);
        let work_imbalance = relative((carried - mapped).abs(), work_scale);
        totals.work_imbalance = totals.work_imbalance.max(work_imbalance);
        let imbalances = [load_jump, force_imbalance, moment_imbalance, work_imbalance];
        self.row.clear();
        let Totals { pair_impulse, solid_impulse, fluid_work, solid_work, .. } = self.totals;
        self.write_vectors([pair, markers], fluid_moment, pair_impulse);
        self.write_vectors([acted], solid_moment, solid_impulse);
        self.row.extend_from_slice(&[fluid_work, solid_work]);
        self.row.extend_from_slice(&imbalances);
        self.row.push(f64::from(entry.passes));
        self.series.row(entry.time, &self.row)
    }

    /// Forces, moment and impulse of one side.
    fn write_vectors<const N: usize>(&mut self, forces: [[f64; 3]; N], moment: [f64; 3], impulse: [f64; 3]) {
        let dimension = self.dimension;
        forces.iter().for_each(|force| self.row.extend_from_slice(&force[..dimension]));
        self.row.extend_from_slice(if dimension == 2 { &moment[2..] } else { &moment });
        self.row.extend_from_slice(&impulse[..dimension]);
    }

    /// Sums since the start.
    pub fn totals(&self) -> &Totals {
        &self.totals
    }

    /// Time before which the series has no row, s.
    pub fn due(&self) -> f64 {
        self.series.due()
    }

    /// Goes on from the sums of another run and where its series has ended.
    pub fn take_up(&mut self, totals: Totals, due: f64) {
        self.totals = totals;
        self.series.wait_until(due);
    }

    /// |W_fluid - W_solid| / sum |F . du|: what staggering in time has cost so far.
    pub fn work_mismatch(&self) -> f64 {
        relative(self.work_difference(), self.totals.absolute_work)
    }

    /// |W_fluid - W_solid|, J.
    pub fn work_difference(&self) -> f64 {
        (self.totals.fluid_work - self.totals.solid_work).abs()
    }

    /// Brings the series to the disk.
    ///
    /// # Errors
    /// The disk is full.
    pub fn flush(&mut self) -> Result<(), Failure> {
        self.series.flush()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn absolute(values: &[f64]) -> f64 {
    values.iter().map(|value| value.abs()).sum()
}

fn greatest(values: &[f64]) -> f64 {
    values.iter().fold(0.0_f64, |greatest, value| greatest.max(value.abs()))
}

fn relative(error: f64, scale: f64) -> f64 {
    if scale > 0.0 { error / scale } else { 0.0 }
}

fn largest(pair: &[[f64; 3]; 2]) -> f64 {
    (0..3).map(|axis| (pair[0][axis] - pair[1][axis]).abs()).fold(0.0, f64::max)
}

/// Sum of nodal vectors, padded to three components.
pub fn sum(values: &[f64], dimension: usize) -> [f64; 3] {
    let mut total = [0.0; 3];
    for value in values.chunks_exact(dimension) {
        (0..dimension).for_each(|axis| total[axis] += value[axis]);
    }
    total
}

/// Moment of nodal forces about the origin, N m.
pub fn moment(position: &[f64], force: &[f64], dimension: usize) -> [f64; 3] {
    if dimension == 2 { moment_of::<2>(position, force) } else { moment_of::<3>(position, force) }
}

fn moment_of<const D: usize>(position: &[f64], force: &[f64]) -> [f64; 3] {
    let pad = |v: &[f64]| -> [f64; 3] { std::array::from_fn(|axis| if axis < D { v[axis] } else { 0.0 }) };
    let mut total = [0.0; 3];
    for (x, f) in position.chunks_exact(D).zip(force.chunks_exact(D)) {
        let (x, f) = (pad(x), pad(f));
        total[0] += x[1] * f[2] - x[2] * f[1];
        total[1] += x[2] * f[0] - x[0] * f[2];
        total[2] += x[0] * f[1] - x[1] * f[0];
    }
    total
}
