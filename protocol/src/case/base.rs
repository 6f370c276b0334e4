//! `base = "FILE"`: a case that differs from another one in a few keys.
//!
//! Sections are merged key by key, lists replaced whole. What a base is judged by (`[[reference]]`, `[stress]`) holds for
//! its own scene and is not taken. A base has no base of its own.

use std::path::Path;

use super::diagnostic::{Diagnostic, Place};
use super::tree::{self, Node, Table, Value};

/// Sections that are not taken from a base.
const OWN: [&str; 2] = ["reference", "stress"];

/// Keys that name files relative to the case, by section.
const FILES: [(&str, &str); 4] =
    [("fluid", "program"), ("solid", "mesh"), ("solid", "program"), ("obstacle", "file")];

/// Lays the base a case names under it; gives the mistakes found on the way.
pub(super) fn lay_under(case: &mut Table, named: &Node, path: &Path) -> Vec<Diagnostic> {
    let refuse = |message: String, hint: &str| {
        vec![Diagnostic {
            place: named.place.clone(),
            key: "base".to_owned(),
            message,
            allowed: "a case file, relative to this one".to_owned(),
            hint: hint.to_owned(),
        }]
    };
    let Value::Text(file) = &named.value else {
        return refuse(format!("{} is not allowed", named.value.shown()), "");
    };
    let found = path.parent().unwrap_or(Path::new(".")).join(file);
    let text = match std::fs::read_to_string(&found) {
        Ok(text) => text,
        Err(error) => return refuse(format!("cannot read {}: {error}", found.display()), ""),
    };
    let (mut base, diagnostics) = tree::parse(&text, &|place| match place {
        Place::File { line, .. } => Place::Base { file: file.clone(), line },
        other => other,
    });
    if base.0.contains_key("base") {
        return refuse(format!("{file} has a base too"), "Name the base of the base.");
    }
    OWN.iter().for_each(|section| drop(base.0.remove(*section)));
    let folder = Path::new(file).parent().unwrap_or(Path::new("."));
    for (section, key) in FILES {
        for table in tables(&mut base, section) {
            if let Some(Node { value: Value::Text(file), .. }) = table.0.get_mut(key) {
                *file = folder.join(&*file).to_string_lossy().into_owned();
            }
        }
    }
    merge(case, base);
    diagnostics
}

/// The section of this name, or the entries of the list.
fn tables<'t>(case: &'t mut Table, section: &str) -> Vec<&'t mut Table> {
    let table = |node: &'t mut Node| match &mut node.value {
        Value::Table(table) => Some(table),
        _ => None,
    };
    match case.0.get_mut(section) {
        Some(Node { value: Value::Array(items), .. }) => items.iter_mut().filter_map(table).collect(),
        Some(node) => table(node).into_iter().collect(),
        None => Vec::new(),
    }
}

fn merge(over: &mut Table, under: Table) {
    for (key, node) in under.0 {
        match (over.0.get_mut(&key).map(|node| &mut node.value), node.value) {
            (Some(Value::Table(over)), Value::Table(under)) => merge(over, under),
            (Some(_), _) => {}
            (None, value) => drop(over.0.insert(key, Node { value, place: node.place })),
        }
    }
}
