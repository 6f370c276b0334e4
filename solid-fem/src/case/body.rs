//! Material, supports and weight.

use protocol::case::{Section, Shared};

use crate::material::LawKind;
use crate::scene::Scene;
use crate::support::Support;
use protocol::case::Prescribed;

pub(super) fn read_material(section: &Section<'_>, scene: &mut Scene) {
    scene.density =
        section.number("density").unit("kg/m3").above(0.0).about("Density of the body.").required();
    let substance = &mut scene.substance;
    substance.young_modulus =
        section.number("young_modulus").unit("Pa").above(0.0).about("Young's modulus.").required();
    let ratio = section.number("poisson_ratio").at_least(0.0).below(0.5);
    substance.poisson_ratio = ratio.about("Poisson's ratio; rubber-like bodies take 0.49.").default(0.0);
    let law = section
        .choice("material", &LawKind::NAMES)
        .about(
            "st_venant_kirchhoff: large rotation, small strain; neo_hookean: soft bodies at large strain; plasticity: J2 \
             with isotropic hardening at finite strain.",
        )
        .default(LawKind::NAMES[0]);
    let rows = section.rows(
        "hardening",
        2,
        "-, Pa",
        "plasticity: rows [equivalent plastic strain, yield stress], the first at 0; constant after the last.",
    );
    substance.law = match (law.as_str(), rows) {
        ("neo_hookean", None) => LawKind::NeoHookean,
        ("plasticity", Some(rows)) => read_hardening(section, &rows),
        ("plasticity", None) => {
            let hint = "For example hardening = [[0, 235e6], [0.2, 400e6]].";
            section.complain("hardening", "plasticity needs a yield stress", "rows of two numbers", hint);
            LawKind::default()
        }
        (law, Some(_)) => {
            let hint = "Remove the rows, or set material = \"plasticity\".";
            section.complain("hardening", format!("{law} has no use for it"), "", hint);
            LawKind::default()
        }
        _ => LawKind::StVenantKirchhoff,
    };
    let damping = section.number("damping").unit("1/s").at_least(0.0);
    scene.damping =
        damping.about("Mass-proportional damping a: vibration decays as exp(-a t / 2).").default(0.0);
    let damping = section.number("stiffness_damping").unit("s").at_least(0.0);
    scene.stiffness_damping = damping
        .about(
            "Stiffness-proportional damping b: vibration of angular frequency w decays as exp(-b w^2 t / 2). It takes \
             the stiffness of the unloaded body, so it is for small rotation only.",
        )
        .default(0.0);
}

fn read_hardening(section: &Section<'_>, rows: &[Vec<f64>]) -> LawKind {
    let hardening: Vec<_> = rows.iter().map(|row| (row[0], row[1])).collect();
    let is_ascending = hardening.windows(2).all(|pair| pair[0].0 < pair[1].0 && pair[0].1 <= pair[1].1);
    if !is_ascending || hardening[0].0 != 0.0 || hardening[0].1 <= 0.0 {
        let allowed = "plastic strain from 0 upwards, yield stress above 0 that does not fall";
        section.complain("hardening", format!("{hardening:?} is not allowed"), allowed, "");
    }
    LawKind::Plasticity { hardening }
}

/// Reads what holds the body; gives the names of faces that loads may use.
pub(super) fn read_supports(section: &Section<'_>, clamped: Vec<String>, scene: &mut Scene) -> Vec<String> {
    let mesh = scene.mesh();
    let faces: Vec<String> = mesh.faces.iter().map(|face| face.name.clone()).collect();
    let names: Vec<&str> = faces.iter().map(String::as_str).collect();
    let names = names.as_slice();
    scene.rollers =
        section.choice("rollers", names).about("Faces that slide in their own plane (symmetry).").list(&[]);
    scene.clamped = clamped;
    scene.supports = section
        .list("support")
        .iter()
        .map(|support| read_support(support, names, scene.dimension()))
        .collect();
    if let Err(error) = scene.check_supports(&mesh) {
        section.complain(
            "clamped",
            error.to_string(),
            &names.join(", "),
            "Name the faces that are held, such as clamped = [\"bottom\"].",
        );
    }
    faces
}

fn read_support(section: &Section<'_>, names: &[&str], dimension: usize) -> Support {
    let face = section.choice("face", names).about("Face that is held.").required();
    let axes = ["x", "y", "z"];
    let held = section.choice("axes", &axes[..dimension]).about("Along which axes (default: all).");
    let held = held.list(&axes[..dimension]);
    let motion = section.inner("motion").map(|motion| Prescribed::read(&motion, dimension));
    section.finish();
    let axes = axes.map(|axis| held.iter().any(|held| held == axis));
    Support { face, axes, motion: motion.unwrap_or_default() }
}

pub(super) fn read_weight(section: &Section<'_>, shared: &Shared, scene: &mut Scene) {
    let has_weight = section.flag("weight", true, "Whether gravity acts on the body too.");
    scene.gravity = [0.0; 3];
    if let Some(gravity) = shared.gravity.as_ref().filter(|_| has_weight) {
        scene.gravity[..gravity.acceleration.len()].copy_from_slice(&gravity.acceleration);
        scene.gravity_table = gravity.table.clone().unwrap_or_default();
    }
}
