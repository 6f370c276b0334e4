//! The study file: a case, what is varied, the errors looked at, and published figures to stand beside them.

use std::path::{Path, PathBuf};

use protocol::case::{CaseFile, KeyDoc, Norm, Section};

use super::map::Map;
use crate::compare::ErrorEntry;

/// Every section a study may have.
pub const SECTIONS: [&str; 5] = ["study", "sweep", "setting", "error", "peer"];

/// Everything a study file says.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Study {
    /// Name, of the default folder and in the headings.
    pub(super) name: String,
    /// The case that is varied.
    pub(super) case: PathBuf,
    /// Options every run gets, as for `--set`.
    pub(super) common: Vec<String>,
    /// Every setting once, in the order they are run.
    pub(super) settings: Vec<Setting>,
    /// What [`Setting::size`] is, such as `fluid.spacing`.
    pub(super) along: String,
    /// How often each setting is run.
    pub(super) repetitions: usize,
    /// No run is started after this much wall time, s.
    pub(super) budget_s: f64,
    /// Where it is asked for: what is shown of every setting over the two swept keys.
    pub(super) map: Option<Map>,
    /// The errors looked at; the first one decides the front.
    pub(super) errors: Vec<ErrorMeasure>,
    /// Published figures.
    pub(super) peers: Vec<Peer>,
}

/// One setting of the case.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Setting {
    /// For tables and pictures.
    pub(super) label: String,
    /// Settings of one series differ in their size only.
    pub(super) series: String,
    /// What the order of convergence is fitted in: the spacing, a time step.
    pub(super) size: Option<f64>,
    /// Another case than the study's.
    pub(super) case: Option<PathBuf>,
    /// As for `--set`.
    pub(super) options: Vec<String>,
}

/// Which reference of the case is looked at.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ErrorMeasure {
    /// Its gauge.
    pub(super) gauge: String,
    /// Its column, if the gauge has several.
    pub(super) column: Option<String>,
    /// Its norm.
    pub(super) norm: String,
    /// Words its label must hold, if several references have this gauge and norm; else the worst of them counts.
    pub(super) label: Option<String>,
    /// Errors for which the cheapest setting is named.
    pub(super) wanted: Vec<f64>,
}

/// A published figure of another program or another machine.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Peer {
    /// For the picture.
    pub(super) label: String,
    /// Norm of the error it has.
    pub(super) norm: String,
    /// Its error, in the unit of the measure.
    pub(super) error: f64,
    /// Its wall time, s.
    pub(super) wall_s: Option<f64>,
    /// Its CPU time of all cores, s.
    pub(super) core_s: Option<f64>,
    /// Where it comes from.
    pub(super) source: String,
}

impl ErrorMeasure {
    /// Whether an error of a run is meant.
    pub(super) fn fits(&self, entry: &ErrorEntry) -> bool {
        let is_column = self.column.as_ref().is_none_or(|column| *column == entry.column);
        let is_label = self.label.as_ref().is_none_or(|words| entry.reference.contains(words));
        entry.gauge == self.gauge && entry.norm == self.norm && is_column && is_label
    }

    /// For headings: `tip rms`.
    pub(super) fn name(&self) -> String {
        let column = self.column.as_ref().map_or(String::new(), |column| format!(".{column}"));
        format!("{}{column} {}", self.gauge, self.norm)
    }
}

impl Study {
    /// Reads a study; mistakes are kept in `file`.
    pub(super) fn read(file: &CaseFile) -> Self {
        let section = file.section_or_default("study");
        let name = section.text("name").about("Name of the study.").required();
        let case = section.text("case").about("The case, relative to the study file.").required();
        let until = section.number("until").unit("s").above(0.0).about("End of every run.").optional();
        let common = section.scalars("set", "Options for every run, as for --set: \"key.path=value\".");
        let along = section
            .text("along")
            .about("What the order is fitted in, none to leave it out; the default is the first key that is swept.")
            .default("");
        let repetitions = section.integer("repetitions").at_least(1.0).about("Runs of each setting.");
        let repetitions = repetitions.default(1.0) as usize;
        let budget_s = section.number("budget").unit("s").above(0.0);
        let budget_s = budget_s.about("No run is started after this much wall time.").default(86_400.0);
        let figure = section
            .text("map")
            .about("A figure of run.json's health, such as load_jump_mean: drawn over the two keys that are swept, with the verdicts.");
        let figure = figure.optional();
        section.finish();
        let sweeps: Vec<_> = file.list("sweep").iter().map(read_sweep).collect();
        let map = figure.and_then(|figure| {
            if let [across, upwards] = &sweeps[..] {
                return Some(Map { figure, across: across.clone(), upwards: upwards.clone() });
            }
            let what = format!("{} keys are swept", sweeps.len());
            section.complain("map", what, "two [[sweep]]s", "A map has one key across and one upwards.");
            None
        });
        let has_order = along != "none";
        let first = sweeps.first().map(|sweep| sweep.0.clone()).filter(|_| along.is_empty() || !has_order);
        let along = first.unwrap_or(along);
        let folder = file.path().parent().unwrap_or(Path::new("."));
        let mut settings: Vec<_> = file.list("setting").iter().map(|s| read_setting(s, folder)).collect();
        if !sweeps.is_empty() {
            settings.extend(grid(&sweeps, &along));
        }
        settings.iter_mut().filter(|_| !has_order).for_each(|setting| setting.size = None);
        for (index, setting) in settings.iter().enumerate() {
            if settings[..index].iter().any(|other| other.label == setting.label) {
                let what = format!("the setting \"{}\" stands twice", setting.label);
                section.complain("name", what, "different labels", "Each setting has a folder by its label.");
            }
        }
        let errors: Vec<_> = file.list("error").iter().map(read_error).collect();
        if settings.is_empty() {
            let allowed = "a [[sweep]] or a [[setting]]";
            section.complain("name", "nothing is varied", allowed, "A study varies something.");
        }
        let peers = file.list("peer").iter().map(read_peer).collect();
        file.refuse_unknown_sections(&SECTIONS);
        let case = folder.join(case);
        let common = common.into_iter().chain(until.map(|end| format!("time.end={end:?}"))).collect();
        Self { name, case, common, settings, along, repetitions, budget_s, map, errors, peers }
    }
}

/// What is to be said about every key of a study.
pub fn keys() -> Vec<KeyDoc> {
    let file = CaseFile::parse("all.toml", "[study]\n[[sweep]]\n[[setting]]\n[[error]]\n[[peer]]\n", &[]);
    Study::read(&file);
    file.keys()
}

fn read_sweep(section: &Section<'_>) -> (String, Vec<String>) {
    let key = section.text("key").about("The key that is varied, as for --set.").required();
    let values = section.scalars("values", "Its values; several sweeps make a grid.");
    if values.is_empty() {
        section.complain("values", "no value", "a list of at least one value", "");
    }
    section.finish();
    (key, values)
}

fn read_setting(section: &Section<'_>, folder: &Path) -> Setting {
    let label = section.text("label").about("For tables and pictures.").required();
    let series = section.text("series").about("Settings of one series are joined by a line.").default("");
    let size = section.number("size").above(0.0).about("What the order is fitted in.").optional();
    let options = section.scalars("set", "Options, as for --set: \"key.path=value\".");
    let case = section.text("case").about("Another case than the study's.").optional();
    section.finish();
    Setting { label, series, size, case: case.map(|case| folder.join(case)), options }
}

fn read_error(section: &Section<'_>) -> ErrorMeasure {
    let gauge = section.text("gauge").about("Gauge of the reference.").required();
    let column = section.text("column").about("Its column, if it has several.").optional();
    let names: Vec<_> = Norm::NAMES.into_iter().filter(|&name| name != "share_inside").collect();
    let norm = section.choice("norm", &names).about("Norm of the reference.").required();
    let label = section
        .text("label")
        .about("Words the reference's label holds; of all that fit, the worst counts.")
        .optional();
    let wanted = section.scalars("wanted", "Errors for which the cheapest setting is named.");
    let numbers: Vec<f64> = wanted.iter().filter_map(|word| word.parse().ok()).collect();
    if numbers.len() != wanted.len() {
        section.complain("wanted", "not all are numbers", "a list of numbers", "");
    }
    section.finish();
    ErrorMeasure { gauge, column, norm, label, wanted: numbers }
}

fn read_peer(section: &Section<'_>) -> Peer {
    let label = section.text("label").about("For the picture.").required();
    let norm = section.choice("norm", &Norm::NAMES).about("Norm of the error it has.").required();
    let error = section.number("error").above(0.0).about("Its error.").required();
    let wall_s = section.number("wall").unit("s").above(0.0).about("Its wall time.").optional();
    let core_s = section.number("core").unit("s").above(0.0).about("Its CPU time.").optional();
    let source = section.text("source").about("Where it comes from.").required();
    section.finish();
    Peer { label, norm, error, wall_s, core_s, source }
}

/// Every combination of the swept values.
fn grid(sweeps: &[(String, Vec<String>)], along: &str) -> Vec<Setting> {
    let mut settings = vec![Setting {
        label: String::new(),
        series: String::new(),
        size: None,
        case: None,
        options: Vec::new(),
    }];
    for (key, values) in sweeps {
        let short = key.rsplit('.').next().unwrap_or(key);
        let with = |setting: &Setting, value: &String| {
            let word = format!("{short} {value}");
            let joined = |text: &str| {
                if text.is_empty() { word.clone() } else { format!("{text}, {word}") }
            };
            let is_along = key == along;
            let mut options = setting.options.clone();
            options.push(format!("{key}={value}"));
            Setting {
                label: joined(&setting.label),
                series: if is_along { setting.series.clone() } else { joined(&setting.series) },
                size: if is_along { value.parse().ok() } else { setting.size },
                case: None,
                options,
            }
        };
        settings = settings.iter().flat_map(|s| values.iter().map(move |value| with(s, value))).collect();
    }
    settings
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"
[study]
name = "demo"
case = "../case.toml"
until = 0.5
[[sweep]]
key = "fluid.spacing"
values = [0.02, 0.01]
[[sweep]]
key = "solid.element"
values = ["tet4", "hex8_eas9"]
[[setting]]
label = "as it is"
[[error]]
gauge = "tip"
norm = "rms"
wanted = [1e-3]
"#;

    #[test]
    fn sweeps_make_a_grid_and_settings_stand_beside_it() {
        let file = CaseFile::parse("studies/demo.toml", TEXT, &[]);
        let study = Study::read(&file);
        assert_eq!(file.diagnostics(), []);
        assert_eq!(study.case, Path::new("studies/../case.toml"));
        assert_eq!(study.common, ["time.end=0.5"]);
        let labels: Vec<_> = study.settings.iter().map(|s| s.label.as_str()).collect();
        assert_eq!(labels[0], "as it is");
        assert_eq!(labels.len(), 5);
        assert_eq!(labels[2], "spacing 0.02, element hex8_eas9");
        let setting = &study.settings[2];
        assert_eq!((setting.series.as_str(), setting.size), ("element hex8_eas9", Some(0.02)));
        assert_eq!(setting.options, ["fluid.spacing=0.02", "solid.element=hex8_eas9"]);
        assert_eq!(study.along, "fluid.spacing");
    }

    #[test]
    fn every_mistake_is_told() {
        let text = "[study]\nname = 3\n[[sweep]]\nkey = \"a\"\nvalues = []\n[[error]]\ngauge = \"tip\"\nnorm = \"rmz\"\n[oops]\n";
        let file = CaseFile::parse("bad.toml", text, &[]);
        Study::read(&file);
        let found: Vec<_> = file.diagnostics().iter().map(|d| d.key.clone()).collect();
        for key in ["study.name", "study.case", "sweep[0].values", "error[0].norm", "oops"] {
            assert!(found.iter().any(|known| known == key), "{key} in {found:?}");
        }
    }
}
