//! The interface ledger: force, moment, impulse and work on both sides at every step.
//!
//! Two things are kept apart: the *mapping balance* (the same motion and load through H and H': round-off) and the
//! *work mismatch* (what staggering in time costs: shown and bounded, never zero).

use std::path::Path;

use protocol::failure::Failure;
use protocol::interface::Surface;
use protocol::series::Series;
use serde::{Deserialize, Serialize};

use crate::resultant::Resultant;

/// What one step exchanged.
pub struct Entry {
    /// End of the step, s.
    pub time: f64,
    /// Its length, s.
    pub dt: f64,
    /// Force and moment.
    pub loads: LoadSums,
    /// Work.
    pub works: WorkSums,
    /// Passes over the step.
    pub passes: u32,
}

/// What the loads of one step come to. Follows from the water's answer: it is found while the structure moves.
#[derive(Debug, Clone, Copy)]
pub struct LoadSums {
    /// Of the load that acts, on the fluid's nodes in their place over the step.
    pub fluid: Resultant,
    /// Of the same load on the solid's nodes, at the start of the step.
    pub solid: Resultant,
    /// Of the load that has acted on the solid during the step: one step older in the parallel scheme.
    pub acted: Resultant,
    /// Pair reaction, N.
    pub pair: [f64; 3],
    /// Marker tractions, N.
    pub markers: [f64; 3],
    /// Load that acts times the velocity given to the fluid, W.
    pub power: f64,
}

/// What the loads of one step do along the solid's motion over it.
#[derive(Debug, Clone, Copy)]
pub struct WorkSums {
    /// Of the load on the fluid's nodes, along the motion carried there by H, J.
    pub carried: f64,
    /// Of the same load on the solid's nodes, J.
    pub mapped: f64,
    /// Of the load that has acted during the step, J.
    pub acted: f64,
    /// Greatest motion, m.
    pub greatest_motion: f64,
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
    /// Greatest coordinate of the solid's nodes in the unloaded body, m: the scale of moments.
    size: f64,
    totals: Totals,
    series: Series,
    row: Vec<f64>,
}

impl Ledger {
    /// Starts the series for a solid with this surface.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn create(folder: &Path, surface: &Surface, every: f64) -> Result<Self, Failure> {
        let dimension = surface.dimension;
        let size = surface.reference_position.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
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
        let row = Vec::with_capacity(columns.len());
        Ok(Self { dimension, size, totals: Totals::default(), series, row })
    }

    /// Books one step; `load_jump` is the running one.
    ///
    /// # Errors
    /// The series cannot be written.
    pub fn book(&mut self, entry: &Entry, load_jump: f64) -> Result<(), Failure> {
        let Entry { time, dt, loads, works, passes } = *entry;
        let totals = &mut self.totals;
        for axis in 0..3 {
            totals.pair_impulse[axis] += dt * loads.pair[axis];
            totals.marker_impulse[axis] += dt * loads.markers[axis];
            totals.solid_impulse[axis] += dt * loads.acted.force[axis];
        }
        totals.fluid_work += dt * loads.power;
        totals.solid_work += works.acted;
        totals.absolute_work += works.acted.abs();
        let imbalances = imbalances(&loads, &works, self.size);
        let greatest =
            [&mut totals.force_imbalance, &mut totals.moment_imbalance, &mut totals.work_imbalance];
        greatest.into_iter().zip(imbalances).for_each(|(greatest, found)| *greatest = greatest.max(found));
        self.row.clear();
        let Totals { pair_impulse, solid_impulse, fluid_work, solid_work, .. } = self.totals;
        self.write_vectors([loads.pair, loads.markers], loads.fluid.moment, pair_impulse);
        self.write_vectors([loads.acted.force], loads.acted.moment, solid_impulse);
        self.row.extend_from_slice(&[fluid_work, solid_work, load_jump]);
        self.row.extend_from_slice(&imbalances);
        self.row.push(f64::from(passes));
        self.series.row(time, &self.row)
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

/// How far force, moment and work differ between the two ends of the mapping, relative to what round-off is measured by.
fn imbalances(loads: &LoadSums, works: &WorkSums, size: f64) -> [f64; 3] {
    let (there, here) = (&loads.fluid, &loads.solid);
    let scale: f64 = there.absolute.iter().sum();
    [
        relative(largest(there.force, here.force), scale),
        relative(largest(there.tied_moment, here.tied_moment), scale * size),
        relative((works.carried - works.mapped).abs(), scale * works.greatest_motion),
    ]
}

fn relative(error: f64, scale: f64) -> f64 {
    if scale > 0.0 { error / scale } else { 0.0 }
}

fn largest(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).abs()).fold(0.0, f64::max)
}
