//! Estimate of the added-mass ratio before a run: what decides which coupling scheme is stable.

use protocol::case::{FluidOutline, Scheme, Shared};

use crate::case::Settings;

/// Largest added-mass ratio at which the conventional staggered scheme is stable with the default integrator, by order
/// of the prediction, in a modal model; the real fluid's limit of a column of known mass lies a tenth lower.
const CSS_LIMITS: [f64; 3] = [2.8, 2.1, 1.1];

/// Largest added-mass ratio for a Robin wall that is chosen: beyond it the wall is stable, but its motion is right with
/// thousands of steps a period only, and what it gives way by is no small part of its work.
pub const ROBIN_LIMIT: f64 = 50.0;

/// Largest pressure of the water over Young's modulus for a Robin wall that is chosen: a wall that is squeezed by more
/// does not set off as one mass, as the Robin wall takes it to. At 3 % the dam break's loads are restless, at 0.3 % calm.
pub const SOFT: f64 = 0.02;

/// Largest added-mass ratio for a conventional staggered scheme with this order of prediction.
pub fn css_limit(prediction_order: u8) -> f64 {
    CSS_LIMITS[usize::from(prediction_order)]
}

/// r = rho_f l_a / (rho_s h) times the number of wet sides.
///
/// l_a is L / 1.9 for a wall of length L clamped at one end (beside open water), 0.7 of the water's depth for a plate
/// held at both ends, the depth for a body that is not held. `None` without water, or for a rigid body.
pub fn estimate(shared: &Shared) -> Option<f64> {
    let (fluid, solid) = (shared.fluid.as_ref()?, shared.solid.as_ref()?);
    let density = solid.density.filter(|_| solid.model == "fem")?;
    let thickness_axis = solid.thickness_axis();
    let depth = depth(fluid);
    let mut held = solid.clamped.iter().filter(|face| face.axis() != thickness_axis);
    let length = match (held.next(), held.next()) {
        (Some(face), None) => solid.region.length(face.axis()) / 1.9,
        (Some(_), Some(_)) => 0.7 * depth,
        (None, _) => depth,
    };
    let wall_mass = density * solid.region.length(thickness_axis);
    Some(fluid.density * length / wall_mass * solid.wet_sides() as f64)
}

/// rho_f g H / E: what the water at rest squeezes the wall by. `None` without water or gravity, or for a rigid body.
pub fn softness(shared: &Shared) -> Option<f64> {
    let (fluid, solid) = (shared.fluid.as_ref()?, shared.solid.as_ref()?);
    let modulus = solid.young_modulus.filter(|_| solid.model == "fem")?;
    let gravity = shared.gravity.as_ref()?.acceleration.iter().map(|a| a * a).sum::<f64>().sqrt();
    Some(fluid.density * gravity * depth(fluid) / modulus)
}

/// Greatest height of a box of water, m.
fn depth(fluid: &FluidOutline) -> f64 {
    fluid.regions.iter().map(|region| region.length(1)).fold(0.0, f64::max)
}

/// What a ratio means for a scheme, in words for the plan.
pub fn meaning(ratio: f64, settings: &Settings) -> String {
    let carries = format!("the wall carries {ratio:.1} times its own mass in water");
    let limit = css_limit(settings.prediction_order);
    match settings.scheme {
        Scheme::Robin => {
            let steps = steps_a_period(ratio);
            format!("{carries}; Robin wall: stable, its motion right from {steps} steps a period on")
        }
        Scheme::Strong => format!("{carries}; sub-iterations: stable"),
        Scheme::ToSolid | Scheme::ToFluid => format!("{carries}, which a one-way scheme leaves out"),
        Scheme::Css | Scheme::Parallel if ratio < 0.3 * limit => format!("{carries}; staggered: stable"),
        Scheme::Css | Scheme::Parallel => {
            format!("{carries}; staggered is at or past its limit, a smaller step does not help")
        }
    }
}

/// Steps a coupled period that the Robin wall needs for a frequency right to 2 %: it treats the change of the load over
/// a step as if the wall had no stiffness.
fn steps_a_period(ratio: f64) -> u32 {
    match ratio {
        ratio if ratio <= 5.0 => 100,
        ratio if ratio <= 10.0 => 200,
        ratio if ratio <= ROBIN_LIMIT => 600,
        _ => 3000,
    }
}

#[cfg(test)]
mod tests {
    use protocol::case::CaseFile;

    use super::*;

    #[test]
    fn the_paper_s_obstacle_carries_its_own_mass_in_water_per_wet_side() {
        let text = "[case]\nname='a'\ndimension=2\n[domain]\nmin=[0,0]\nmax=[0.584,1]\n[fluid]\n[[fluid.region]]\n\
                    min=[0,0]\nmax=[0.146,0.292]\n[solid]\nmin=[0.292,0]\nmax=[0.304,0.08]\ndensity=2500\n\
                    clamped=['bottom']\n[time]\nend=1\nmax_dt=1e-3\n";
        let css = format!("{text}[coupling]\nscheme='css'\n");
        let case = CaseFile::parse("a", &css, &[]);
        let shared = Shared::read(&case);
        let ratio = estimate(&shared).unwrap();
        // 1000 * 0.08 / 1.9 / (2500 * 0.012) = 1.404 per side.
        assert!((ratio - 2.0 * 1.404).abs() < 0.01, "{ratio}");
        assert!(meaning(ratio, &Settings::read(&case, &shared)).contains("past its limit"));
        // Where the guard may choose, it does not begin with what cannot hold.
        let free = CaseFile::parse("a", &format!("{css}on_guard='escalate'\n"), &[]);
        assert_eq!(Settings::read(&free, &Shared::read(&free)).scheme, Scheme::Robin);
        // A wall that the water squeezes by a quarter is passed over from the start: 1000 * 9.81 * 0.292 / 1e4.
        let soft = text.replace("density=2500", "density=2500\nyoung_modulus=1e4");
        let soft = CaseFile::parse("a", &format!("{soft}[gravity]\nacceleration=[0,-9.81]\n"), &[]);
        let shared = Shared::read(&soft);
        assert!((softness(&shared).unwrap() - 0.2865).abs() < 1e-4);
        assert_eq!(Settings::read(&soft, &shared).scheme, Scheme::Strong);
    }
}
