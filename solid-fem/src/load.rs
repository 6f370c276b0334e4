//! External forces: weight, own loads on faces, and what the water does to the wet faces.

use protocol::case::interpolate;
use protocol::interface::Facets;

use crate::cell::Cell;
use crate::element::Kinematics;
use crate::error::SceneError;
use crate::facet::{FacetRule, norm, positions};
use crate::linear::block_matrix::BlockMatrix;
use crate::mesh::Mesh;
use crate::probe::Probe;
use crate::scene::{FaceLoadKind, PointLoad, Scene};

/// The load at the end of a step, as it comes from the coupler.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Load<'a> {
    /// No water.
    None,
    /// Force on the interface nodes, `[n, D]` N (N/m in 2-D).
    NodalForce(&'a [f64]),
    /// Traction at the interface markers in the order of [`Facets::markers`], `[m, D]` Pa.
    Traction(&'a [f64]),
}

/// Where in time the loads are taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct When {
    /// Time, s.
    pub(crate) time: f64,
    /// Share of the step's interface load, from 0 (its start) to 1 (its end).
    pub(crate) fraction: f64,
    /// Factor on the weight.
    pub(crate) weight: f64,
    /// Factor on the own face loads.
    pub(crate) own: f64,
}

/// Interface load at one instant; what does not act is zero.
#[derive(Debug, Clone, Default, PartialEq)]
struct Interface {
    nodal: Vec<f64>,
    traction: Vec<f64>,
}

/// All external loads of a body.
#[derive(Debug, Clone)]
pub(crate) struct Loads {
    dimension: usize,
    reference_position: Vec<f64>,
    weight: Vec<f64>,
    weight_table: Vec<(f64, f64)>,
    own: Vec<Own>,
    points: Vec<(PointLoad, Probe)>,
    /// Quadrature of the body's own facets, and of those of the interface.
    rule: FacetRule,
    interface_rule: FacetRule,
    /// Pressure stays on the reference area.
    is_linear: bool,
    /// Wet facets in interface node numbers, the mesh node of each interface node, the marker of each facet corner.
    facets: Facets,
    interface_node: Vec<usize>,
    marker: Vec<usize>,
    start: Interface,
    end: Interface,
    pub(crate) has_traction: bool,
}

/// A face load and its facets in mesh node numbers; dead loads at factor 1.
#[derive(Debug, Clone)]
struct Own {
    load: crate::scene::FaceLoad,
    facets: Vec<usize>,
    dead: Vec<f64>,
}

impl Loads {
    pub(crate) fn new(
        scene: &Scene,
        mesh: &Mesh,
        mass: &BlockMatrix,
        (facets, interface_node): (Facets, Vec<usize>),
    ) -> Result<Self, SceneError> {
        let dimension = mesh.dimension;
        let reference_position = mesh.reference_position.clone();
        let gravity: Vec<f64> =
            (0..reference_position.len()).map(|component| scene.gravity[component % dimension]).collect();
        let mut weight = vec![0.0; gravity.len()];
        mass.multiply(&gravity, &mut weight);
        let markers = facets.markers();
        let marker = (0..facets.nodes.len())
            .map(|corner| {
                let face = facets.face[corner / facets.nodes_per_facet];
                let wanted = protocol::interface::InterfaceMarker { face, node: facets.nodes[corner] };
                markers.binary_search(&wanted).expect("every facet corner has a marker")
            })
            .collect();
        let interface = Interface {
            nodal: vec![0.0; interface_node.len() * dimension],
            traction: vec![0.0; markers.len() * dimension],
        };
        let interface_facet = match (dimension, facets.nodes_per_facet) {
            (2, _) => Cell::Segment2,
            (_, 3) => Cell::Triangle3,
            _ => Cell::Quadrilateral4,
        };
        let mut loads = Self {
            dimension,
            reference_position,
            weight,
            weight_table: scene.gravity_table.clone(),
            own: Vec::new(),
            points: Vec::new(),
            rule: FacetRule::new(mesh.cell.facet()),
            interface_rule: FacetRule::new(interface_facet),
            is_linear: scene.substance.kinematics == Kinematics::Linear,
            facets,
            interface_node,
            marker,
            start: interface.clone(),
            end: interface,
            has_traction: false,
        };
        loads.add_own(scene, mesh)?;
        Ok(loads)
    }

    fn add_own(&mut self, scene: &Scene, mesh: &Mesh) -> Result<(), SceneError> {
        for load in &scene.loads {
            let named = mesh.face(&load.face);
            let facets = named.map(|face| face.facets.clone()).filter(|facets| !facets.is_empty());
            let facets = facets.ok_or_else(|| {
                SceneError::Face(load.face.clone(), "a load needs a face with facets, not a set of nodes")
            })?;
            let mut own = Own { load: load.clone(), facets, dead: Vec::new() };
            own.dead = self.dead_force(&own);
            self.own.push(own);
        }
        for load in &scene.point_loads {
            let probe = Probe::at(mesh, &load.point);
            let probe = probe.ok_or_else(|| SceneError::Point(load.point.clone()))?;
            self.points.push((load.clone(), probe));
        }
        Ok(())
    }

    /// Numbers a load must have: nodal forces, tractions.
    pub(crate) fn lengths(&self) -> (usize, usize) {
        (self.start.nodal.len(), self.start.traction.len())
    }

    /// Takes the load at the end of a step; the last one becomes that at its start.
    pub(crate) fn receive(&mut self, load: Load<'_>) {
        std::mem::swap(&mut self.start, &mut self.end);
        self.end.nodal.fill(0.0);
        self.end.traction.fill(0.0);
        match load {
            Load::None => {}
            Load::NodalForce(force) => self.end.nodal.copy_from_slice(force),
            Load::Traction(traction) => {
                self.end.traction.copy_from_slice(traction);
                self.has_traction = true;
            }
        }
    }

    /// Whether all loads at a time and at the end of the step are those at its start, `start` s.
    pub(crate) fn are_constant(&self, start: f64, end: f64) -> bool {
        let is_kept = |table: &[(f64, f64)]| interpolate(table, start) == interpolate(table, end);
        self.start == self.end
            && is_kept(&self.weight_table)
            && self.own.iter().all(|own| is_kept(&own.load.table))
            && self.points.iter().all(|(load, _)| is_kept(&load.table))
    }

    /// The interface load at the end of the step, to be put back by [`Self::restore`].
    pub(crate) fn save(&self, saved: &mut (Vec<f64>, Vec<f64>)) {
        saved.0.clone_from(&self.end.nodal);
        saved.1.clone_from(&self.end.traction);
    }

    /// Puts a saved load back as the last one received.
    pub(crate) fn restore(&mut self, saved: &(Vec<f64>, Vec<f64>)) {
        self.end.nodal.copy_from_slice(&saved.0);
        self.end.traction.copy_from_slice(&saved.1);
    }

    /// Potential of the weight at a displacement and time, J: - sum of F.x.
    pub(crate) fn weight_potential(&self, displacement: &[f64], time: f64) -> f64 {
        let position = self.reference_position.iter().zip(displacement);
        let work: f64 = self.weight.iter().zip(position).map(|(weight, (x, u))| weight * (x + u)).sum();
        -work * interpolate(&self.weight_table, time)
    }

    /// Writes the external force at a displacement and time, `[n, D]` N.
    pub(crate) fn external_force(&self, displacement: &[f64], when: When, force: &mut [f64]) {
        let d = self.dimension;
        let weight_factor = when.weight * interpolate(&self.weight_table, when.time);
        for (force, weight) in force.iter_mut().zip(&self.weight) {
            *force = weight_factor * weight;
        }
        for own in &self.own {
            let factor = when.own * own.load.factor(when.time);
            match own.load.kind {
                FaceLoadKind::FollowerPressure(pressure) if !self.is_linear => {
                    self.add_pressure(&own.facets, factor * pressure, displacement, force);
                }
                _ => force.iter_mut().zip(&own.dead).for_each(|(force, dead)| *force += factor * dead),
            }
        }
        for (load, probe) in &self.points {
            let factor = when.own * interpolate(&load.table, when.time);
            for &(node, weight) in &probe.weights {
                for axis in 0..d {
                    force[node * d + axis] += factor * weight * load.force[axis];
                }
            }
        }
        for (i, &node) in self.interface_node.iter().enumerate() {
            for axis in 0..d {
                let (a, b) = (self.start.nodal[i * d + axis], self.end.nodal[i * d + axis]);
                force[node * d + axis] += a + when.fraction * (b - a);
            }
        }
        if self.has_traction {
            self.add_traction(when.fraction, displacement, force);
        }
    }

    fn add_pressure(&self, facets: &[usize], pressure: f64, displacement: &[f64], force: &mut [f64]) {
        let d = self.dimension;
        let coordinate = |c: usize| self.reference_position[c] + displacement[c];
        for nodes in facets.chunks_exact(self.rule.nodes()) {
            self.rule.for_each_point(&positions(nodes, d, coordinate), |shape, area| {
                for (&node, shape) in nodes.iter().zip(shape) {
                    for axis in 0..d {
                        force[node * d + axis] -= shape * pressure * area[axis];
                    }
                }
            });
        }
    }

    fn add_traction(&self, fraction: f64, displacement: &[f64], force: &mut [f64]) {
        let d = self.dimension;
        let coordinate = |c: usize| {
            let node = self.interface_node[c / d] * d + c % d;
            self.reference_position[node] + displacement[node]
        };
        let traction = |marker: usize, axis: usize| {
            let (a, b) = (self.start.traction[marker * d + axis], self.end.traction[marker * d + axis]);
            a + fraction * (b - a)
        };
        let count = self.facets.nodes_per_facet;
        for facet in 0..self.facets.len() {
            let nodes = self.facets.facet(facet);
            let markers = &self.marker[facet * count..(facet + 1) * count];
            self.interface_rule.for_each_point(&positions(nodes, d, coordinate), |shape, area| {
                let area = norm(area);
                for axis in 0..d {
                    let here: f64 =
                        markers.iter().zip(shape).map(|(&m, shape)| shape * traction(m, axis)).sum();
                    for (&node, shape) in nodes.iter().zip(shape) {
                        force[self.interface_node[node] * d + axis] += shape * here * area;
                    }
                }
            });
        }
    }

    fn dead_force(&self, own: &Own) -> Vec<f64> {
        let d = self.dimension;
        let mut force = vec![0.0; self.reference_position.len()];
        match own.load.kind {
            FaceLoadKind::FollowerPressure(_) if !self.is_linear => return Vec::new(),
            FaceLoadKind::FollowerPressure(pressure) | FaceLoadKind::DeadPressure(pressure) => {
                let at_rest = vec![0.0; force.len()];
                self.add_pressure(&own.facets, pressure, &at_rest, &mut force);
            }
            FaceLoadKind::DeadTraction(traction) => {
                for nodes in own.facets.chunks_exact(self.rule.nodes()) {
                    let place = positions(nodes, d, |c| self.reference_position[c]);
                    self.rule.for_each_point(&place, |shape, area| {
                        let area = norm(area);
                        for (&node, shape) in nodes.iter().zip(shape) {
                            for axis in 0..d {
                                force[node * d + axis] += shape * traction[axis] * area;
                            }
                        }
                    });
                }
            }
        }
        force
    }
}
