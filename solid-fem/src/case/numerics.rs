//! Element, kinematics and time integration.

use protocol::case::Section;

use crate::element::{ElementKind, Kinematics};
use crate::integrator::Integrator;
use crate::scene::Scene;

pub(super) fn read(section: &Section<'_>, scene: &mut Scene) {
    read_element(section, scene);
    scene.integrator = read_integrator(section);
    let max_dt = section.number("max_dt").unit("s").above(0.0);
    scene.max_dt = max_dt
        .about("Longest step of the body; a longer coupling step is taken in equal parts, the load linear over it.")
        .optional();
    let tolerance = section.number("newton_tolerance").above(0.0).below(0.1);
    scene.newton_tolerance =
        tolerance.about("Residual over the largest force at which Newton's method stops.").default(1.5e-6);
}

fn read_element(section: &Section<'_>, scene: &mut Scene) {
    let dimension = scene.dimension();
    let kinds: Vec<_> = ElementKind::ALL.into_iter().filter(|kind| kind.dimension() == dimension).collect();
    let names: Vec<_> = kinds.iter().map(|kind| kind.name()).collect();
    let element = section
        .choice("element", &names)
        .about("Element; tri3 and tet4 are far too stiff in bending and serve comparisons only.")
        .default(scene.element.name());
    scene.element = kinds.into_iter().find(|kind| kind.name() == element).unwrap_or(scene.element);
    let kinematics = section
        .choice("kinematics", &Kinematics::NAMES)
        .about(
            "linear: small displacement, assembled and factored once; total_lagrangian: any; updated_lagrangian: the \
             same over the current shape, not with enhanced elements.",
        )
        .default(Kinematics::NAMES[1]);
    let index = Kinematics::NAMES.iter().position(|&name| name == kinematics).unwrap_or_default();
    scene.substance.kinematics = Kinematics::ALL[index];
    if scene.substance.kinematics == Kinematics::UpdatedLagrangian && scene.element.is_enhanced() {
        let others =
            names.iter().filter(|name| !name.contains("eas")).copied().collect::<Vec<_>>().join(", ");
        let what = format!("updated_lagrangian does not go with {element}");
        let hint =
            "The enhanced strain lives in the unloaded shape; total_lagrangian gives the same numbers.";
        section.complain("kinematics", what, &format!("with element {others}"), hint);
    }
    if dimension == 2 {
        let plane = section
            .choice("plane", &["strain", "stress"])
            .about("2-D: plane strain, or plane stress (a thin plate, of 1 m depth in all sums).")
            .default("strain");
        scene.substance.is_plane_stress = plane == "stress";
    }
}

fn read_integrator(section: &Section<'_>) -> Integrator {
    let integrator = section
        .choice("integrator", &["generalised_alpha", "newmark", "energy_momentum"])
        .about(
            "Time integration: generalised_alpha is of second order, newmark as in the paper of first; energy_momentum \
             keeps energy and angular momentum at any step (st_venant_kirchhoff only).",
        )
        .default("generalised_alpha");
    let rho_inf = section.number("rho_inf").at_least(0.0).at_most(1.0);
    let rho_inf =
        rho_inf.about("generalised_alpha: share of the highest frequencies kept per step.").default(0.5);
    let gamma = section.number("newmark_gamma").about("newmark: gamma, 0.5 .. 1, in the standard meaning.");
    let gamma = gamma.default(0.6);
    let beta = section.number("newmark_beta").about("newmark: beta, newmark_gamma / 2 .. 1.").default(0.3025);
    match integrator.as_str() {
        "newmark" => checked_newmark(section, gamma, beta),
        "energy_momentum" => Integrator::EnergyMomentum,
        _ => Integrator::GeneralisedAlpha { rho_inf },
    }
}

fn checked_newmark(section: &Section<'_>, gamma: f64, beta: f64) -> Integrator {
    if !(0.5..=1.0).contains(&gamma) {
        let hint = "Below 1/2 the scheme feeds energy in; the paper's table prints gamma and beta the other way round.";
        section.complain("newmark_gamma", format!("{gamma} is not allowed"), "0.5 .. 1", hint);
    } else if !(0.5 * gamma..=1.0).contains(&beta) {
        let hint = "Below newmark_gamma / 2 the scheme is stable for small steps only; (gamma + 0.5)^2 / 4 is usual.";
        section.complain(
            "newmark_beta",
            format!("{beta} is not allowed"),
            &format!("{} .. 1", 0.5 * gamma),
            hint,
        );
    } else {
        return Integrator::Newmark { gamma, beta };
    }
    Integrator::PAPER
}
