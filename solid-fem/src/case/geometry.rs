//! The unloaded body: its place, and the mesh file it may come from.

use std::path::Path;
use std::sync::Arc;

use protocol::case::{CaseFile, Section, Shared, SolidOutline};

use crate::box_grid::BoxGrid;
use crate::element::ElementKind;
use crate::mesh::Mesh;
use crate::mesh_file;
use crate::scene::{Geometry, Scene};

/// How far, relative to its size, a meshed body may be from the box the water is told of.
const FIT: f64 = 0.01;

/// The scene of a mesh file; `None` after a complaint.
pub(super) fn read_mesh(
    case: &CaseFile,
    section: &Section<'_>,
    outline: &SolidOutline,
    file: &str,
) -> Option<Scene> {
    let path = case.path().parent().unwrap_or(Path::new(".")).join(file);
    let dimension = outline.region.min.len();
    let mesh = match mesh_file::read(&path, dimension) {
        Ok(mesh) => mesh,
        Err(error) => {
            section.complain("mesh", error.to_string(), "", "");
            return None;
        }
    };
    let (low, high) = mesh.bounding_box();
    let size = (0..dimension).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
    for axis in (0..dimension).filter(|_| section.has("min") && section.has("max")) {
        let gap =
            (outline.region.min[axis] - low[axis]).abs().max((outline.region.max[axis] - high[axis]).abs());
        if gap > FIT * size {
            let allowed = format!("{:?} and {:?}", &low[..dimension], &high[..dimension]);
            section.complain("min", "min and max are not the corners of the mesh", &allowed, "");
            break;
        }
    }
    let grid = BoxGrid { dimension, minimum: low, maximum: high, cells: [1; 3] };
    let mut scene = Scene::of_box(grid, 1.0, 1.0, 0.0);
    scene.element = ElementKind::default_of_cell(mesh.cell);
    scene.geometry = Geometry::Mesh(Arc::new(mesh));
    Some(scene)
}

/// Brings a mesh to the cells of the element, by nodes in the middle of its edges; complains and gives `false` where
/// that does not do.
pub(super) fn fit_mesh(section: &Section<'_>, scene: &mut Scene) -> bool {
    let Geometry::Mesh(mesh) = &mut scene.geometry else { return true };
    let wanted = scene.element.cell();
    if mesh.cell != wanted && mesh.cell.quadratic() == wanted {
        *mesh = Arc::new(Mesh::clone(mesh).into_quadratic());
    }
    if mesh.cell != wanted {
        let what = format!("{} does not fit a mesh of {:?}", scene.element.name(), mesh.cell);
        section.complain("element", what, ElementKind::default_of_cell(mesh.cell).name(), "");
    }
    mesh.cell == wanted
}

pub(super) fn check_place(section: &Section<'_>, shared: &Shared, outline: &SolidOutline) {
    let Some(domain) = shared.domain.as_ref().filter(|_| section.has("min")) else { return };
    for axis in 0..outline.region.min.len() {
        let slack = 1e-9 * domain.region.length(axis).abs();
        for (key, value) in [("min", outline.region.min[axis]), ("max", outline.region.max[axis])] {
            let (low, high) = (domain.region.min[axis], domain.region.max[axis]);
            if value < low - slack || value > high + slack {
                let message = format!("{value} lies outside the domain along {}", ["x", "y", "z"][axis]);
                section.complain(key, message, &format!("{low} .. {high}"), "Put the body inside [domain].");
            }
        }
    }
}
