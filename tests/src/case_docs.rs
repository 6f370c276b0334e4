//! `docs/case-file.md`, made from what the programs say about the keys they ask for.
//!
//! Keys are documented where they are read, so cases are needed in which each one is asked for; `ELASTIC` and `RIGID` together
//! ask for all. What differs between 2-D and 3-D is shown for both.

use launcher::check;
use launcher::stress::promise::Promise;
use protocol::case::{CaseFile, CheckReport, KeyDoc, SECTIONS, Shared};

const HEAD: &str = "\
# The case file

One TOML file describes a scene, in SI units. `tidewall check CASE` finds everything that is wrong with it at once and
prints the plan; `--set section.key=value` overrides a key, `--set section.key=` takes it out. An unknown key is a mistake, never
ignored.

A section that is absent takes its physics out of the run: without `[fluid]` no water is computed, without `[solid]`
there is no obstacle, without `[gravity]` no weight. `[case]` and `[time]` are always needed, `[domain]` with `[fluid]`.
In 2-D (plane strain) forces, masses and energies are per metre of depth. `y` points up, `z` along the depth.

Default `required` means that the key must be there, `absent` that without it the thing it describes is left out.
The resolved case, every default filled in, is `case.lock.toml` in the run folder.

A case may stand on another one: `base = \"FILE\"` in its first line, relative to the case. Its own keys then override those
of the base one by one, its lists (`[[...]]`) replace the base's whole; `[[reference]]` and `[stress]` are never taken from a
base.

This page is generated from the programs (`TIDEWALL_WRITE_DOCS=1 cargo test -p tidewall-tests --test house`); a test
compares it with them.
";

/// A case that asks for every key of its dimension, but for those that exclude each other.
const ELASTIC: &str = r#"
[case]
name = "all-keys"
dimension = DIMENSION
[domain]
min = LOW
max = HIGH
[gravity]
acceleration = LOW
[fluid]
spacing = 0.1
[[domain.opening]]
face = "left"
min = LOW
max = HIGH
[domain.motion]
amplitude = LOW
frequency = 1.0
[[obstacle]]
min = LOW
max = HIGH
[obstacle.motion]
amplitude = LOW
frequency = 1.0
[[fluid.region]]
min = LOW
max = MIDDLE
[fluid.flow]
kind = "rotation"
rate = 1.0
[fluid.weakly_compressible]
sound_speed = 10.0
[solid]
min = MIDDLE
max = HIGH
clamped = ["bottom"]
density = 1000.0
young_modulus = 1e6
[[solid.load]]
face = "left"
pressure = 1.0
[[solid.support]]
face = "top"
[coupling]
scheme = "css"
on_guard = "escalate"
[time]
end = 1.0
max_dt = 1.0
[[gauge]]
name = "a"
kind = "displacement"
point = MIDDLE
[[gauge]]
name = "b"
kind = "front"
[[gauge]]
name = "c"
kind = "force"
on = "bottom"
[[gauge]]
name = "d"
kind = "energy"
[[gauge]]
name = "e"
kind = "pressure"
point = MIDDLE
[[reference]]
gauge = "a"
column = "ux_m"
label = "nothing"
norm = "final"
value = 1.0
"#;

const RIGID: &str = r#"
[case]
name = "all-keys-of-the-stub"
dimension = DIMENSION
[solid]
model = "rigid"
min = LOW
max = HIGH
[solid.motion]
kind = "sine"
amplitude = LOW
frequency = 1.0
[time]
end = 1.0
max_dt = 1.0
"#;

const CHECKS: [fn(&CaseFile) -> CheckReport; 3] =
    [fluid_isph::case::check, solid_fem::case::check, coupler::case::check];

/// The page.
pub fn page() -> String {
    HEAD.to_owned() + &tables(&keys(2), &keys(3), &SECTIONS)
}

/// A heading and a table for every section, in the order given; `plane` and `space` are the keys in 2-D and in 3-D.
pub(crate) fn tables(plane: &[KeyDoc], space: &[KeyDoc], sections: &[&str]) -> String {
    let mut page = String::new();
    let mut headings: Vec<String> = Vec::new();
    for key in plane {
        let heading = heading(&key.path);
        if !headings.contains(&heading) {
            headings.push(heading);
        }
    }
    let place = |heading: &String| {
        let section = heading.trim_matches(['[', ']']).split('.').next().unwrap_or_default().to_owned();
        sections.iter().position(|&known| known == section)
    };
    headings.sort_by_key(place);
    for wanted in headings {
        page.push_str(&format!("\n## `{wanted}`\n\n"));
        page.push_str("| key | kind | unit | allowed | default | meaning |\n|---|---|---|---|---|---|\n");
        for key in plane.iter().filter(|key| heading(&key.path) == wanted) {
            let twin = space.iter().find(|other| other.path == key.path).unwrap_or(key);
            page.push_str(&row(key, twin));
        }
    }
    page
}

/// The keys all programs ask for in a dimension, each once.
fn keys(dimension: usize) -> Vec<KeyDoc> {
    let mut keys: Vec<KeyDoc> = Vec::new();
    let elastic = filled(ELASTIC, dimension);
    let reports = CHECKS.iter().map(|check| check(&CaseFile::parse("elastic.toml", &elastic, &[])));
    let rigid = solid_fem::rigid::check(&CaseFile::parse("rigid.toml", &filled(RIGID, dimension), &[]));
    let promising = CaseFile::parse("stress.toml", "[stress]", &[]);
    let _ = Promise::read(&promising);
    let promise = CheckReport::new("tidewall", &promising, Vec::new(), Vec::new());
    let scene = CaseFile::parse("elastic.toml", &elastic, &[]);
    let _ = check::programs(&scene, &Shared::read(&scene), scene.path());
    let launcher = CheckReport::new("tidewall", &scene, Vec::new(), Vec::new());
    for key in reports.chain([rigid, promise, launcher]).flat_map(|report| report.keys) {
        match keys.iter_mut().find(|known| known.path == key.path) {
            // As in a report: the strictest asking documents a key.
            Some(known) if key.default == "required" && known.default != "required" => *known = key,
            Some(_) => {}
            None => keys.push(key),
        }
    }
    keys
}

fn filled(case: &str, dimension: usize) -> String {
    let point = |value: f64| format!("{:?}", vec![value; dimension]);
    case.replace("DIMENSION", &dimension.to_string())
        .replace("LOW", &point(0.0))
        .replace("MIDDLE", &point(1.0))
        .replace("HIGH", &point(2.0))
}

/// The section of a key as it is written in a case: `[fluid]`, `[solid.motion]`, `[[gauge]]`, `[[fluid.region]]`.
fn heading(path: &str) -> String {
    let (section, _) = path.rsplit_once('.').unwrap_or((path, ""));
    match section.strip_suffix("[]") {
        Some(list) => format!("[[{list}]]"),
        None => format!("[{}]", section.replace("[]", "")),
    }
}

fn row(plane: &KeyDoc, space: &KeyDoc) -> String {
    let key = plane.path.rsplit('.').next().unwrap_or_default();
    let allowed = both(&plane.allowed, &space.allowed);
    // A default that depends on other keys is told in words.
    let is_told = plane.about.to_lowercase().contains("default");
    let default = if is_told { "see meaning".to_owned() } else { both(&plane.default, &space.default) };
    let (kind, unit, about) = (cell(&plane.kind), cell(&plane.unit), cell(&plane.about));
    format!("| `{key}` | {kind} | {unit} | {allowed} | {default} | {about} |\n")
}

/// What holds in 2-D and in 3-D.
fn both(plane: &str, space: &str) -> String {
    match space.strip_prefix(plane) {
        Some("") => cell(plane),
        Some(more) => format!("{}; in 3-D also {}", cell(plane), cell(more.trim_start_matches(" | "))),
        None => format!("2-D: {}; 3-D: {}", cell(plane), cell(space)),
    }
}

fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}
