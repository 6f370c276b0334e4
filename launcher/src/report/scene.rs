//! A run read back from its folder, for the report.

use std::path::{Path, PathBuf};

use protocol::case::{CaseFile, Shared, Target};

use crate::compare::{Table, load_curve};
use crate::run_json::RunJson;

/// Rows (time, value).
pub(super) type Curve = Vec<(f64, f64)>;

/// A run as it lies in its folder.
pub(super) struct Scene {
    pub(super) folder: PathBuf,
    pub(super) json: RunJson,
    pub(super) shared: Shared,
    /// Series by name, the interface ledger among them.
    pub(super) series: Vec<(String, Table)>,
}

/// A reference curve of one gauge and column.
pub(super) struct ReferenceCurve {
    pub(super) label: String,
    pub(super) middle: Curve,
    pub(super) band: Option<(Curve, Curve)>,
}

/// Reads a run folder.
pub(super) fn load(folder: &Path) -> Result<Scene, String> {
    let json = RunJson::read(folder)?;
    let lock = folder.join("case.lock.toml");
    let case =
        CaseFile::load(&lock, &[]).map_err(|error| format!("cannot read {}: {error}", lock.display()))?;
    let shared = Shared::read(&case);
    let names = shared.gauges.iter().map(|gauge| gauge.name.clone()).chain(["interface".to_owned()]);
    let read = |name: String| {
        let table = Table::read(&folder.join("series").join(format!("{name}.csv"))).ok()?;
        Some((name, table))
    };
    let series = names.filter_map(read).collect();
    Ok(Scene { folder: folder.to_owned(), json, shared, series })
}

impl Scene {
    /// The reference curves of a column, each once.
    pub(super) fn reference_curves(&self, gauge: &str, column: &str) -> Vec<ReferenceCurve> {
        let mut curves: Vec<ReferenceCurve> = Vec::new();
        for reference in self.shared.references.iter().filter(|r| r.gauge == gauge && r.column == column) {
            let Target::Curve { file, column, band } = &reference.target else { continue };
            let known = curves.iter_mut().find(|known| known.label == reference.label);
            let columns = [Some(column), band.as_ref().map(|b| &b.0), band.as_ref().map(|b| &b.1)];
            let Ok(mut loaded) = load_curve(&self.folder.join(file), &columns.map(|c| c.map(String::as_str)))
            else {
                continue;
            };
            let band = (loaded.len() == 3).then(|| (loaded.remove(1), loaded.remove(1)));
            match known {
                Some(known) => known.band = known.band.take().or(band),
                None => curves.push(ReferenceCurve {
                    label: reference.label.clone(),
                    middle: loaded.remove(0),
                    band,
                }),
            }
        }
        curves
    }
}
