//! `solid-rigid`: a body that does not deform, fixed or with a prescribed motion. It answers every load with the motion
//! it was told and sums the load.
//!
//! This is the participant contract on one page; a solver of your own starts from here. It needs `protocol`, and of
//! this crate the surface of a box. The order of things: `check` answers `--check`; `start` opens the link to the
//! coupler, agrees on a contract, sends the surface and the motion at step 0; `advance` receives the load of the step
//! and sends the motion at its end; `output` flushes.

use std::collections::BTreeMap;

use protocol::case::{CaseFile, CheckReport, GaugeKind, LeftOut, PlanFigure, Shared};
use protocol::control::{Account, Part, Ready, Start, StepReport, StepTime};
use protocol::failure::{Failure, FailureClass};
use protocol::header::{Header, Kind};
use protocol::interface::{Contract, Surface};
use protocol::link::{Expect, Link, LinkError, Transport, agree};
use protocol::participant::{Context, Participant, Program, not_my_part};
use protocol::series::Series;
use protocol::state::{self, Stamp};

use crate::box_grid::BoxGrid;
use protocol::case::Prescribed;

const NAME: &str = "solid";
const FORCE_2D: [&str; 3] = ["fx_n", "fy_n", "mz_nm"];
const FORCE_3D: [&str; 6] = ["fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm"];
const DISPLACEMENT: [&str; 3] = ["ux_m", "uy_m", "uz_m"];

/// The stub as a program.
pub const PROGRAM: Program = Program {
    name: "solid-rigid",
    role: NAME,
    about: "Rigid body, fixed or with a prescribed motion; sums the load",
    check,
    build: |case, context| Ok(Box::new(RigidSolid::new(case, context)?)),
};

/// The rigid body of a case.
pub struct RigidSolid {
    shared: Shared,
    context: Context,
    motion: Prescribed,
    surface: Surface,
    link: Option<Box<dyn Link<f64>>>,
    series: Vec<(bool, Series)>,
    load: Vec<f64>,
    /// Force and moment about the origin of the last load, N and N m.
    total: [f64; 6],
}

/// The rigid body as read: its motion, its box, and the keys of an elastic body it has no use for.
type Body = (Prescribed, BoxGrid, Vec<&'static str>);

fn read(case: &CaseFile) -> (Shared, Option<Body>) {
    let shared = Shared::read(case);
    let outline = shared.solid.as_ref().filter(|outline| outline.model == "rigid");
    let body = outline.zip(case.section("solid")).map(|(outline, section)| {
        let dimension = shared.header.dimension;
        crate::case::skip_outline(&section, dimension, false);
        let motion = section.inner("motion").map(|motion| Prescribed::read(&motion, dimension));
        let unused = section.pass_over(&crate::case::ELASTIC_KEYS);
        section.finish();
        (motion.unwrap_or_default(), crate::case::grid(outline), unused)
    });
    (shared, body)
}

fn surface(shared: &Shared, grid: &BoxGrid) -> Surface {
    let faces = shared.solid.as_ref().map(|outline| outline.interface_faces()).unwrap_or_default();
    grid.surface(&faces, false, 0.0).0
}

/// The answer of `solid-rigid --check`.
pub fn check(case: &CaseFile) -> CheckReport {
    let (shared, body) = read(case);
    let (mut plan, mut left_out) = (Vec::new(), Vec::new());
    if let Some((motion, grid, unused)) = body.filter(|_| case.diagnostics().is_empty()) {
        let nodes = surface(&shared, &grid).node_count() as f64;
        plan.push(PlanFigure::new("surface_nodes", nodes, "interface nodes of the rigid body"));
        if motion == Prescribed::Fixed {
            left_out.push(LeftOut::new("motion of the body", "the case has no [solid.motion]"));
        }
        if !unused.is_empty() {
            left_out.push(LeftOut::new(&unused.join(", "), "keys of an elastic body; this one is rigid"));
        }
    }
    CheckReport::new("solid-rigid", case, plan, left_out).with_state()
}

impl RigidSolid {
    /// Reads the case.
    ///
    /// # Errors
    /// A case without a rigid solid, or one that did not pass the check.
    pub fn new(case: &CaseFile, context: &Context) -> Result<Self, Failure> {
        let (shared, body) = read(case);
        let refuse = |what: String| Failure::new(FailureClass::Case, NAME, "start", what);
        if let Some(diagnostic) = case.diagnostics().first() {
            return Err(refuse(diagnostic.to_string()));
        }
        let (motion, grid, _) = body.ok_or_else(|| refuse("the case has no rigid solid".to_owned()))?;
        let surface = surface(&shared, &grid);
        let load = vec![0.0; 1 + (surface.node_count() + surface.facets.markers().len()) * surface.dimension];
        let context = context.clone();
        Ok(Self { shared, context, motion, surface, link: None, series: Vec::new(), load, total: [0.0; 6] })
    }

    /// Opens the link, agrees on the contract, sends the surface and the motion at the start.
    fn connect(&mut self, transport: &mut dyn Transport) -> Result<(), LinkError> {
        let values = self.surface.encode();
        let motion_len = 3 * self.surface.reference_position.len();
        let mut link = transport.connect("coupler", values.len().max(motion_len))?;
        let contract = Contract {
            dimension: self.surface.dimension,
            node_count: self.surface.node_count(),
            end_time: self.shared.time.end,
            scene: self.context.scene,
        };
        agree(&mut *link, &contract)?;
        let header = Header::new(Kind::Surface, 0, 0.0, 0.0);
        link.send(header, values.len(), &mut |out| out.copy_from_slice(&values))?;
        self.link = Some(link);
        self.send_motion(StepTime { step: 0, time: 0.0, dt: 0.0 })
    }

    fn receive_load(&mut self, at: StepTime) -> Result<(), LinkError> {
        let Some(link) = &mut self.link else { return Ok(()) };
        let load = &mut self.load;
        let expect = Expect { kind: Kind::Load, step: at.step, count: Some(load.len()) };
        link.receive(expect, &mut |_, values| load.copy_from_slice(values))
    }

    /// Displacement, velocity, acceleration: one block `[n, D]` each, the same for all nodes.
    fn send_motion(&mut self, at: StepTime) -> Result<(), LinkError> {
        let Some(link) = &mut self.link else { return Ok(()) };
        let (d, motion) = (self.surface.dimension, &self.motion);
        let block = self.surface.reference_position.len();
        let header = Header::new(Kind::Motion, at.step, at.time, at.dt);
        link.send(header, 3 * block, &mut |out| {
            for axis in 0..d {
                let along = motion.at(axis, at.time);
                for (order, value) in along.into_iter().enumerate() {
                    out[order * block..(order + 1) * block]
                        .iter_mut()
                        .skip(axis)
                        .step_by(d)
                        .for_each(|v| *v = value);
                }
            }
        })
    }

    /// Sums the nodal forces and their moment about the origin at the current place.
    fn sum_load(&mut self, time: f64) {
        let d = self.surface.dimension;
        let shift: [f64; 3] =
            std::array::from_fn(|axis| if axis < d { self.motion.at(axis, time)[0] } else { 0.0 });
        self.total = [0.0; 6];
        let forces = &self.load[1..=self.surface.reference_position.len()];
        for (force, position) in forces.chunks_exact(d).zip(self.surface.reference_position.chunks_exact(d)) {
            let (mut f, mut x) = ([0.0; 3], shift);
            f[..d].copy_from_slice(force);
            x.iter_mut().zip(position).for_each(|(x, position)| *x += position);
            for i in 0..3 {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                self.total[i] += f[i];
                self.total[3 + i] += x[j] * f[k] - x[k] * f[j];
            }
        }
    }

    /// What a state must be of to be taken up: the motion depends on the time alone, so that it is little.
    fn stamp(&self, at: StepTime) -> Stamp {
        let sizes = [("dimension", self.surface.dimension), ("interface_nodes", self.surface.node_count())];
        Stamp::new(at.step, at.time, &sizes)
    }

    /// Starts the series with a row at a time.
    fn begin_series(&mut self, time: f64) -> Result<(), Failure> {
        let d = self.surface.dimension;
        self.series.clear();
        for gauge in &self.shared.gauges {
            let (is_reaction, columns) = match gauge.kind {
                GaugeKind::Reaction if d == 2 => (true, &FORCE_2D[..]),
                GaugeKind::Reaction => (true, &FORCE_3D[..]),
                GaugeKind::Displacement { .. } => (false, &DISPLACEMENT[..d]),
                _ => continue,
            };
            let every = self.shared.output.series_every;
            self.series
                .push((is_reaction, Series::create(&self.context.folder, &gauge.name, columns, every)?));
        }
        self.record(time)
    }

    /// The support holds against the load: minus its force and moment; displacement is the same everywhere.
    fn record(&mut self, time: f64) -> Result<(), Failure> {
        let d = self.surface.dimension;
        let hold = self.total.map(|component| -component);
        for (is_reaction, series) in &mut self.series {
            match (*is_reaction, d) {
                (true, 2) => series.row(time, &[hold[0], hold[1], hold[5]])?,
                (true, _) => series.row(time, &hold)?,
                _ => {
                    let row: [f64; 3] =
                        std::array::from_fn(
                            |axis| if axis < d { self.motion.at(axis, time)[0] } else { 0.0 },
                        );
                    series.row(time, &row[..d])?;
                }
            }
        }
        Ok(())
    }
}

impl Participant for RigidSolid {
    fn start(&mut self, start: &Start, transport: &mut dyn Transport) -> Result<Ready, Failure> {
        if start.surface_nodes.is_some() && self.shared.fluid.is_some() {
            self.connect(transport).map_err(|error| error.into_failure(NAME, 0, 0.0, "handshake"))?;
        }
        self.begin_series(0.0)?;
        let counts = BTreeMap::from([("solid_nodes".to_owned(), self.surface.node_count() as u64)]);
        Ok(Ready { counts, admitted_dt: f64::INFINITY })
    }

    fn part(&mut self, part: Part, at: StepTime) -> Result<StepReport, Failure> {
        let lost = |error: LinkError| error.into_failure(NAME, at.step, at.time, "exchange");
        match part {
            Part::Advance => {
                self.receive_load(at).map_err(lost)?;
                self.sum_load(at.time);
                self.send_motion(at).map_err(lost)?;
            }
            Part::Record => self.record(at.time)?,
            Part::Keep => {
                let due: Vec<f64> = self.series.iter().map(|(_, series)| series.due()).collect();
                state::write(&self.context.folder, NAME, &self.stamp(at), &(self.total, due))?;
            }
            Part::TakeUp => {
                let state = state::read(&self.context.folder, NAME, &self.stamp(at))?;
                let (total, due): ([f64; 6], Vec<f64>) = state;
                self.total = total;
                self.begin_series(at.time)?;
                self.series.iter_mut().zip(&due).for_each(|((_, series), due)| series.wait_until(*due));
            }
            // The motion depends on the time alone: there is no state to keep.
            Part::Save | Part::Restore => (),
            other => return Err(not_my_part(other)),
        }
        Ok(StepReport::unlimited())
    }

    fn output(&mut self, _frame: u32, _at: StepTime) -> Result<(), Failure> {
        self.series.iter_mut().try_for_each(|(_, series)| series.flush())
    }

    fn account(&self) -> Account {
        Account::default()
    }
}
