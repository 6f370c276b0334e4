use super::*;

const MODULUS: f64 = 2.1e11;
const RATIO: f64 = 0.3;

fn kept(law: &dyn Law) -> Vec<f64> {
    vec![0.0; law.history_len()]
}

fn steel() -> Box<dyn Law> {
    LawKind::Plasticity { hardening: vec![(0.0, 235e6), (1.0, 235e6 + 2e9)] }.build(MODULUS, RATIO).unwrap()
}

/// Drives a law along a path of strains in space, one step each; the last S and history.
fn drive(law: &dyn Law, path: impl Iterator<Item = [f64; 6]>) -> ([f64; 6], Vec<f64>) {
    let (mut old, mut stress) = (kept(law), [0.0; 6]);
    for strain in path {
        let mut new = old.clone();
        (stress, _) = law.response(&strain, History { old: &old, new: &mut new }).unwrap();
        old = new;
    }
    (stress, old)
}

/// Uniaxial tension to a stretch: the lateral stretch is found by Newton's method on a free side. Gives the Kirchhoff
/// stress, the lateral stretch and the plastic strain.
fn pull(law: &dyn Law, stretches: &[f64]) -> (f64, f64, f64) {
    let (mut old, mut lateral, mut result) = (kept(law), 1.0f64, (0.0, 1.0, 0.0));
    for &stretch in stretches {
        for _ in 0..50 {
            let e = |stretch: f64| 0.5 * (stretch * stretch - 1.0);
            let strain = [e(stretch), e(lateral), e(lateral), 0.0, 0.0, 0.0];
            let mut new = old.clone();
            let (stress, moduli) = law.response(&strain, History { old: &old, new: &mut new }).unwrap();
            let slope = (moduli[1][1] + moduli[1][2]) * lateral;
            lateral -= stress[1] / slope;
            if stress[1].abs() < 1e-9 * stress[0].abs() {
                old = new;
                result = (stress[0] * stretch * stretch, lateral, old.get(6).copied().unwrap_or_default());
                break;
            }
        }
    }
    result
}

/// Uniaxial tension to a logarithmic strain of 10 %: tau = sy + H ep with ep = eps - tau/E, and the plastic part of the
/// lateral strain is -ep/2: exact, in one step or in twenty.
#[test]
fn plasticity_in_tension_is_exact() {
    let (strain, hardening) = (0.1f64, 2e9);
    let plastic = (strain - 235e6 / MODULUS) / (1.0 + hardening / MODULUS);
    let stress = 235e6 + hardening * plastic;
    for steps in [1, 20] {
        let stretches: Vec<f64> =
            (1..=steps).map(|step| (strain * f64::from(step) / f64::from(steps)).exp()).collect();
        let (found, lateral, kept) = pull(steel().as_ref(), &stretches);
        assert!((found / stress - 1.0).abs() < 1e-8, "{found} {stress}");
        assert!((kept / plastic - 1.0).abs() < 1e-8, "{kept} {plastic}");
        let expected = -0.5 * plastic - RATIO * stress / MODULUS;
        assert!((lateral.ln() / expected - 1.0).abs() < 1e-7, "{}", lateral.ln());
    }
}

/// Tension, then back to zero strain: the reverse flow starts at the hardened yield stress (isotropic hardening).
#[test]
fn plasticity_remembers_its_hardening() {
    let law = steel();
    let forth: Vec<f64> = vec![0.05f64.exp()];
    let (up, _, kept) = pull(law.as_ref(), &forth);
    let (down, _, after) = pull(law.as_ref(), &[0.05f64.exp(), 1.0]);
    // From +tau elastically to -tau over 2 tau / E, then flow over the rest of 5 %.
    let further = (0.05 - 2.0 * up / MODULUS) / (1.0 + 2e9 / MODULUS);
    assert!((after - kept - further).abs() < 1e-8, "{after} {kept} {further}");
    assert!((down + up + 2e9 * further).abs() < 1e-6 * up, "{down} {up}");
}

/// Simple shear by gamma = tan: in small strain tau = G gamma up to sy / sqrt 3, and without hardening it stays there.
#[test]
fn plasticity_in_simple_shear_stays_at_the_yield_stress() {
    let law = LawKind::Plasticity { hardening: vec![(0.0, 235e6)] }.build(MODULUS, RATIO).unwrap();
    let shear = MODULUS / (2.0 * (1.0 + RATIO));
    let limit = 235e6 / 3.0f64.sqrt();
    // F = [1 gamma; 0 1]: E_12 = gamma/2, E_22 = gamma^2/2.
    let at = |gamma: f64| [0.0, 0.5 * gamma * gamma, 0.0, gamma, 0.0, 0.0];
    let elastic = 0.9 * limit / shear;
    let (stress, _) = drive(law.as_ref(), [at(elastic)].into_iter());
    assert!((stress[3] / (0.9 * limit) - 1.0).abs() < 1e-4, "{stress:?}");
    let (stress, kept) = drive(law.as_ref(), (1..=200).map(|step| at(2e-4 * f64::from(step))));
    // Kirchhoff shear stress tau_12 = (F S F')_12 = S_12 + gamma S_22.
    let tau = stress[3] + 0.04 * stress[1];
    assert!((tau / limit - 1.0).abs() < 2e-3, "{tau} {limit}");
    let plastic = 0.04 / 3.0f64.sqrt() - limit / (shear * 3.0f64.sqrt());
    assert!((kept[6] / plastic - 1.0).abs() < 2e-3, "{} {plastic}", kept[6]);
}

/// The plastic flow keeps the volume: det Cp^-1 = 1 after a path of large strain along no axis.
#[test]
fn plastic_flow_keeps_the_volume() {
    let law = steel();
    let path =
        (1..=10).map(|step| [0.3, -0.1, 0.05, 0.2, -0.15, 0.1].map(|e: f64| e * f64::from(step) / 10.0));
    let (_, kept) = drive(law.as_ref(), path);
    let mut inverse = tensor::of_stress(&std::array::from_fn(|s| kept[s]));
    (0..3).for_each(|i| inverse[i][i] += 1.0);
    assert!((crate::element::matrix::determinant(&inverse) - 1.0).abs() < 1e-12);
    assert!(kept[6] > 0.1);
}

/// dS/dE by differences of S, in elastic and plastic states, also with equal stretches.
#[test]
fn moduli_are_the_derivative() {
    let soft = LawKind::Plasticity { hardening: vec![(0.0, 2e9), (0.2, 4e9)] };
    for kind in [LawKind::NeoHookean, soft] {
        let law = kind.build(MODULUS, RATIO).unwrap();
        for strain in [
            [0.0; 6],
            [0.002, 0.001, -0.001, 0.003, 0.0, 0.001],
            [0.1, 0.1, -0.05, 0.0, 0.0, 0.0],
            [0.2, -0.1, 0.1, 0.1, -0.2, 0.05],
        ] {
            let old = drive(law.as_ref(), [strain.map(|e| 0.5 * e)].into_iter()).1;
            let mut new = old.clone();
            let mut at =
                |strain: [f64; 6]| law.response(&strain, History { old: &old, new: &mut new }).unwrap();
            let (_, moduli) = at(strain);
            for column in 0..6 {
                let moved = |by: f64| {
                    let mut moved = strain;
                    moved[column] += by;
                    moved
                };
                let (up, down) = (at(moved(1e-6)).0, at(moved(-1e-6)).0);
                for row in 0..6 {
                    let difference = (up[row] - down[row]) / 2e-6;
                    let error = (difference - moduli[row][column]).abs() / MODULUS;
                    assert!(error < 1e-7, "{kind:?} {strain:?} {row} {column}: {error:e}");
                }
            }
        }
    }
}

/// A neo-Hookean bar resists crushing where St.Venant-Kirchhoff gives way: at a stretch of 0.2 the stress grows on.
#[test]
fn neo_hookean_does_not_collapse() {
    let law = LawKind::NeoHookean.build(1.0, 0.0).unwrap();
    let nominal = |stretch: f64| pull(law.as_ref(), &[stretch]).0 / stretch;
    assert!(nominal(0.2) < nominal(0.4) && nominal(0.4) < nominal(0.577));
    // nu = 0: tau = mu (l^2 - 1) with mu = 1/2.
    assert!((nominal(0.5) - 0.5 * (0.25 - 1.0) / 0.5).abs() < 1e-12);
}
