//! Where the particles of a body sit in the cells of a mesh: depths across the wall, rows along it.
//!
//! Cells that share faces form a patch; rows run over the whole patch at one pitch, whatever the cells' lengths.
//! Where a patch ends at a closed side wall of the tank, three ghost rows continue it into the wall.

use std::collections::HashMap;

use protocol::interface::BodyMesh;

use crate::error::SetupError;
use crate::kernel::Kernel;
use crate::lattice::SHELL_LAYERS;
use crate::scene::{Scene, Tank};
use crate::vector::{Vector, add_scaled, norm, sub};

/// One particle of the body: a cell, its local coordinates, and the offset of a ghost row.
#[derive(Debug, Clone, PartialEq)]
pub struct Embedded<const D: usize> {
    /// Cell of the mesh.
    pub cell: usize,
    /// Local coordinates, -1..1 inside the cell.
    pub local: Vector<D>,
    /// Constant offset from the embedded point, m: zero but for ghost rows.
    pub offset: Vector<D>,
    /// Volume of the unloaded body it stands for, m^D.
    pub volume: f64,
}

impl<const D: usize> Embedded<D> {
    /// Local coordinates limited to the cell.
    pub fn inside(&self) -> Vector<D> {
        self.local.map(|xi| xi.clamp(-1.0, 1.0))
    }

    /// m_r behind it, kg/m2.
    pub fn response_mass(&self, mesh: &BodyMesh) -> f64 {
        let shape = shape_functions(&self.inside());
        corners::<D>(mesh, self.cell).iter().zip(&shape).map(|(&a, n)| n * mesh.response_mass[a]).sum()
    }

    /// Its place at the unloaded body, m.
    pub fn position(&self, mesh: &BodyMesh) -> Vector<D> {
        let mut x = combine(mesh, self.cell, &shape_functions(&self.local));
        add_scaled(&mut x, 1.0, &self.offset);
        x
    }
}

/// What the layout needs to know beside the mesh.
#[derive(Debug, Clone, Copy)]
pub struct LayoutRules<'a, const D: usize> {
    /// The tank.
    pub tank: &'a Tank<D>,
    /// Spacing of the lattice, m.
    pub spacing: f64,
    /// Spacing asked for, m: a body of two of these is thick enough.
    pub asked_spacing: f64,
    /// The kernel's reach, m.
    pub support_radius: f64,
    /// Wet sides across the wall, where the scene knows them.
    pub wet: Option<[bool; 2]>,
    /// g, m/s2: the tank's floor and ceiling get no ghost rows.
    pub gravity: Vector<D>,
}

impl<'a, const D: usize> LayoutRules<'a, D> {
    /// The rules of a scene with this kernel.
    pub fn new(scene: &'a Scene<D>, kernel: &Kernel<D>) -> Self {
        Self {
            tank: &scene.tank,
            spacing: kernel.spacing,
            asked_spacing: scene.particle_spacing,
            support_radius: kernel.support_radius,
            wet: scene.body_wet,
            gravity: scene.gravity.vector,
        }
    }
}

/// A place along one axis of a patch.
#[derive(Debug, Clone, Copy)]
struct Place<const D: usize> {
    /// Cell number along the axis.
    cell: i64,
    local: f64,
    pitch: f64,
    offset: Vector<D>,
}

struct Patch<'a, const D: usize> {
    mesh: &'a BodyMesh,
    /// Cells by their place along the in-plane axes.
    cells: HashMap<[i64; 2], usize>,
}

/// Shape functions of the 2^D corners at local coordinates, first axis fastest.
pub fn shape_functions<const D: usize>(local: &Vector<D>) -> Vec<f64> {
    (0..1usize << D)
        .map(|corner| {
            (0..D).map(|k| 0.5 * if corner >> k & 1 == 1 { 1.0 + local[k] } else { 1.0 - local[k] }).product()
        })
        .collect()
}

/// Derivatives of the shape functions along one local axis.
pub fn shape_derivatives<const D: usize>(local: &Vector<D>, axis: usize) -> Vec<f64> {
    (0..1usize << D)
        .map(|corner| {
            let sign = |k: usize| if corner >> k & 1 == 1 { 1.0 } else { -1.0 };
            (0..D).map(|k| if k == axis { 0.5 * sign(k) } else { 0.5 * (1.0 + sign(k) * local[k]) }).product()
        })
        .collect()
}

/// The corners of a cell.
pub fn corners<const D: usize>(mesh: &BodyMesh, cell: usize) -> &[usize] {
    &mesh.cells[cell << D..(cell + 1) << D]
}

fn combine<const D: usize>(mesh: &BodyMesh, cell: usize, weights: &[f64]) -> Vector<D> {
    let mut x = [0.0; D];
    for (&node, weight) in corners::<D>(mesh, cell).iter().zip(weights) {
        for k in 0..D {
            x[k] += weight * mesh.reference_position[node * D + k];
        }
    }
    x
}

/// All particles of the body.
///
/// # Errors
/// [`SetupError::BodyMesh`], [`SetupError::BodyTooThin`].
pub fn embed_particles<const D: usize>(
    mesh: &BodyMesh,
    rules: LayoutRules<'_, D>,
) -> Result<Vec<Embedded<D>>, SetupError> {
    if mesh.dimension != D || !mesh.cells.len().is_multiple_of(1 << D) {
        return Err(SetupError::BodyMesh { what: "its dimension is not the scene's" });
    }
    let mut particles = Vec::new();
    for patch in find_patches::<D>(mesh) {
        let depths = patch.depths(rules)?;
        let mut rows = vec![patch.rows(0, rules)];
        rows.push(if D == 3 { patch.rows(1, rules) } else { Vec::new() });
        let single = Place { cell: 0, local: 0.0, pitch: 0.0, offset: [0.0; D] };
        let second: &[Place<D>] = if D == 3 { &rows[1] } else { &[single] };
        for outer in second {
            for inner in &rows[0] {
                let Some(&cell) = patch.cells.get(&[inner.cell, outer.cell]) else { continue };
                for &(depth, share) in &depths {
                    let mut local = [depth; D];
                    local[1] = inner.local;
                    local[D - 1] = if D == 3 { outer.local } else { inner.local };
                    let offset = std::array::from_fn(|k| inner.offset[k] + outer.offset[k]);
                    let mut volume = cell_density(mesh, cell, &local)? * share;
                    volume *= 2.0 * inner.pitch / edge_length::<D>(mesh, cell, 1);
                    if D == 3 {
                        volume *= 2.0 * outer.pitch / edge_length::<D>(mesh, cell, 2);
                    }
                    particles.push(Embedded { cell, local, offset, volume });
                }
            }
        }
    }
    Ok(particles)
}

/// |det dx/dxi| at a point of a cell, local coordinates limited to the cell.
fn cell_density<const D: usize>(mesh: &BodyMesh, cell: usize, local: &Vector<D>) -> Result<f64, SetupError> {
    let inside = local.map(|xi| xi.clamp(-1.0, 1.0));
    let j: Vec<Vector<D>> =
        (0..D).map(|axis| combine(mesh, cell, &shape_derivatives(&inside, axis))).collect();
    let minor = |a: usize, b: usize| j[1][a] * j[D - 1][b] - j[1][b] * j[D - 1][a];
    let determinant = if D == 2 {
        j[0][0] * j[1][1] - j[0][1] * j[1][0]
    } else {
        j[0][0] * minor(1, D - 1) + j[0][1] * minor(D - 1, 0) + j[0][D - 1] * minor(0, 1)
    };
    if determinant.abs() > 0.0 {
        Ok(determinant.abs())
    } else {
        Err(SetupError::BodyMesh { what: "a cell has no volume" })
    }
}

/// Mean length of a cell along a local axis, m.
fn edge_length<const D: usize>(mesh: &BodyMesh, cell: usize, axis: usize) -> f64 {
    let nodes = corners::<D>(mesh, cell);
    let x = |corner: usize| -> Vector<D> {
        std::array::from_fn(|k| mesh.reference_position[nodes[corner] * D + k])
    };
    let edges = (0..1usize << D).filter(|corner| corner >> axis & 1 == 0);
    let total: f64 = edges.map(|corner| norm(&sub(&x(corner | 1 << axis), &x(corner)))).sum();
    total / (1 << (D - 1)) as f64
}

fn face_nodes<const D: usize>(mesh: &BodyMesh, cell: usize, axis: usize, side: usize) -> Vec<usize> {
    let nodes = corners::<D>(mesh, cell);
    let mut face: Vec<_> =
        (0..1usize << D).filter(|corner| corner >> axis & 1 == side).map(|corner| nodes[corner]).collect();
    face.sort_unstable();
    face
}

fn find_patches<const D: usize>(mesh: &BodyMesh) -> Vec<Patch<'_, D>> {
    let cell_count = mesh.cells.len() >> D;
    let mut by_face = HashMap::new();
    for cell in 0..cell_count {
        for axis in 1..D {
            for side in 0..2 {
                by_face.insert((face_nodes::<D>(mesh, cell, axis, side), axis, side), cell);
            }
        }
    }
    let mut seen = vec![false; cell_count];
    let mut patches = Vec::new();
    for start in 0..cell_count {
        if std::mem::replace(&mut seen[start], true) {
            continue;
        }
        let mut patch = Patch { mesh, cells: HashMap::new() };
        let mut open = vec![(start, [0i64; 2])];
        while let Some((cell, at)) = open.pop() {
            patch.cells.insert(at, cell);
            for axis in 1..D {
                for side in 0..2 {
                    let key = (face_nodes::<D>(mesh, cell, axis, side), axis, 1 - side);
                    let Some(&next) = by_face.get(&key) else { continue };
                    if !std::mem::replace(&mut seen[next], true) {
                        let mut there = at;
                        there[axis - 1] += 2 * side as i64 - 1;
                        open.push((next, there));
                    }
                }
            }
        }
        patches.push(patch);
    }
    patches
}

impl<const D: usize> Patch<'_, D> {
    /// Local depths across the wall with the share of the cell's -1..1 each stands for.
    fn depths(&self, rules: LayoutRules<'_, D>) -> Result<Vec<(f64, f64)>, SetupError> {
        let lengths = || self.cells.values().map(|&cell| edge_length::<D>(self.mesh, cell, 0));
        let least = lengths().fold(f64::INFINITY, f64::min);
        let greatest = lengths().fold(0.0, f64::max);
        let thickness = 0.5 * (least + greatest);
        let wet = rules.wet.unwrap_or_else(|| [self.is_wet(0), self.is_wet(1)]);
        if wet == [true; 2] && least < 2.0 * rules.asked_spacing.min(rules.spacing) * (1.0 - 1e-9) {
            return Err(SetupError::BodyTooThin { thickness: least, spacing: rules.spacing });
        }
        let layers = (thickness / rules.spacing).round();
        let pitch = if layers >= 1.0 { thickness / layers } else { rules.spacing };
        let one_sided = wet[0] != wet[1];
        let support_layers = (rules.support_radius / pitch).ceil();
        let count = if one_sided { layers.max(support_layers) } else { layers.max(1.0) };
        let step = 2.0 * pitch / thickness;
        Ok((0..count as usize)
            .map(|layer| {
                let depth = (layer as f64 + 0.5) * step - 1.0;
                (if one_sided && wet[1] { -depth } else { depth }, step)
            })
            .collect())
    }

    fn is_wet(&self, side: usize) -> bool {
        let facets = &self.mesh.facets;
        let mut faces: HashMap<usize, Vec<usize>> = HashMap::new();
        for (number, &cell) in self.cells.values().enumerate() {
            for node in face_nodes::<D>(self.mesh, cell, 0, side) {
                faces.entry(node).or_default().push(number);
            }
        }
        (0..facets.len()).any(|facet| {
            let nodes = facets.facet(facet);
            let Some(first) = faces.get(&nodes[0]) else { return false };
            first
                .iter()
                .any(|face| nodes.iter().all(|node| faces.get(node).is_some_and(|f| f.contains(face))))
        })
    }

    /// Places along in-plane axis `direction` (0: second local axis, 1: third), ghost rows included.
    fn rows(&self, direction: usize, rules: LayoutRules<'_, D>) -> Vec<Place<D>> {
        let axis = direction + 1;
        let numbers = || self.cells.keys().map(|at| at[direction]);
        let (first, last) = (numbers().min().unwrap_or(0), numbers().max().unwrap_or(0));
        let lengths: Vec<f64> = (first..=last)
            .map(|number| {
                let mut row: Vec<f64> = self
                    .cells
                    .iter()
                    .filter(|(at, _)| at[direction] == number)
                    .map(|(_, &cell)| edge_length::<D>(self.mesh, cell, axis))
                    .collect();
                // The map has no order; the sum must have one.
                row.sort_by(f64::total_cmp);
                row.iter().sum::<f64>() / row.len() as f64
            })
            .collect();
        let total: f64 = lengths.iter().sum();
        let count = (total / rules.spacing).round().max(1.0);
        let pitch = total / count;
        let (mut cell, mut passed) = (0, 0.0);
        let mut places = Vec::new();
        for row in 0..count as usize {
            let along = (row as f64 + 0.5) * pitch;
            while along > passed + lengths[cell] && cell + 1 < lengths.len() {
                passed += lengths[cell];
                cell += 1;
            }
            let local = 2.0 * (along - passed) / lengths[cell] - 1.0;
            places.push(Place { cell: first + cell as i64, local, pitch, offset: [0.0; D] });
        }
        for (cell, end) in [(first, -1.0), (last, 1.0)] {
            let Some((k, sign)) = self.side_wall_at((direction, cell, end), rules) else { continue };
            for row in 0..SHELL_LAYERS {
                let mut offset = [0.0; D];
                offset[k] = sign * (row as f64 + 0.5) * pitch;
                places.push(Place { cell, local: end, pitch, offset });
            }
        }
        places
    }

    /// The closed side wall of the tank an end of the patch touches: axis and outward sign.
    fn side_wall_at(
        &self,
        (direction, number, end): (usize, i64, f64),
        rules: LayoutRules<'_, D>,
    ) -> Option<(usize, f64)> {
        let mut cells: Vec<_> = self.cells.iter().filter(|(at, _)| at[direction] == number).collect();
        cells.sort_unstable();
        let (mut middle, mut tip) = ([0.0; D], [0.0; D]);
        for &(_, &cell) in &cells {
            let mut local = [0.0; D];
            let centre: Vector<D> = combine(self.mesh, cell, &shape_functions(&local));
            local[direction + 1] = end;
            let outer: Vector<D> = combine(self.mesh, cell, &shape_functions(&local));
            for k in 0..D {
                middle[k] += centre[k] / cells.len() as f64;
                tip[k] += outer[k] / cells.len() as f64;
            }
        }
        let outward = sub(&tip, &middle);
        let k = (0..D).max_by(|&a, &b| outward[a].abs().total_cmp(&outward[b].abs()))?;
        let upper = outward[k] > 0.0;
        let plane = if upper { rules.tank.max[k] } else { rules.tank.min[k] };
        let along_gravity = rules.gravity[k].abs() > 0.5 * norm(&rules.gravity);
        let touches = (tip[k] - plane).abs() < 0.5 * rules.spacing;
        (touches && !rules.tank.open[k][usize::from(upper)] && !along_gravity)
            .then_some((k, if upper { 1.0 } else { -1.0 }))
    }
}
