//! One key of a section: what is allowed, what it means, and what was written.

use serde::{Deserialize, Serialize};

use super::section::{Doc, Section};
use super::tree::Value;

/// The documentation of one key, as it stands in `docs/case-file.md`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KeyDoc {
    /// Section and key, such as `fluid.spacing`; `[]` marks a list.
    pub path: String,
    /// Number, text, flag, ...
    pub kind: String,
    /// Unit; empty for none.
    pub unit: String,
    /// Allowed values.
    pub allowed: String,
    /// Default as written, `required`, or `absent`.
    pub default: String,
    /// What it means.
    pub about: String,
}

/// A key that holds a number.
#[must_use]
pub struct Number<'s, 'c> {
    section: &'s Section<'c>,
    key: &'s str,
    unit: &'s str,
    about: &'s str,
    low: Option<(f64, bool)>,
    high: Option<(f64, bool)>,
    whole: bool,
}

impl<'s, 'c> Number<'s, 'c> {
    pub(super) fn new(section: &'s Section<'c>, key: &'s str, whole: bool) -> Self {
        Self { section, key, unit: "", about: "", low: None, high: None, whole }
    }

    /// Its unit.
    pub fn unit(mut self, unit: &'s str) -> Self {
        self.unit = unit;
        self
    }

    /// What it means.
    pub fn about(mut self, about: &'s str) -> Self {
        self.about = about;
        self
    }

    /// It must be greater than this.
    pub fn above(mut self, low: f64) -> Self {
        self.low = Some((low, false));
        self
    }

    /// It must be at least this.
    pub fn at_least(mut self, low: f64) -> Self {
        self.low = Some((low, true));
        self
    }

    /// It must be less than this.
    pub fn below(mut self, high: f64) -> Self {
        self.high = Some((high, false));
        self
    }

    /// It must be at most this.
    pub fn at_most(mut self, high: f64) -> Self {
        self.high = Some((high, true));
        self
    }

    fn allowed(&self) -> String {
        let mut words = vec![if self.whole { "whole number" } else { "number" }.to_owned()];
        if let Some((low, equal)) = self.low {
            words.push(format!("{} {low}", if equal { ">=" } else { ">" }));
        }
        if let Some((high, equal)) = self.high {
            words.push(format!("{} {high}", if equal { "<=" } else { "<" }));
        }
        if !self.unit.is_empty() {
            words.push(format!("in {}", self.unit));
        }
        words.join(" ")
    }

    fn contains(&self, value: f64) -> bool {
        let above = self.low.is_none_or(|(low, equal)| value > low || equal && value == low);
        let below = self.high.is_none_or(|(high, equal)| value < high || equal && value == high);
        value.is_finite() && above && below
    }

    fn parse(&self, value: &Value) -> Option<f64> {
        let number = match value {
            Value::Integer(number) => *number as f64,
            Value::Float(number) if !self.whole => *number,
            _ => return None,
        };
        self.contains(number).then_some(number)
    }

    fn document(&self, default: &str) {
        let kind = if self.whole { "integer" } else { "number" };
        let allowed = self.allowed();
        let (unit, about) = (self.unit, self.about);
        self.section.document(self.key, Doc { kind, unit, allowed: &allowed, default, about });
    }

    fn record(&self, value: f64) {
        let whole = self.whole;
        self.section.record(self.key, if whole { (value as i64).into() } else { value.into() });
    }

    fn read(&self) -> Option<f64> {
        let value = self.section.take(self.key, &self.allowed(), |value| self.parse(value))?;
        self.record(value);
        Some(value)
    }

    /// The number, or 1 after a complaint.
    pub fn required(self) -> f64 {
        self.document("required");
        if !self.section.has(self.key) {
            self.section.missing(self.key, &self.allowed(), self.about);
        }
        self.read().unwrap_or(1.0)
    }

    /// The number, if the key is there.
    pub fn optional(self) -> Option<f64> {
        self.document("absent");
        self.read()
    }

    /// The number, or the default.
    pub fn default(self, default: f64) -> f64 {
        self.document(&format!("{default}"));
        self.read().unwrap_or_else(|| {
            self.record(default);
            default
        })
    }
}

/// A key that holds a text, one of a set of words, or a list of them.
#[must_use]
pub struct Words<'s, 'c> {
    section: &'s Section<'c>,
    key: &'s str,
    about: &'s str,
    choices: &'s [&'s str],
}

impl<'s, 'c> Words<'s, 'c> {
    pub(super) fn new(section: &'s Section<'c>, key: &'s str, choices: &'s [&'s str]) -> Self {
        Self { section, key, about: "", choices }
    }

    /// What it means.
    pub fn about(mut self, about: &'s str) -> Self {
        self.about = about;
        self
    }

    fn allowed(&self) -> String {
        match self.choices {
            [] => "text".to_owned(),
            choices => choices.iter().map(|choice| format!("\"{choice}\"")).collect::<Vec<_>>().join(" | "),
        }
    }

    fn parse(&self, value: &Value) -> Option<String> {
        match value {
            Value::Text(text) if self.choices.is_empty() || self.choices.contains(&text.as_str()) => {
                Some(text.clone())
            }
            _ => None,
        }
    }

    fn document(&self, kind: &str, default: &str) {
        let (allowed, about) = (self.allowed(), self.about);
        self.section.document(self.key, Doc { kind, unit: "", allowed: &allowed, default, about });
    }

    fn read(&self) -> Option<String> {
        let text = self.section.take(self.key, &self.allowed(), |value| self.parse(value))?;
        self.section.record(self.key, text.clone().into());
        Some(text)
    }

    /// The text, or the first choice (empty without choices) after a complaint.
    pub fn required(self) -> String {
        self.document("text", "required");
        if !self.section.has(self.key) {
            self.section.missing(self.key, &self.allowed(), self.about);
        }
        self.read().unwrap_or_else(|| self.choices.first().copied().unwrap_or_default().to_owned())
    }

    /// The text, if the key is there.
    pub fn optional(self) -> Option<String> {
        self.document("text", "absent");
        self.read()
    }

    /// The text, or the default.
    pub fn default(self, default: &str) -> String {
        self.document("text", &format!("\"{default}\""));
        self.read().unwrap_or_else(|| {
            self.section.record(self.key, default.into());
            default.to_owned()
        })
    }

    /// A list of words, the given default if the key is absent.
    pub fn list(self, default: &[&str]) -> Vec<String> {
        self.document("list of texts", &format!("{default:?}"));
        let allowed = format!("a list of {}", self.allowed());
        let words = self.section.take(self.key, &allowed, |value| match value {
            Value::Array(items) => items.iter().map(|item| self.parse(&item.value)).collect(),
            _ => None,
        });
        let words: Vec<String> =
            words.unwrap_or_else(|| default.iter().map(|&word| word.to_owned()).collect());
        self.section.record(self.key, words.clone().into());
        words
    }
}

/// A hint naming the known word closest to a mistyped one; empty if none is close.
pub(crate) fn nearest<'w>(word: &str, known: impl Iterator<Item = &'w str>) -> String {
    let best = known.map(|candidate| (edit_distance(word, candidate), candidate)).min();
    match best {
        Some((distance, candidate)) if distance <= 2.max(word.len() / 3) => {
            format!("Did you mean \"{candidate}\"?")
        }
        _ => String::new(),
    }
}

fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &to) in b.iter().enumerate() {
            let substitute = diagonal + usize::from(from != to);
            diagonal = row[j + 1];
            row[j + 1] = substitute.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}
