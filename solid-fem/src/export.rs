//! The solid of a case as an input deck for CalculiX, for an independent check: mesh, material, supports, loads, analysis.
//!
//! Element types are the nearest kin there: C3D8I has incompatible modes where `hex8_eas9` has enhanced strains, the others
//! are the same. What CalculiX would compute differently is refused. Source: CalculiX CrunchiX user's manual 2.20.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

use protocol::case::{CaseFile, GaugeKind, Shared};

use crate::case::{Analysis, Settings};
use crate::cell::Cell;
use crate::element::{ElementKind, Kinematics};
use crate::material::LawKind;
use crate::mesh::Mesh;
use crate::scene::{FaceLoadKind, Scene};
use crate::solid::Solid;
use protocol::case::Prescribed;

/// `solid-fem --export CASE FILE [--set key=value]...`: writes the deck.
pub fn main(mut arguments: impl Iterator<Item = String>) -> ExitCode {
    let (Some(case), Some(file)) = (arguments.next(), arguments.next()) else {
        eprintln!("solid-fem: --export takes a case and the file to write");
        return ExitCode::from(2);
    };
    let options: Vec<String> = arguments.filter(|argument| argument != "--set").collect();
    let result = CaseFile::load(Path::new(&case), &options)
        .map_err(|error| format!("cannot read {case}: {error}"))
        .and_then(|case| deck(&case))
        .and_then(|deck| {
            std::fs::write(&file, deck).map_err(|error| format!("cannot write {file}: {error}"))
        });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(what) => {
            eprintln!("solid-fem: {what}");
            ExitCode::from(2)
        }
    }
}

/// The deck of a case.
///
/// # Errors
/// The first mistake in the case, or what has no counterpart in CalculiX.
pub fn deck(case: &CaseFile) -> Result<String, String> {
    let shared = Shared::read(case);
    let settings = Settings::read(case, &shared);
    if let Some(diagnostic) = case.diagnostics().first() {
        return Err(diagnostic.to_string());
    }
    let settings = settings.ok_or("the case has no elastic solid")?;
    let scene = &settings.scene;
    let mesh = scene.mesh();
    let mut deck = format!("** {}, written by Tidewall\n", shared.header.name);
    write_mesh(&mut deck, scene, &mesh)?;
    write_material(&mut deck, scene)?;
    write_supports(&mut deck, scene)?;
    let gauges = write_gauges(&mut deck, &shared, &mesh);
    write_step(&mut deck, &shared, &settings);
    if settings.analysis != Analysis::Modes {
        write_loads(&mut deck, scene, &mesh)?;
        for gauge in gauges {
            let _ = writeln!(deck, "*NODE PRINT, NSET={gauge}\nU");
        }
    }
    deck.push_str("*NODE FILE\nU\n*END STEP\n");
    Ok(deck)
}

fn element_type(scene: &Scene) -> Result<&'static str, String> {
    let is_plate = scene.substance.is_plane_stress;
    Ok(match scene.element {
        ElementKind::Tri3 => {
            if is_plate {
                "CPS3"
            } else {
                "CPE3"
            }
        }
        ElementKind::Tri6 => {
            if is_plate {
                "CPS6"
            } else {
                "CPE6"
            }
        }
        ElementKind::Quad8 => {
            if is_plate {
                "CPS8"
            } else {
                "CPE8"
            }
        }
        ElementKind::Quad4Eas4 => {
            return Err("quad4_eas4 has no kin in CalculiX: set solid.element = \"quad8\"".to_owned());
        }
        ElementKind::Hex8Eas9 => "C3D8I",
        ElementKind::Hex20 => "C3D20",
        ElementKind::Tet10 => "C3D10",
        ElementKind::Tet4 => "C3D4",
    })
}

fn write_mesh(deck: &mut String, scene: &Scene, mesh: &Mesh) -> Result<(), String> {
    deck.push_str("*NODE, NSET=all_nodes\n");
    for (node, x) in mesh.reference_position.chunks_exact(mesh.dimension).enumerate() {
        let z = x.get(2).copied().unwrap_or_default();
        let _ = writeln!(deck, "{}, {:.15e}, {:.15e}, {z:.15e}", node + 1, x[0], x[1]);
    }
    let _ = writeln!(deck, "*ELEMENT, TYPE={}, ELSET=body", element_type(scene)?);
    for element in 0..mesh.element_count() {
        let mut words = vec![element + 1];
        words.extend(mesh.element(element).iter().map(|node| node + 1));
        // A line holds at most 16 entries.
        for (order, line) in words.chunks(15).enumerate() {
            let line: Vec<String> = line.iter().map(usize::to_string).collect();
            let more = if (order + 1) * 15 < words.len() { "," } else { "" };
            let _ = writeln!(deck, "{}{more}", line.join(", "));
        }
    }
    Ok(())
}

fn write_material(deck: &mut String, scene: &Scene) -> Result<(), String> {
    let substance = &scene.substance;
    let _ = writeln!(deck, "*MATERIAL, NAME=matter\n*DENSITY\n{:e}", scene.density);
    let _ = writeln!(deck, "*ELASTIC\n{:e}, {:e}", substance.young_modulus, substance.poisson_ratio);
    match &substance.law {
        LawKind::StVenantKirchhoff => {}
        LawKind::NeoHookean => {
            return Err("neo_hookean differs from CalculiX's in its volumetric part".to_owned());
        }
        LawKind::Plasticity { hardening } => {
            deck.push_str("*PLASTIC\n");
            for (strain, stress) in hardening {
                let _ = writeln!(deck, "{stress:e}, {strain:e}");
            }
        }
    }
    let thickness = if scene.dimension() == 2 { "\n1." } else { "" };
    let _ = writeln!(deck, "*SOLID SECTION, ELSET=body, MATERIAL=matter{thickness}");
    Ok(())
}

fn write_supports(deck: &mut String, scene: &Scene) -> Result<(), String> {
    if scene.supports.iter().any(|support| support.motion != Prescribed::Fixed) {
        return Err("moving supports are not exported".to_owned());
    }
    if scene.damping > 0.0 || scene.stiffness_damping > 0.0 {
        return Err("damping is not exported: set it to 0".to_owned());
    }
    let solid = Solid::in_reference(scene.clone()).map_err(|error| error.to_string())?;
    deck.push_str("*BOUNDARY\n");
    for (component, _) in solid.fixed().iter().enumerate().filter(|(_, fixed)| **fixed) {
        let (node, axis) = (component / scene.dimension() + 1, component % scene.dimension() + 1);
        let _ = writeln!(deck, "{node}, {axis}, {axis}");
    }
    Ok(())
}

/// One set of one node for every gauge of displacement: the node nearest to it.
fn write_gauges(deck: &mut String, shared: &Shared, mesh: &Mesh) -> Vec<String> {
    let mut names = Vec::new();
    for gauge in &shared.gauges {
        let GaugeKind::Displacement { point } = &gauge.kind else { continue };
        let distance = |x: &[f64]| x.iter().zip(point).map(|(x, p)| (x - p).powi(2)).sum::<f64>();
        let nodes = mesh.reference_position.chunks_exact(mesh.dimension).enumerate();
        if let Some((node, _)) = nodes.min_by(|a, b| distance(a.1).total_cmp(&distance(b.1))) {
            let _ = writeln!(deck, "*NSET, NSET={}\n{}", gauge.name, node + 1);
            names.push(gauge.name.clone());
        }
    }
    names
}

fn write_step(deck: &mut String, shared: &Shared, settings: &Settings) {
    let (dt, end) = (shared.time.max_dt, shared.time.end);
    let is_linear = settings.scene.substance.kinematics == Kinematics::Linear;
    let geometry = if is_linear { "" } else { ", NLGEOM" };
    let _ = match settings.analysis {
        Analysis::Modes => writeln!(deck, "*STEP\n*FREQUENCY\n{}", end.round()),
        Analysis::Static => writeln!(deck, "*STEP, INC=10000{geometry}\n*STATIC\n{dt:e}, {end:e}"),
        Analysis::Dynamic => writeln!(
            deck,
            "*STEP, INC=1000000, AMPLITUDE=STEP{geometry}\n*DYNAMIC, DIRECT, ALPHA=0.\n{dt:e}, {end:e}"
        ),
    };
}

/// Weight and follower pressures as distributed loads, all else as forces on nodes; all at their value at time 0 or, if
/// they have a table, at its last row, which only a static analysis may have.
fn write_loads(deck: &mut String, scene: &Scene, mesh: &Mesh) -> Result<(), String> {
    let owners = owners(mesh);
    deck.push_str("*DLOAD\n");
    let size = scene.gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
    if size > 0.0 {
        let [x, y, z] = scene.gravity.map(|g| g / size);
        let _ = writeln!(deck, "body, GRAV, {size:e}, {x:e}, {y:e}, {z:e}");
    }
    let mut dead = Scene { gravity: [0.0; 3], loads: Vec::new(), ..scene.clone() };
    for load in &scene.loads {
        let FaceLoadKind::FollowerPressure(pressure) = load.kind else {
            dead.loads.push(load.clone());
            continue;
        };
        let factor = load.table.last().map_or(1.0, |row| row.1);
        let facets = &mesh.face(&load.face).ok_or("a load on a face that is not there")?.facets;
        for facet in facets.chunks_exact(mesh.cell.facet().nodes()) {
            let (element, face) = owners[&key(mesh.cell, facet)];
            let _ = writeln!(deck, "{}, P{}, {:e}", element + 1, face + 1, factor * pressure);
        }
    }
    let at = dead.loads.iter().flat_map(|load| &load.table).map(|row| row.0).fold(0.0, f64::max);
    let solid = Solid::in_reference(dead).map_err(|error| error.to_string())?;
    deck.push_str("*CLOAD\n");
    for (component, force) in solid.external_force_at(at).iter().enumerate().filter(|(_, f)| **f != 0.0) {
        let (node, axis) = (component / mesh.dimension + 1, component % mesh.dimension + 1);
        let _ = writeln!(deck, "{node}, {axis}, {force:.15e}");
    }
    Ok(())
}

/// Element and number of its face by the sorted corners of the facet.
fn owners(mesh: &Mesh) -> HashMap<Vec<usize>, (usize, usize)> {
    let mut owners = HashMap::new();
    for element in 0..mesh.element_count() {
        for face in 0..mesh.cell.face_corners().len() {
            let nodes = mesh.element(element);
            let facet: Vec<usize> = mesh.cell.face_nodes(face).iter().map(|&local| nodes[local]).collect();
            owners.insert(key(mesh.cell, &facet), (element, face));
        }
    }
    owners
}

fn key(cell: Cell, facet: &[usize]) -> Vec<usize> {
    let mut key = facet[..cell.facet().corners()].to_vec();
    key.sort_unstable();
    key
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh_file;

    const CASE: &str = "[case]\nname = \"t\"\ndimension = 3\n[time]\nend = 1.0\nmax_dt = 0.5\n[gravity]\n\
        acceleration = [0, -9.81, 0]\n[solid]\nmin = [0, 0, 0]\nmax = [1, 2, 3]\nelements = [1, 2, 3]\n\
        clamped = [\"bottom\"]\ndensity = 1000\nyoung_modulus = 1e9\nanalysis = \"static\"\n[[solid.load]]\n\
        face = \"left\"\npressure = 5\n[[gauge]]\nname = \"tip\"\nkind = \"displacement\"\npoint = [0, 2, 3]\n";

    /// The mesh of the deck is read back as it was, for every element that can be written.
    #[test]
    fn a_deck_holds_the_mesh_and_the_loads() {
        for element in ["hex8_eas9", "hex20", "tet10", "tet4"] {
            let case = CaseFile::parse("t.toml", CASE, &[format!("solid.element=\"{element}\"")]);
            let text = deck(&case).unwrap();
            let read = mesh_file::parse(&text, 3).unwrap();
            let shared = Shared::read(&case);
            let scene = Settings::read(&case, &shared).unwrap().scene;
            assert_eq!(read.connectivity, scene.mesh().connectivity);
            let facets = if scene.element.cell().is_simplex() { 12 } else { 6 };
            assert_eq!(text.lines().filter(|line| line.contains(", P")).count(), facets, "{element}");
            assert!(text.contains("GRAV, 9.81e0, 0e0, -1e0, 0e0"), "{text}");
            assert!(text.contains("*NODE PRINT, NSET=tip"));
        }
    }
}
