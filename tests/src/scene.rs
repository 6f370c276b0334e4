//! Small scenes: a dam break at 12 mm spacing against a soft obstacle two spacings thick, and parts of it.

use std::path::Path;

/// What every scene has.
const HEAD: &str = r#"
[case]
name = "small-dam"
dimension = 2

[gravity]
acceleration = [0.0, -9.81]

[time]
end = 0.06
max_dt = 5e-4

[output]
fields_every = 0.01
"#;

const WATER: &str = r#"
[domain]
min = [0.0, 0.0]
max = [0.3, 0.24]
open = ["top"]

[fluid]
density = 1000.0
kinematic_viscosity = 1e-6
spacing = 0.012

[[fluid.region]]
min = [0.0, 0.0]
max = [0.144, 0.144]

[[gauge]]
name = "front"
kind = "front"

[[gauge]]
name = "water_energy"
kind = "energy"
of = "fluid"
"#;

const BODY: &str = r#"
[solid]
min = [0.156, 0.0]
max = [0.18, 0.072]
elements = [1, 6]
clamped = ["bottom"]
density = 2500.0
"#;

const ELASTIC: &str = "young_modulus = 1e5\n";

const SOLID_GAUGES: &str = r#"
[[gauge]]
name = "tip"
kind = "displacement"
point = [0.156, 0.072]

[[gauge]]
name = "reaction"
kind = "reaction"
"#;

const BODY_FORCE: &str = r#"
[[gauge]]
name = "body_force"
kind = "force"
on = "body"
"#;

/// Water against an elastic obstacle.
pub fn coupled() -> String {
    [HEAD, WATER, BODY, ELASTIC, SOLID_GAUGES, BODY_FORCE].concat()
}

/// The same with a solid that does not say what it is made of, for the stub.
pub fn coupled_rigid() -> String {
    [HEAD, WATER, BODY, "model = \"rigid\"\n", SOLID_GAUGES, BODY_FORCE].concat()
}

/// The same with another program in the solid's place.
pub fn coupled_with(program: &Path) -> String {
    let line = format!("model = \"rigid\"\nprogram = {program:?}\n");
    [HEAD, WATER, BODY, &line, SOLID_GAUGES, BODY_FORCE].concat()
}

/// The water alone.
pub fn fluid_only() -> String {
    [HEAD, WATER].concat()
}

/// The obstacle alone under a pressure on its top that grows until nothing balances it.
pub fn solid_crushed() -> String {
    let load = "[[solid.load]]\nkind = \"follower_pressure\"\nface = \"top\"\npressure = 1e6\n\
                table = [[0.0, 0.0], [0.03, 0.0], [0.06, 1.0]]\n";
    [HEAD, BODY, ELASTIC, load, SOLID_GAUGES].concat()
}

/// The obstacle alone, swinging under its weight.
pub fn solid_only() -> String {
    let weight = HEAD.replace("[0.0, -9.81]", "[9.81, 0.0]");
    [&weight, BODY, ELASTIC, SOLID_GAUGES].concat()
}

const PLATE: &str = r#"
[case]
name = "plate"
dimension = 2

[domain]
min = [0.0, -0.25]
max = [1.0, 2.5]
open = ["top", "bottom"]

[gravity]
acceleration = [0.0, -9.81]
table = [[0.0, 0.0], [0.1, 1.0]]

[fluid]
spacing = 0.05

[[fluid.region]]
min = [0.0, 0.0]
max = [1.0, 2.0]

[solid]
min = [0.0, -0.05]
max = [1.0, 0.0]
clamped = ["left", "right"]
wet = ["top"]
elements = [20, 2]
young_modulus = 67.5e9
poisson_ratio = 0.34

[time]
end = 0.06
max_dt = 2e-4

[[gauge]]
name = "middle"
kind = "displacement"
point = [0.5, 0.0]
"#;

/// Two metres of water, whose weight grows from nothing, on a plate of 0.05 m; with a density of 28,000 kg/m3 / r the plate
/// carries r times its own mass in water.
pub fn plate(ratio: f64) -> String {
    PLATE.replace("young_modulus", &format!("density = {:?}\nyoung_modulus", 28_000.0 / ratio))
}
