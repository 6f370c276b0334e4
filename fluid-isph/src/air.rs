//! How far above the outermost particles the air begins, and which water is a film.
//!
//! Missing neighbours are air at P = 0 (`assembly.rs`). With P = 0 at d spacings from a particle and the pressure linear in
//! between, a neighbour one spacing away has (1 - 1/d) P_i, so its share of the diagonal counts 1/d times: once where the air
//! is as far away as particles of air would stand, twice where P = 0 lies on the surface itself, at half a spacing.
//! A whole spacing lifts the outermost row by 0.07 spacings, which deep water does not notice and a film does; nearer air keeps a
//! film down and lets the surface of deep water become uneven in the long run (`docs/fluid-tried.md`).

use crate::scene::{Scene, WaterBox};

/// Distance of the air from deep water, in spacings.
pub const DEEP: f64 = 1.0;

/// Distance on the surface itself, in spacings: for a single row, and for films in space.
pub const SURFACE: f64 = 0.5;

/// Distance for films of two and three rows in the plane, in spacings: at 0.5 their waves grow.
pub const FILM: f64 = 0.6;

/// Most rows of a film: from four on, the rise of the outermost row is 1 % of the energy and less.
pub const FILM_ROWS: usize = 3;

/// A film is at least this many times as wide as deep, so that a drop is none.
const FILM_WIDTH: f64 = 2.0;

/// Distance of the air for the water a scene starts with, in spacings.
pub fn natural_distance<const D: usize>(scene: &Scene<D>) -> f64 {
    match film_rows(scene) {
        None => DEEP,
        Some(1) => SURFACE,
        Some(_) if D == 3 => SURFACE,
        Some(_) => FILM,
    }
}

/// Rows of particles in the deepest place of a film; `None` for any other water.
///
/// Boxes above one another are one column; where they stand beside each other above a third, their depths are added too.
pub fn film_rows<const D: usize>(scene: &Scene<D>) -> Option<usize> {
    let g = &scene.gravity.vector;
    let down = (0..D).max_by(|&a, &b| g[a].abs().total_cmp(&g[b].abs())).filter(|&k| g[k] != 0.0)?;
    let across = || (0..D).filter(move |&k| k != down);
    let mut deepest = 0;
    for water in &scene.water {
        let side = |k: usize| water.max[k] - water.min[k];
        if across().all(|k| side(k) < FILM_WIDTH * side(down)) {
            return None;
        }
        let shares_columns = |other: &&WaterBox<D>| {
            across().all(|k| water.min[k] < other.max[k] && other.min[k] < water.max[k])
        };
        let column = scene.water.iter().filter(shares_columns);
        let rows =
            column.map(|one| ((one.max[down] - one.min[down]) / scene.particle_spacing).round().max(1.0));
        deepest = deepest.max(rows.sum::<f64>() as usize);
    }
    (1..=FILM_ROWS).contains(&deepest).then_some(deepest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Tank;

    fn pool(boxes: &[([f64; 2], [f64; 2])]) -> Scene<2> {
        let tank = Tank { min: [0.0; 2], max: [1.0; 2], open: [[false; 2], [false, true]] };
        let water = boxes.iter().map(|&(min, max)| WaterBox { min, max, velocity: [0.0; 2] });
        Scene::new(tank, water.collect(), 0.01)
    }

    #[test]
    fn only_shallow_and_wide_water_is_a_film() {
        let low = ([0.0, 0.0], [0.4, 0.02]);
        for (boxes, rows) in [
            (vec![([0.0, 0.0], [1.0, 0.01])], Some(1)),
            (vec![low], Some(2)),
            (vec![([0.0, 0.0], [1.0, 0.03])], Some(3)),
            (vec![([0.0, 0.0], [1.0, 0.04])], None),
            // A drop; a pool beside the film; one film on another; two beside each other.
            (vec![([0.5, 0.5], [0.51, 0.51])], None),
            (vec![low, ([0.4, 0.0], [1.0, 0.2])], None),
            (vec![low, ([0.2, 0.02], [0.8, 0.04])], None),
            (vec![low, ([0.4, 0.0], [1.0, 0.03])], Some(3)),
        ] {
            assert_eq!(film_rows(&pool(&boxes)), rows, "{boxes:?}");
        }
    }

    #[test]
    fn depth_is_along_gravity_and_deep_water_has_factor_one() {
        let mut scene = pool(&[([0.0, 0.0], [0.02, 0.4])]);
        assert_eq!(1.0 / natural_distance(&scene), 1.0);
        scene.gravity.vector = [9.7, -1.0];
        assert_eq!((film_rows(&scene), natural_distance(&scene)), (Some(2), FILM));
        scene.gravity.vector = [0.0; 2];
        assert_eq!(film_rows(&scene), None, "without weight nothing lies");
    }
}
