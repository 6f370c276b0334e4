//! `[fluid.flow]`: the velocity field the water starts with.

use protocol::case::Section;

use super::point;
use crate::flow::Flow;
use crate::scene::Scene;
use crate::vector::norm;

/// `[fluid.flow]`; `None` after a complaint.
pub(super) fn read_flow<const D: usize>(section: &Section<'_>, scene: &Scene<D>) -> Option<Flow<D>> {
    let kind = section
        .choice("kind", &["rotation", "stretching", "taylor_green", "standing_wave"])
        .about("rotation (-r y, r x) | stretching (-r x, r y) | vortices of Taylor & Green | linear standing wave passing its flat state.")
        .required();
    let centre =
        section.vector("centre", D, "m", "rotation, stretching: centre (default: the middle of [domain]).");
    let rate = section.number("rate").unit("1/s").about("rotation, stretching: r.").optional();
    let speed =
        section.number("speed").unit("m/s").above(0.0).about("taylor_green: largest speed.").optional();
    let length = section.number("length").unit("m").above(0.0);
    let length = length.about("taylor_green: length of one pattern of four vortices.").optional();
    let amplitude = section
        .number("amplitude")
        .unit("m")
        .above(0.0)
        .about("standing_wave: largest elevation.")
        .optional();
    let half_waves = section.integer("half_waves").at_least(1.0);
    let half_waves =
        half_waves.about("standing_wave: half waves in the length of the tank (x).").default(1.0);
    section.finish();
    let tank = &scene.tank;
    let centre = centre
        .map_or_else(|| std::array::from_fn(|k| 0.5 * (tank.min[k] + tank.max[k])), |centre| point(&centre));
    let missing = |key: &str| {
        section.complain(key, "is missing", "a number", &format!("kind = \"{kind}\" needs it."));
        None
    };
    match kind.as_str() {
        "rotation" => rate.map_or_else(|| missing("rate"), |rate| Some(Flow::Rotation { centre, rate })),
        "stretching" => rate.map_or_else(|| missing("rate"), |rate| Some(Flow::Stretching { centre, rate })),
        "taylor_green" => match (speed, length) {
            (Some(speed), Some(length)) => Some(Flow::TaylorGreen { origin: tank.min, speed, length }),
            (None, _) => missing("speed"),
            _ => missing("length"),
        },
        _ => amplitude.map_or_else(
            || missing("amplitude"),
            |amplitude| {
                let top = scene.water.iter().map(|water| water.max[1]).fold(tank.min[1], f64::max);
                Some(Flow::StandingWave {
                    origin: tank.min,
                    amplitude,
                    wave_number: half_waves * std::f64::consts::PI / (tank.max[0] - tank.min[0]),
                    depth: top - tank.min[1],
                    gravity: norm(&scene.gravity.vector),
                })
            },
        ),
    }
}
