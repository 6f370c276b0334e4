//! The case reader finds every mistake at once and says where, what, and what to do.

use protocol::case::{CaseFile, Place, Shared};

const GOOD: &str = r#"
[case]
name = "demo"
dimension = 2
[domain]
min = [0.0, 0.0]
max = [0.6, 1.0]
open = ["top"]
[gravity]
acceleration = [0.0, -9.81]
table = [[0.0, 0.0], [0.1, 1.0]]
[fluid]
spacing = 0.01
[[fluid.region]]
min = [0.0, 0.0]
max = [0.1, 0.2]
[solid]
min = [0.3, 0.0]
max = [0.31, 0.1]
[time]
end = 1.0
max_dt = 1e-3
[[gauge]]
name = "tip"
kind = "displacement"
point = [0.3, 0.1]
"#;

fn messages(text: &str, options: &[&str]) -> Vec<String> {
    let options: Vec<_> = options.iter().map(|&option| option.to_owned()).collect();
    let case = CaseFile::parse("demo.toml", text, &options);
    Shared::read(&case);
    case.diagnostics().iter().map(ToString::to_string).collect()
}

#[test]
fn a_good_case_gives_its_values() {
    let case = CaseFile::parse("demo.toml", GOOD, &[]);
    let shared = Shared::read(&case);
    assert_eq!(case.diagnostics(), []);
    let gravity = shared.gravity.unwrap();
    assert_eq!(gravity.factor(0.05), 0.5);
    assert_eq!(gravity.factor(7.0), 1.0);
    let wet: Vec<_> = shared.solid.unwrap().wet.iter().map(|face| face.name()).collect();
    assert_eq!(wet, ["left", "right", "top"], "the face on the floor of the tank is not wet");
}

#[test]
fn five_mistakes_are_found_at_once_each_with_its_line() {
    let text = GOOD
        .replace("dimension = 2", "dimension = 4")
        .replace("open = [\"top\"]", "open = [\"tpo\"]")
        .replace("end = 1.0", "end = -1.0\nmaxdt = 3")
        .replace("kind = \"displacement\"", "kind = \"displacment\"");
    let messages = messages(&text, &[]);
    assert_eq!(messages.len(), 5, "{messages:#?}");
    assert!(
        messages[0].starts_with("line 4: case.dimension: 4 is not allowed (allowed: whole number >= 2 <= 3)")
    );
    assert!(messages[1].starts_with("line 8: domain.open"), "{}", messages[1]);
    assert!(messages[2].contains("time.end: -1.0 is not allowed (allowed: number > 0 in s)"));
    assert!(
        messages[3].contains("time.maxdt: unknown key") && messages[3].contains("Did you mean \"max_dt\"?")
    );
    assert!(messages[4].contains("gauge[0].kind") && messages[4].contains("Did you mean \"displacement\"?"));
}

#[test]
fn an_option_overrides_the_file_and_is_named_when_wrong() {
    assert_eq!(messages(GOOD, &["time.end=2.5", "gauge[0].name=corner"]), Vec::<String>::new());
    let case = CaseFile::parse("demo.toml", GOOD, &["time.end=2.5".to_owned()]);
    assert_eq!(Shared::read(&case).time.end, 2.5);
    let wrong = messages(GOOD, &["time.end=zero", "nonsense"]);
    assert!(wrong.iter().any(|message| message.starts_with("--set time.end=zero: time.end")), "{wrong:#?}");
    assert!(wrong.iter().any(|message| message.contains("no '=' in the option")), "{wrong:#?}");
}

#[test]
fn a_syntax_error_is_reported_with_its_line() {
    let case = CaseFile::parse("demo.toml", "[case]\nname = \n", &[]);
    assert!(matches!(case.diagnostics()[0].place, Place::File { line: 2, .. }), "{:?}", case.diagnostics());
}

#[test]
fn the_resolved_case_reads_back_as_the_same_scene() {
    let case = CaseFile::parse("demo.toml", GOOD, &[]);
    let shared = Shared::read(&case);
    let text = toml::to_string(&case.resolved()).unwrap();
    let again = CaseFile::parse("lock.toml", &text, &[]);
    assert_eq!(Shared::read(&again), shared);
    assert_eq!(again.diagnostics(), []);
}

/// A case on a base: keys override one by one, lists whole, files are found beside the base, mistakes are told with the
/// file they stand in, and the base's references stay with it.
#[test]
fn a_case_can_stand_on_another() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, text).unwrap();
        path
    };
    let reference = "[[reference]]\ngauge = \"gone\"\n";
    let good = GOOD.replace("[solid]", "[solid]\nmesh = \"body.inp\"");
    write("base/good.toml", &format!("{good}{reference}"));
    let path = write(
        "on/case.toml",
        "base = \"../base/good.toml\"\n[fluid]\nspacing = 0.02\n[[gauge]]\nname = \"front\"\nkind = \"front\"\n",
    );
    let case = CaseFile::load(&path, &["time.end=2.0".to_owned()]).unwrap();
    let shared = Shared::read(&case);
    assert_eq!(case.diagnostics(), []);
    assert_eq!((shared.header.name.as_str(), shared.time.end, shared.time.max_dt), ("demo", 2.0, 1e-3));
    assert_eq!(case.section("fluid").unwrap().number("spacing").required(), 0.02);
    assert_eq!(shared.gauges.iter().map(|gauge| gauge.name.as_str()).collect::<Vec<_>>(), ["front"]);
    assert_eq!(shared.solid.unwrap().mesh.as_deref(), Some("../base/body.inp"));

    write("base/bad.toml", &GOOD.replace("end = 1.0", "end = -1.0"));
    let on = |base: &str| {
        let path = write("on/bad.toml", &format!("base = {base}\n"));
        let case = CaseFile::load(&path, &[]).unwrap();
        Shared::read(&case);
        case.diagnostics().iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    let found = on("\"../base/bad.toml\"");
    assert!(found.len() == 1 && found[0].starts_with("../base/bad.toml, line 21: time.end"), "{found:?}");
    assert!(on("\"../base/none.toml\"").iter().any(|found| found.contains("cannot read")));
    assert!(on("3").iter().any(|found| found.contains("3 is not allowed")));
    assert!(on("\"case.toml\"").iter().any(|found| found.contains("has a base too")));
}
