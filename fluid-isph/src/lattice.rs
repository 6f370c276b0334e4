//! The initial lattice: a spacing that fits water and tank, water particles half a spacing from every wall plane,
//! as many layers of wall particles behind it as the kernel reaches.

use crate::error::SetupError;
use crate::scene::Scene;
use crate::vector::{Vector, add_scaled};

/// Layers of a shell whose pitch is not the lattice's: deep enough for any kernel.
pub const SHELL_LAYERS: usize = 3;

/// Largest change of the spacing asked for.
pub const SPACING_ADJUSTMENT: f64 = 0.02;

/// A length fits when it must be stretched by less than this to be a whole number of spacings.
const GOOD_FIT: f64 = 1e-6;

/// Largest stretch of the lattice along one axis that is accepted.
const LARGEST_STRETCH: f64 = 5e-3;

/// Particles of the start.
#[derive(Debug, Clone, Default)]
pub struct Lattice<const D: usize> {
    /// Spacing used, m.
    pub spacing: f64,
    /// Water particles, m.
    pub water: Vec<Vector<D>>,
    /// Their velocity, m/s.
    pub velocity: Vec<Vector<D>>,
    /// Wall particles of the tank, m.
    pub wall: Vec<Vector<D>>,
}

impl<const D: usize> Lattice<D> {
    /// Builds the lattice of a scene.
    ///
    /// # Errors
    /// [`SetupError::SpacingDoesNotFit`], [`SetupError::SpacingTooLarge`], [`SetupError::NoWater`].
    pub fn new(scene: &Scene<D>) -> Result<Self, SetupError> {
        let spacing = fitting_spacing(scene)?;
        let mut lattice = Self { spacing, ..Self::default() };
        lattice.fill_water(scene);
        if lattice.water.is_empty() && !scene.water.is_empty() {
            return Err(SetupError::NoWater);
        }
        lattice.build_walls(scene);
        Ok(lattice)
    }

    fn fill_water(&mut self, scene: &Scene<D>) {
        for (number, water) in scene.water.iter().enumerate() {
            let axes: [Vec<f64>; D] =
                std::array::from_fn(|k| layer_centres(water.min[k], water.max[k], self.spacing));
            for_each_point(&axes, |x, _| {
                let taken = scene.water[..number]
                    .iter()
                    .any(|earlier| (0..D).all(|k| x[k] > earlier.min[k] && x[k] < earlier.max[k]));
                let covered = || scene.obstacles.iter().any(|obstacle| obstacle.contains(&x));
                if !taken && !covered() {
                    self.water.push(x);
                    self.velocity.push(water.velocity);
                }
            });
        }
        if let Some(flow) = &scene.flow {
            for (x, v) in self.water.iter().zip(&mut self.velocity) {
                add_scaled(v, 1.0, &flow.velocity(x));
            }
        }
        if let Some(jitter) = scene.jitter {
            displace(&mut self.water, jitter * self.spacing);
        }
    }

    /// Layers behind every face that is not open; those of other faces run on past periodic ends.
    fn build_walls(&mut self, scene: &Scene<D>) {
        let (tank, deep) = (&scene.tank, scene.kernel.wall_layers());
        let layers = |k: usize, upper: usize| if tank.open[k][upper] { 0 } else { deep };
        let axes: [Vec<f64>; D] = std::array::from_fn(|k| {
            let below = (0..layers(k, 0)).rev().map(|n| tank.min[k] - (n as f64 + 0.5) * self.spacing);
            let inside = match tank.open[k] {
                [false, false] => layer_centres(tank.min[k], tank.max[k], self.spacing),
                open => layers_from_wall((tank.min[k], tank.max[k]), open, self.spacing),
            };
            let above = (0..layers(k, 1)).map(|n| tank.max[k] + (n as f64 + 0.5) * self.spacing);
            below.chain(inside).chain(above).collect()
        });
        let inside: [std::ops::Range<usize>; D] = std::array::from_fn(|k| match scene.periodic[k] {
            true => 0..axes[k].len(),
            false => layers(k, 0)..axes[k].len() - layers(k, 1),
        });
        for_each_point(&axes, |x, at| {
            let in_hole = || scene.openings.iter().any(|opening| opening.holds(&x, tank));
            if (0..D).any(|k| !inside[k].contains(&at[k])) && !in_hole() {
                self.wall.push(x);
            }
        });
    }
}

/// Centres of the layers that fill `lower..upper`: as many as fit best, stretched to fill it exactly.
pub(crate) fn layer_centres(lower: f64, upper: f64, spacing: f64) -> Vec<f64> {
    let count = ((upper - lower) / spacing).round().max(1.0);
    let pitch = (upper - lower) / count;
    (0..count as usize).map(|k| lower + (k as f64 + 0.5) * pitch).collect()
}

/// Centres of the layers between `lower` and `upper` of which one at least is open: at the spacing of the lattice itself, from the
/// wall on. Stretched to end at the rim they would be out of step with the water, and dense or thin to it.
fn layers_from_wall((lower, upper): (f64, f64), open: [bool; 2], spacing: f64) -> Vec<f64> {
    let count = ((upper - lower) / spacing).round().max(1.0);
    let first = if open[0] && !open[1] { upper - count * spacing } else { lower };
    (0..count as usize).map(|k| first + (k as f64 + 0.5) * spacing).collect()
}

/// Visits every point of a product of axes, x fastest, with its numbers along the axes.
pub(crate) fn for_each_point<const D: usize>(
    axes: &[Vec<f64>; D],
    mut visit: impl FnMut(Vector<D>, [usize; D]),
) {
    for number in 0..axes.iter().map(Vec::len).product() {
        let mut rest: usize = number;
        let at: [usize; D] = std::array::from_fn(|k| {
            let digit = rest % axes[k].len();
            rest /= axes[k].len();
            digit
        });
        visit(std::array::from_fn(|k| axes[k][at[k]]), at);
    }
}

/// Moves every coordinate by up to `amplitude` m, by a fixed sequence of random numbers (splitmix64).
fn displace<const D: usize>(points: &mut [Vector<D>], amplitude: f64) {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    for coordinate in points.iter_mut().flatten() {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        let unit = ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64;
        *coordinate += amplitude * (2.0 * unit - 1.0);
    }
}

/// The spacing nearest to the one asked for, within 2 %, of which every length of water and closed tank is a whole
/// number; if there is none, the one that stretches them least, up to half a percent.
///
/// # Errors
/// [`SetupError::SpacingTooLarge`] when a length holds no layer, [`SetupError::SpacingDoesNotFit`].
pub fn fitting_spacing<const D: usize>(scene: &Scene<D>) -> Result<f64, SetupError> {
    let asked = scene.particle_spacing;
    let lengths = lengths_to_fit(scene);
    if let Some(&shortest) = lengths.iter().find(|&&length| length < 0.75 * asked) {
        return Err(SetupError::SpacingTooLarge { spacing: asked, length: shortest });
    }
    let mut candidates = vec![asked];
    for length in &lengths {
        let count = (length / asked).round();
        candidates.extend((-2..=2).map(|k| length / (count + f64::from(k)).max(1.0)));
    }
    candidates.retain(|candidate| (candidate / asked - 1.0).abs() <= SPACING_ADJUSTMENT + 1e-12);
    let stretch = |spacing: f64| {
        let each = lengths.iter().map(|length| {
            let count = length / spacing;
            ((count.round() - count).abs() / count, *length)
        });
        each.fold((0.0, 0.0), |worst: (f64, f64), one| if one.0 > worst.0 { one } else { worst })
    };
    let rank = |spacing: f64| {
        let worst = stretch(spacing).0;
        (if worst <= GOOD_FIT { 0.0 } else { worst }, (spacing - asked).abs())
    };
    let better = |a: &f64, b: &f64| rank(*a).partial_cmp(&rank(*b)).unwrap_or(std::cmp::Ordering::Equal);
    let best = candidates.iter().copied().min_by(better).unwrap_or(asked);
    let (worst, length) = stretch(best);
    if worst > LARGEST_STRETCH {
        return Err(SetupError::SpacingDoesNotFit { spacing: asked, length, stretch: worst });
    }
    Ok(best)
}

/// Lengths that should be whole numbers of the spacing: sides of the water, its distance from the wall, and the tank
/// where it is closed on both sides.
fn lengths_to_fit<const D: usize>(scene: &Scene<D>) -> Vec<f64> {
    let tank = &scene.tank;
    let mut lengths = Vec::new();
    for k in 0..D {
        if !tank.open[k][0] && !tank.open[k][1] {
            lengths.push(tank.max[k] - tank.min[k]);
        }
        for water in &scene.water {
            lengths.push(water.max[k] - water.min[k]);
            let gap = water.min[k] - tank.min[k];
            if gap > 0.1 * scene.particle_spacing {
                lengths.push(gap);
            }
        }
    }
    lengths
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Tank, WaterBox};

    fn dam(spacing: f64) -> Scene<2> {
        let tank = Tank { min: [0.0; 2], max: [0.584, 1.0], open: [[false; 2], [false, true]] };
        let water = WaterBox { min: [0.0; 2], max: [0.146, 0.292], velocity: [0.0; 2] };
        Scene::new(tank, vec![water], spacing)
    }

    #[test]
    fn the_dam_break_at_three_millimetres_uses_2_98() {
        let lattice = Lattice::new(&dam(0.003)).unwrap();
        assert!((lattice.spacing - 0.146 / 49.0).abs() < 1e-12);
        assert_eq!(lattice.water.len(), 49 * 98);
        let lowest = lattice.water.iter().map(|x| x[1]).fold(1.0, f64::min);
        assert!((lowest - 0.5 * lattice.spacing).abs() < 1e-12);
    }

    #[test]
    fn walls_stand_half_a_spacing_behind_their_plane_with_filled_corners() {
        let mut scene = dam(0.0146);
        scene.tank.open[1][1] = false;
        scene.tank.max[1] = 0.292;
        let lattice = Lattice::new(&scene).unwrap();
        assert_eq!(lattice.wall.len(), (40 + 4) * (20 + 4) - 40 * 20);
        assert!(
            lattice.wall.iter().all(|x| { x[0] < -0.007 || x[0] > 0.591 || x[1] < -0.007 || x[1] > 0.299 })
        );
    }

    /// 1.0 m is no whole number of spacings; the water's 0.292 m is, and its rows must go on in the walls beside it.
    #[test]
    fn walls_beside_an_open_face_are_in_step_with_the_water() {
        let mut scene = dam(0.003);
        for open in [[false, true], [true, false]] {
            scene.tank.open[1] = open;
            let lattice = Lattice::new(&scene).unwrap();
            let start = if open[0] { scene.tank.max[1] } else { scene.tank.min[1] };
            let rows = |x: &Vector<2>| ((x[1] - start) / lattice.spacing + 0.5).rem_euclid(1.0);
            assert!(lattice.wall.iter().all(|x| rows(x).min(1.0 - rows(x)) < 1e-6), "{open:?}");
        }
    }

    #[test]
    fn a_spacing_that_cannot_fit_is_refused_with_the_length() {
        let mut scene = dam(0.05);
        scene.water[0].max = [0.146, 0.226];
        assert!(matches!(Lattice::new(&scene), Err(SetupError::SpacingDoesNotFit { .. })));
        scene.particle_spacing = 0.3;
        assert!(matches!(Lattice::new(&scene), Err(SetupError::SpacingTooLarge { .. })));
    }
}
