//! One section of the case file, read key by key.

use std::cell::RefCell;
use std::collections::BTreeSet;

use super::diagnostic::{Diagnostic, Place};
use super::file::{Gathered, Part};
use super::key::{self, KeyDoc, Number, Words};
use super::tree::{Table, Value};

/// What is to be said about a key.
pub(super) struct Doc<'a> {
    pub(super) kind: &'a str,
    pub(super) unit: &'a str,
    pub(super) allowed: &'a str,
    pub(super) default: &'a str,
    pub(super) about: &'a str,
}

/// One section, list entry or inline table of the case file.
pub struct Section<'c> {
    table: Option<&'c Table>,
    place: Place,
    at: Vec<Part>,
    asked: RefCell<BTreeSet<String>>,
    gathered: &'c RefCell<Gathered>,
}

impl<'c> Section<'c> {
    pub(super) fn new(
        table: Option<&'c Table>,
        place: Place,
        at: Vec<Part>,
        gathered: &'c RefCell<Gathered>,
    ) -> Self {
        Self { table, place, at, asked: RefCell::default(), gathered }
    }

    pub(super) fn items(
        table: &'c Table,
        name: &str,
        at: &[Part],
        gathered: &'c RefCell<Gathered>,
    ) -> Vec<Self> {
        let Some(node) = table.0.get(name) else { return Vec::new() };
        let refuse = |place: &Place, shown: String| {
            gathered.borrow_mut().diagnostics.push(Diagnostic {
                place: place.clone(),
                key: name.to_owned(),
                message: format!("{shown} where a list of sections is expected"),
                allowed: format!("[[{name}]] and its keys, once per entry"),
                hint: String::new(),
            });
        };
        let Value::Array(items) = &node.value else {
            refuse(&node.place, node.value.shown());
            return Vec::new();
        };
        let mut sections = Vec::new();
        for (index, item) in items.iter().enumerate() {
            let Value::Table(table) = &item.value else {
                refuse(&item.place, item.value.shown());
                continue;
            };
            let mut path = at.to_vec();
            path.push(Part::Item(name.to_owned(), index));
            sections.push(Section::new(Some(table), item.place.clone(), path, gathered));
        }
        sections
    }

    /// A number.
    pub fn number<'s>(&'s self, key: &'s str) -> Number<'s, 'c> {
        Number::new(self, key, false)
    }

    /// A whole number.
    pub fn integer<'s>(&'s self, key: &'s str) -> Number<'s, 'c> {
        Number::new(self, key, true)
    }

    /// Free text.
    pub fn text<'s>(&'s self, key: &'s str) -> Words<'s, 'c> {
        Words::new(self, key, &[])
    }

    /// One of several words.
    pub fn choice<'s>(&'s self, key: &'s str, choices: &'s [&'s str]) -> Words<'s, 'c> {
        Words::new(self, key, choices)
    }

    /// A flag with a default.
    pub fn flag(&self, key: &str, default: bool, about: &str) -> bool {
        let written = default.to_string();
        self.document(key, Doc { kind: "flag", unit: "", allowed: "true | false", default: &written, about });
        let parse = |value: &Value| match value {
            Value::Flag(flag) => Some(*flag),
            _ => None,
        };
        let flag = self.take(key, "true | false", parse).unwrap_or(default);
        self.record(key, flag.into());
        flag
    }

    /// A list of exactly `count` finite numbers, if the key is there.
    pub fn vector(&self, key: &str, count: usize, unit: &str, about: &str) -> Option<Vec<f64>> {
        let allowed = format!("a list of {count} numbers");
        let documented = "one number per dimension";
        self.document(
            key,
            Doc { kind: "list of numbers", unit, allowed: documented, default: "absent", about },
        );
        let values =
            self.take(key, &allowed, |value| numbers(value).filter(|values| values.len() == count))?;
        self.record(key, values.clone().into());
        Some(values)
    }

    /// Two finite numbers, if the key is there: a window, or bounds.
    pub fn pair(&self, key: &str, unit: &str, about: &str) -> Option<(f64, f64)> {
        let allowed = "two numbers, the greater one last";
        self.document(key, Doc { kind: "two numbers", unit, allowed, default: "absent", about });
        let pair = self.take(key, allowed, |value| {
            numbers(value).filter(|values| values.len() == 2 && values[0] <= values[1])
        })?;
        self.record(key, pair.clone().into());
        Some((pair[0], pair[1]))
    }

    /// A list of exactly `count` numbers; zeros after a complaint.
    pub fn required_vector(&self, key: &str, count: usize, unit: &str, about: &str) -> Vec<f64> {
        if !self.has(key) {
            self.missing(key, &format!("a list of {count} numbers in {unit}"), about);
        }
        let values = self.vector(key, count, unit, about).unwrap_or_else(|| vec![0.0; count]);
        if let Some(doc) = self.gathered.borrow_mut().keys.last_mut() {
            doc.default = "required".to_owned();
        }
        values
    }

    /// A list of rows of `columns` numbers, if the key is there: a table in time, for example.
    pub fn rows(&self, key: &str, columns: usize, unit: &str, about: &str) -> Option<Vec<Vec<f64>>> {
        let allowed = format!("a list of rows of {columns} numbers");
        self.document(key, Doc { kind: "list of rows", unit, allowed: &allowed, default: "absent", about });
        let rows = self.take(key, &allowed, |value| match value {
            Value::Array(items) => items
                .iter()
                .map(|item| numbers(&item.value).filter(|row| row.len() == columns))
                .collect::<Option<Vec<_>>>()
                .filter(|rows| !rows.is_empty()),
            _ => None,
        })?;
        let recorded: Vec<toml::Value> = rows.iter().map(|row| row.clone().into()).collect();
        self.record(key, recorded.into());
        Some(rows)
    }

    /// A list of numbers, words and flags, each as a `--set` option would give it; empty if the key is absent.
    pub fn scalars(&self, key: &str, about: &str) -> Vec<String> {
        let allowed = "a list of numbers, texts or flags";
        self.document(key, Doc { kind: "list of values", unit: "", allowed, default: "absent", about });
        let scalar = |value: &Value| match value {
            Value::Text(text) => Some(text.clone()),
            Value::Array(_) | Value::Table(_) => None,
            other => Some(other.shown()),
        };
        let values = self.take(key, allowed, |value| match value {
            Value::Array(items) => items.iter().map(|item| scalar(&item.value)).collect(),
            _ => None,
        });
        let values: Vec<String> = values.unwrap_or_default();
        self.record(key, values.clone().into());
        values
    }

    /// The entries of a list of sections inside this one, such as `[[fluid.region]]`.
    pub fn list(&self, key: &str) -> Vec<Section<'c>> {
        self.asked.borrow_mut().insert(key.to_owned());
        self.table.map_or_else(Vec::new, |table| Section::items(table, key, &self.at, self.gathered))
    }

    /// A section inside this one, such as `[solid.motion]`, if it is there.
    pub fn inner(&self, key: &str) -> Option<Section<'c>> {
        self.asked.borrow_mut().insert(key.to_owned());
        let node = self.table?.0.get(key)?;
        let mut path = self.at.clone();
        path.push(Part::Key(key.to_owned()));
        match &node.value {
            Value::Table(table) => Some(Section::new(Some(table), node.place.clone(), path, self.gathered)),
            _ => {
                self.complain(key, format!("{} where a section is expected", node.value.shown()), "", "");
                None
            }
        }
    }

    /// What is written at a key that another program asks for, and documents.
    pub(super) fn peek(&self, key: &str) -> Option<&'c Value> {
        self.table?.0.get(key).map(|node| &node.value)
    }

    /// Whether the key is written.
    pub fn has(&self, key: &str) -> bool {
        self.table.is_some_and(|table| table.0.contains_key(key))
    }

    /// Books a mistake about a key of this section (at the section itself if the key is not written).
    pub fn complain(&self, key: &str, message: impl Into<String>, allowed: &str, hint: &str) {
        let node = self.table.and_then(|table| table.0.get(key));
        let place = node.map_or(&self.place, |node| &node.place).clone();
        self.gathered.borrow_mut().diagnostics.push(Diagnostic {
            place,
            key: format!("{}{key}", self.prefix(true)),
            message: message.into(),
            allowed: allowed.to_owned(),
            hint: hint.to_owned(),
        });
    }

    /// Lets keys stand that this program has no use for; gives those that are written.
    pub fn pass_over<'k>(&self, keys: &[&'k str]) -> Vec<&'k str> {
        self.asked.borrow_mut().extend(keys.iter().map(|&key| key.to_owned()));
        keys.iter().copied().filter(|key| self.has(key)).collect()
    }

    /// Complains about every key that nobody asked for. To be called once all keys are read.
    pub fn finish(&self) {
        let Some(table) = self.table else { return };
        let asked = self.asked.borrow();
        for key in table.0.keys().filter(|key| !asked.contains(*key)) {
            let known: Vec<_> = asked.iter().map(String::as_str).collect();
            let hint = key::nearest(key, known.iter().copied());
            self.complain(key, "unknown key", &known.join(", "), &hint);
        }
    }

    pub(super) fn take<T>(
        &self,
        key: &str,
        allowed: &str,
        parse: impl FnOnce(&Value) -> Option<T>,
    ) -> Option<T> {
        self.asked.borrow_mut().insert(key.to_owned());
        let node = self.table?.0.get(key)?;
        let parsed = parse(&node.value);
        if parsed.is_none() {
            let hint = match &node.value {
                Value::Text(word) => key::nearest(word, allowed.split('"')),
                _ => String::new(),
            };
            self.complain(key, format!("{} is not allowed", node.value.shown()), allowed, &hint);
        }
        parsed
    }

    pub(super) fn missing(&self, key: &str, allowed: &str, about: &str) {
        self.complain(key, "is missing", allowed, about);
    }

    pub(super) fn document(&self, key: &str, doc: Doc<'_>) {
        let Doc { kind, unit, allowed, default, about } = doc;
        self.asked.borrow_mut().insert(key.to_owned());
        self.gathered.borrow_mut().keys.push(KeyDoc {
            path: format!("{}{key}", self.prefix(false)),
            kind: kind.to_owned(),
            unit: unit.to_owned(),
            allowed: allowed.to_owned(),
            default: default.to_owned(),
            about: about.to_owned(),
        });
    }

    pub(super) fn record(&self, key: &str, value: toml::Value) {
        let mut path = self.at.clone();
        path.push(Part::Key(key.to_owned()));
        self.gathered.borrow_mut().resolved.push((path, value));
    }

    fn prefix(&self, numbered: bool) -> String {
        let part = |part: &Part| match part {
            Part::Key(key) => format!("{key}."),
            Part::Item(key, index) if numbered => format!("{key}[{index}]."),
            Part::Item(key, _) => format!("{key}[]."),
        };
        self.at.iter().map(part).collect()
    }
}

fn numbers(value: &Value) -> Option<Vec<f64>> {
    let Value::Array(items) = value else { return None };
    let number = |value: &Value| match value {
        Value::Integer(number) => Some(*number as f64),
        Value::Float(number) if number.is_finite() => Some(*number),
        _ => None,
    };
    items.iter().map(|item| number(&item.value)).collect()
}
