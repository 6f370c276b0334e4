//! A case file as read: its tree, the mistakes found so far, the keys asked for and the values resolved.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use super::base;
use super::diagnostic::{Diagnostic, Place};
use super::key::KeyDoc;
use super::section::Section;
use super::tree::{self, Table, Value};

/// One step of the way to a resolved value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Part {
    Key(String),
    Item(String, usize),
}

/// What reading gathers beside the values.
#[derive(Debug, Default)]
pub(crate) struct Gathered {
    pub(crate) diagnostics: Vec<Diagnostic>,
    pub(crate) keys: Vec<KeyDoc>,
    pub(crate) resolved: Vec<(Vec<Part>, toml::Value)>,
    pub(crate) sections: Vec<String>,
}

/// A case file, read once; sections are taken from it by name.
#[derive(Debug)]
pub struct CaseFile {
    path: PathBuf,
    text: String,
    table: Table,
    gathered: RefCell<Gathered>,
}

impl CaseFile {
    /// Reads a case file and lays the `--set key.path=value` options over it.
    ///
    /// # Errors
    /// The file cannot be read. Mistakes in it are no error here: see [`CaseFile::diagnostics`].
    pub fn load(path: &Path, options: &[String]) -> std::io::Result<Self> {
        let text = std::fs::read_to_string(path)?;
        let (mut table, mut diagnostics) = tree::parse_file(&text);
        if let Some(named) = table.0.remove("base") {
            diagnostics.extend(base::lay_under(&mut table, &named, path));
        }
        Ok(Self::assemble(path, text, (table, diagnostics), options))
    }

    /// Takes the text of a case file without a base; `path` only names it.
    pub fn parse(path: impl AsRef<Path>, text: &str, options: &[String]) -> Self {
        Self::assemble(path.as_ref(), text.to_owned(), tree::parse_file(text), options)
    }

    fn assemble(
        path: &Path,
        text: String,
        (mut table, mut diagnostics): (Table, Vec<Diagnostic>),
        options: &[String],
    ) -> Self {
        for option in options {
            if let Err(diagnostic) = tree::overlay(&mut table, option) {
                diagnostics.push(diagnostic);
            }
        }
        let gathered = RefCell::new(Gathered { diagnostics, ..Gathered::default() });
        Self { path: path.to_owned(), text, table, gathered }
    }

    /// The file's path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file's text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The section `[name]`, if the file has it.
    pub fn section(&self, name: &str) -> Option<Section<'_>> {
        let node = self.table.0.get(name)?;
        self.gathered.borrow_mut().sections.push(name.to_owned());
        match &node.value {
            Value::Table(table) => {
                let at = vec![Part::Key(name.to_owned())];
                Some(Section::new(Some(table), node.place.clone(), at, &self.gathered))
            }
            _ => {
                self.complain(Diagnostic {
                    place: node.place.clone(),
                    key: name.to_owned(),
                    message: format!("{} where a section is expected", node.value.shown()),
                    allowed: format!("[{name}] and its keys"),
                    hint: String::new(),
                });
                None
            }
        }
    }

    /// The section `[name]`, or an empty one that gives defaults and misses what is required.
    pub fn section_or_default(&self, name: &str) -> Section<'_> {
        self.section(name).unwrap_or_else(|| {
            Section::new(None, Place::Scene, vec![Part::Key(name.to_owned())], &self.gathered)
        })
    }

    /// The entries of the list `[[name]]`; empty if there are none.
    pub fn list(&self, name: &str) -> Vec<Section<'_>> {
        self.gathered.borrow_mut().sections.push(name.to_owned());
        Section::items(&self.table, name, &[], &self.gathered)
    }

    /// Complains about every section that is not among `known`.
    pub fn refuse_unknown_sections(&self, known: &[&str]) {
        for (name, node) in &self.table.0 {
            if !known.contains(&name.as_str()) {
                self.complain(Diagnostic {
                    place: node.place.clone(),
                    key: name.clone(),
                    message: "unknown section".to_owned(),
                    allowed: known.join(", "),
                    hint: super::key::nearest(name, known.iter().copied()),
                });
            }
        }
    }

    /// Books a mistake found by a check across keys.
    pub fn complain(&self, diagnostic: Diagnostic) {
        self.gathered.borrow_mut().diagnostics.push(diagnostic);
    }

    /// All mistakes found so far, in the order of the file, each once.
    pub fn diagnostics(&self) -> Vec<Diagnostic> {
        let mut diagnostics = self.gathered.borrow().diagnostics.clone();
        diagnostics.sort();
        diagnostics.dedup();
        diagnostics
    }

    /// The documentation of every key asked for so far, in the order of asking, each once.
    pub fn keys(&self) -> Vec<KeyDoc> {
        let mut keys: Vec<KeyDoc> = Vec::new();
        for key in &self.gathered.borrow().keys {
            // A key may be asked for by several programs; the strictest asking documents it.
            match keys.iter_mut().find(|known| known.path == key.path) {
                Some(known) if key.default == "required" => *known = key.clone(),
                Some(_) => {}
                None => keys.push(key.clone()),
            }
        }
        keys
    }

    /// Every value read so far with defaults filled in: what `case.lock.toml` holds.
    pub fn resolved(&self) -> toml::Table {
        let mut root = toml::Table::new();
        for (path, value) in &self.gathered.borrow().resolved {
            insert(&mut root, path, value.clone());
        }
        root
    }
}

fn insert(table: &mut toml::Table, path: &[Part], value: toml::Value) {
    match path {
        [] => {}
        [Part::Key(key)] => {
            table.insert(key.clone(), value);
        }
        [Part::Item(..)] => {}
        [Part::Key(key), rest @ ..] => {
            let entry = table.entry(key.clone()).or_insert_with(|| toml::Table::new().into());
            if let toml::Value::Table(inner) = entry {
                insert(inner, rest, value);
            }
        }
        [Part::Item(key, index), rest @ ..] => {
            let entry = table.entry(key.clone()).or_insert_with(|| toml::Value::Array(Vec::new()));
            if let toml::Value::Array(items) = entry {
                while items.len() <= *index {
                    items.push(toml::Table::new().into());
                }
                if let toml::Value::Table(inner) = &mut items[*index] {
                    insert(inner, rest, value);
                }
            }
        }
    }
}
