//! The house rules: which way dependencies point, where the libraries behind narrow places are named, and that the
//! page on the case file says what the programs say.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use tidewall_tests::{case_docs, programs, study_docs};

/// Dependencies of the members (also for tests), by member.
fn dependencies() -> Vec<(String, BTreeSet<String>)> {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["metadata", "--no-deps", "--format-version", "1"]).current_dir(programs::workspace());
    let output = cargo.output().expect("cargo can be started");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).expect("cargo writes JSON");
    let name = |value: &serde_json::Value| value["name"].as_str().expect("all have names").to_owned();
    let packages = metadata["packages"].as_array().expect("a workspace has members").iter();
    let names = |package| {
        let package: &serde_json::Value = package;
        let dependencies = package["dependencies"].as_array().expect("a list, if empty");
        (name(package), dependencies.iter().map(name).collect())
    };
    packages.map(names).collect()
}

/// The Rust files of the workspace's members, relative to its root.
fn sources() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders: Vec<PathBuf> =
        ["protocol", "fluid-isph", "solid-fem", "coupler", "launcher", "tests"].map(PathBuf::from).to_vec();
    while let Some(folder) = folders.pop() {
        let entries = fs::read_dir(programs::workspace().join(&folder)).expect("members are folders");
        for entry in entries.flatten() {
            let path = folder.join(entry.file_name());
            match entry.file_type().expect("files have types").is_dir() {
                true => folders.push(path),
                false if path.extension().is_some_and(|extension| extension == "rs") => found.push(path),
                false => {}
            }
        }
    }
    found.sort();
    found
}

/// Files in whose code, comments and texts left aside, this word stands.
fn files_with(word: &str) -> Vec<PathBuf> {
    let has_word = |line: &str| {
        let code = line.split("//").next().unwrap_or_default();
        let code: String = code.split('"').step_by(2).collect();
        code.split(|c: char| !c.is_alphanumeric() && c != '_').any(|found| found == word)
    };
    let named = |path: &PathBuf| {
        let text = fs::read_to_string(programs::workspace().join(path)).expect("sources are text");
        text.lines().any(has_word)
    };
    sources().into_iter().filter(named).collect()
}

#[test]
fn dependencies_point_one_way() {
    let members = dependencies();
    let names: BTreeSet<_> = members.iter().map(|(name, _)| name.clone()).collect();
    let expected = ["protocol", "fluid-isph", "solid-fem", "coupler", "launcher", "tidewall-tests"];
    assert_eq!(names, expected.map(str::to_owned).into());
    for (name, dependencies) in &members {
        let inside: Vec<_> = dependencies.intersection(&names).map(String::as_str).collect();
        let allowed: &[&str] = match name.as_str() {
            "protocol" => &[],
            "tidewall-tests" => &["coupler", "fluid-isph", "launcher", "protocol", "solid-fem"],
            _ => &["protocol"],
        };
        assert_eq!(inside, allowed, "of {name}");
    }
}

#[test]
fn libraries_behind_narrow_places_are_named_there_only() {
    for (library, member) in [("iceoryx2", "protocol"), ("faer", "solid-fem")] {
        for (name, dependencies) in dependencies() {
            assert_eq!(dependencies.contains(library), name == member, "{library} in {name}");
        }
    }
    let transport = files_with("iceoryx2");
    assert!(!transport.is_empty() && transport.iter().all(|path| path.starts_with("protocol/src")));
    assert_eq!(files_with("faer"), [Path::new("solid-fem/src/linear/cholesky.rs")]);
}

#[test]
fn unsafe_stands_in_the_channel_file_only() {
    assert_eq!(files_with("unsafe"), [Path::new("protocol/src/ipc.rs")]);
    for member in ["protocol", "fluid-isph", "solid-fem", "coupler", "launcher", "tests"] {
        let path = programs::workspace().join(member).join("Cargo.toml");
        let manifest: toml::Table = fs::read_to_string(path).unwrap().parse().unwrap();
        assert_eq!(manifest["lints"]["workspace"].as_bool(), Some(true), "lints of {member}");
    }
}

#[test]
fn the_pages_on_files_say_what_the_programs_say() {
    for (name, page) in [("case-file.md", case_docs::page()), ("study-file.md", study_docs::page())] {
        let path = programs::workspace().join("docs").join(name);
        if std::env::var_os("TIDEWALL_WRITE_DOCS").is_some() {
            fs::write(&path, &page).unwrap();
        }
        let written = fs::read_to_string(&path).unwrap_or_default();
        let differs = written.lines().zip(page.lines()).find(|(written, made)| written != made);
        let hint = "write it again with TIDEWALL_WRITE_DOCS=1; first difference";
        assert!(written == page, "docs/{name}: {hint}: {differs:?}");
    }
}

#[test]
fn every_key_of_the_cases_is_documented() {
    let (case_page, study_page) = (case_docs::page(), study_docs::page());
    let mut folders = vec![programs::workspace().join("cases")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap().flatten() {
            let path = entry.path();
            match path.extension().and_then(|extension| extension.to_str()) {
                _ if path.is_dir() => folders.push(path),
                Some("toml") => {
                    let case: toml::Table = fs::read_to_string(&path).unwrap().parse().unwrap();
                    let is_study = path.parent().is_some_and(|folder| folder.ends_with("studies"));
                    let page = if is_study { &study_page } else { &case_page };
                    for (section, value) in case.iter().filter(|(key, _)| *key != "base") {
                        assert_documented(page, section, value, &path);
                    }
                }
                _ => {}
            }
        }
    }
}

fn assert_documented(page: &str, section: &str, value: &toml::Value, path: &Path) {
    let (heading, tables) = match value {
        toml::Value::Table(table) => (format!("## `[{section}]`"), vec![table]),
        toml::Value::Array(items) => {
            (format!("## `[[{section}]]`"), items.iter().filter_map(toml::Value::as_table).collect())
        }
        _ => panic!("{section} in {} is no section", path.display()),
    };
    let rows = page.split_once(&heading).map(|(_, rest)| rest.split("\n## ").next().unwrap_or_default());
    let rows = rows.unwrap_or_else(|| panic!("{heading} is not on the page"));
    // Another program in the place of a side documents its own keys.
    let own = |table: &&toml::Table| !(section == "fluid" && table.contains_key("program"));
    for (key, value) in tables.into_iter().filter(own).flatten() {
        let is_list = value
            .as_array()
            .is_some_and(|items| !items.is_empty() && items.iter().all(toml::Value::is_table));
        match value.is_table() || is_list {
            true => assert_documented(page, &format!("{section}.{key}"), value, path),
            false => assert!(rows.contains(&format!("| `{key}` |")), "{section}.{key} of {}", path.display()),
        }
    }
}
