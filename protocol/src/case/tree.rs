//! The case as a tree of values that know where they were written.

use std::collections::BTreeMap;

use toml::de::{DeTable, DeValue};

use super::diagnostic::{Diagnostic, Place};

/// A value and its place.
#[derive(Debug, Clone)]
pub(crate) struct Node {
    pub(crate) value: Value,
    pub(crate) place: Place,
}

/// A TOML value; dates are kept as text, no key takes one.
#[derive(Debug, Clone)]
pub(crate) enum Value {
    Text(String),
    Integer(i64),
    Float(f64),
    Flag(bool),
    Array(Vec<Node>),
    Table(Table),
}

/// A table of values that know where they were written.
#[derive(Debug, Clone, Default)]
pub struct Table(pub(crate) BTreeMap<String, Node>);

impl Value {
    /// The value as it would be written, for messages.
    pub(crate) fn shown(&self) -> String {
        match self {
            Self::Text(text) => format!("\"{text}\""),
            Self::Integer(value) => value.to_string(),
            Self::Float(value) => format!("{value:?}"),
            Self::Flag(value) => value.to_string(),
            Self::Array(items) => {
                let items: Vec<_> = items.iter().map(|item| item.value.shown()).collect();
                format!("[{}]", items.join(", "))
            }
            Self::Table(_) => "a table".to_owned(),
        }
    }
}

/// Parses a file into a table and the syntax errors found on the way.
pub(crate) fn parse_file(text: &str) -> (Table, Vec<Diagnostic>) {
    parse(text, &|place| place)
}

/// The same, with every place told in another way.
pub(crate) fn parse(text: &str, told: &dyn Fn(Place) -> Place) -> (Table, Vec<Diagnostic>) {
    let (table, errors) = DeTable::parse_recoverable(text);
    let place = |span: std::ops::Range<usize>| told(file_place(text, span));
    let diagnostics = errors.iter().map(|error| Diagnostic {
        place: place(error.span().unwrap_or(0..0)),
        key: "syntax".to_owned(),
        message: error.message().to_owned(),
        allowed: "TOML 1.0".to_owned(),
        hint: String::new(),
    });
    (convert_table(table.get_ref(), &place), diagnostics.collect())
}

/// Parses one `key.path=value` option and lays it over the table. A value that is no TOML is taken as text; without one
/// the key is taken out.
pub(crate) fn overlay(table: &mut Table, option: &str) -> Result<(), Diagnostic> {
    let place = Place::Option(option.to_owned());
    let refuse = |message: String| Diagnostic {
        place: place.clone(),
        key: option.split('=').next().unwrap_or_default().to_owned(),
        message,
        allowed: "key.path=value".to_owned(),
        hint: "For example --set fluid.spacing=0.006".to_owned(),
    };
    let (path, text) = option.split_once('=').ok_or_else(|| refuse("no '=' in the option".to_owned()))?;
    let value = match DeValue::parse(text) {
        Ok(value) => convert_value(value.get_ref(), &|_| place.clone()),
        Err(_) => Value::Text(text.to_owned()),
    };
    let mut keys: Vec<_> = path.split('.').map(str::trim).collect();
    let last = keys.pop().filter(|key| !key.is_empty()).ok_or_else(|| refuse("empty key".to_owned()))?;
    let mut target = table;
    for key in keys {
        let empty = || Node { value: Value::Table(Table::default()), place: place.clone() };
        let node = descend(target, key, empty).ok_or_else(|| refuse(format!("there is no {key}")))?;
        match &mut node.value {
            Value::Table(inner) => target = inner,
            _ => return Err(refuse(format!("{key} is no section"))),
        }
    }
    if text.is_empty() {
        target.0.remove(last);
    } else {
        target.0.insert(last.to_owned(), Node { value, place });
    }
    Ok(())
}

/// The entry `key` or `key[index]` of a table; a missing plain key is made.
fn descend<'t>(table: &'t mut Table, key: &str, empty: impl Fn() -> Node) -> Option<&'t mut Node> {
    let Some((name, index)) = key.strip_suffix(']').and_then(|key| key.split_once('[')) else {
        return Some(table.0.entry(key.to_owned()).or_insert_with(empty));
    };
    match &mut table.0.get_mut(name)?.value {
        Value::Array(items) => items.get_mut(index.parse::<usize>().ok()?),
        _ => None,
    }
}

fn file_place(text: &str, span: std::ops::Range<usize>) -> Place {
    let end = span.end.min(text.len());
    let start = span.start.min(end);
    let line = text.as_bytes()[..start].iter().filter(|&&byte| byte == b'\n').count() + 1;
    Place::File { start, end, line }
}

fn convert_table(table: &DeTable<'_>, place: &dyn Fn(std::ops::Range<usize>) -> Place) -> Table {
    let entry = |(key, value): (&toml::Spanned<_>, &toml::Spanned<DeValue<'_>>)| {
        let key: &std::borrow::Cow<'_, str> = key.get_ref();
        let node = Node { value: convert_value(value.get_ref(), place), place: place(value.span()) };
        (key.to_string(), node)
    };
    Table(table.iter().map(entry).collect())
}

fn convert_value(value: &DeValue<'_>, place: &dyn Fn(std::ops::Range<usize>) -> Place) -> Value {
    match value {
        DeValue::String(text) => Value::Text(text.to_string()),
        DeValue::Integer(number) => match i64::from_str_radix(number.as_str(), number.radix()) {
            Ok(number) => Value::Integer(number),
            Err(_) => Value::Text(number.to_string()),
        },
        DeValue::Float(number) => match number.as_str().parse() {
            Ok(number) => Value::Float(number),
            Err(_) => Value::Text(number.to_string()),
        },
        DeValue::Boolean(flag) => Value::Flag(*flag),
        DeValue::Datetime(date) => Value::Text(date.to_string()),
        DeValue::Array(items) => {
            let node = |item: &toml::Spanned<DeValue<'_>>| Node {
                value: convert_value(item.get_ref(), place),
                place: place(item.span()),
            };
            Value::Array(items.iter().map(node).collect())
        }
        DeValue::Table(table) => Value::Table(convert_table(table, place)),
    }
}
