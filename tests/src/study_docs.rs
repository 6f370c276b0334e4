//! `docs/study-file.md`, made from what `tidewall study` says about the keys it asks for.

use crate::case_docs::tables;

const HEAD: &str = "\
# The study file

`tidewall study STUDY.toml` runs one case under several settings and says what an error costs: error against wall time
and against CPU time, the settings nothing else beats (the front), the observed order of convergence, the cheapest
setting for a wanted error. `[[sweep]]`s make a grid of all their values, `[[setting]]`s stand beside it. Errors are
those of the case's `[[reference]]`s. Results go to `runs/study-<name>/`: `study.csv` (a row a run), `study.md`, `study.svg`,
`map.svg` (where the study names a figure for it), and every run whole. The same command again goes on where it was stopped;
runs that reached their end with the same
resolved case and the same number of threads are not repeated.

```toml
[study]
name = \"spacing\"
case = \"../dam-break-elastic/plane.toml\"   # beside the study file
until = 0.41

[[sweep]]
key = \"fluid.spacing\"
values = [0.006, 0.004, 0.003]

[[error]]
gauge = \"tip\"
norm = \"rms\"
wanted = [0.001]
```

This page is generated (`TIDEWALL_WRITE_DOCS=1 cargo test -p tidewall-tests --test house`); a test compares it.
";

/// The page.
pub fn page() -> String {
    let keys = launcher::study::keys();
    HEAD.to_owned() + &tables(&keys, &keys, &launcher::study::SECTIONS)
}
