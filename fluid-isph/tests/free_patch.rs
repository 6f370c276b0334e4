//! Water in empty space: what no outer force can change.

#![expect(clippy::unwrap_used, reason = "a failing helper must fail the test")]

use fluid_isph::Fluid;
use fluid_isph::flow::Flow;
use fluid_isph::scene::{Scene, Tank, WaterBox};

fn turning_square(suction: bool) -> Fluid<2> {
    let tank = Tank { min: [-0.5; 2], max: [0.5; 2], open: [[true; 2]; 2] };
    let water = WaterBox { min: [-0.1; 2], max: [0.1; 2], velocity: [0.2, 0.1] };
    let mut scene = Scene::new(tank, vec![water], 0.01);
    scene.gravity.vector = [0.0; 2];
    scene.flow = Some(Flow::Rotation { centre: [0.0; 2], rate: 5.0 });
    scene.suction = suction;
    Fluid::new(scene, None).unwrap()
}

/// Pair forces are equal and central, with and without suction: momentum is kept to round-off, its moment to what the
/// direction of a pair is rounded to (places are whole parts of an edge, a millionth of a spacing).
#[test]
fn a_turning_square_keeps_its_momenta() {
    for suction in [false, true] {
        let mut fluid = turning_square(suction);
        let (before, turning) = (fluid.momentum(), fluid.angular_momentum(&[0.0; 2])[2]);
        for _ in 0..200 {
            fluid.advance(1e-3, None).unwrap();
        }
        let after = fluid.momentum();
        for k in 0..2 {
            assert!((after[k] - before[k]).abs() < 1e-11 * 40.0, "{before:?} -> {after:?}");
        }
        let now = fluid.angular_momentum(&[0.0; 2])[2];
        assert!((now / turning - 1.0).abs() < 1e-7, "{turning} -> {now}");
        // 1 rad: 40 kg/m at (0.2, 0.1) m/s for 0.2 s.
        let centre = fluid.centre();
        assert!((centre[0] - 0.04).abs() < 1e-9 && (centre[1] - 0.02).abs() < 1e-9, "{centre:?}");
        let lowest = fluid.water().pressure.iter().fold(0.0, |least: f32, &p| least.min(p));
        assert_eq!(lowest < -50.0, suction, "{lowest} Pa");
    }
}
