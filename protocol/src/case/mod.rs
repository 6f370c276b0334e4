//! The case file: one TOML file a scene, SI units, strict.
//!
//! A program reads its sections key by key through [`Section`]; every mistake becomes a [`Diagnostic`] with its place,
//! the allowed range and a hint, and reading goes on with a placeholder, so that all mistakes are found at once.
//! The same calls document the key ([`KeyDoc`], the source of `docs/case-file.md`) and record the resolved value
//! (`case.lock.toml`).
//!
//! ```
//! use protocol::case::CaseFile;
//! let case = CaseFile::parse("demo.toml", "[fluid]\nspacing = 0.003\n", &[]);
//! let fluid = case.section("fluid").expect("the section is there");
//! let spacing = fluid.number("spacing").unit("m").above(0.0).about("Distance of water particles.").required();
//! fluid.finish();
//! assert_eq!(spacing, 0.003);
//! assert!(case.diagnostics().is_empty());
//! ```

mod base;
mod check;
mod diagnostic;
mod domain;
mod file;
mod gauge;
mod key;
mod outline;
mod prescribed;
mod reference;
mod scheme;
mod section;
mod shared;
mod tree;

pub use check::{CheckReport, LeftOut, PlanFigure};
pub use diagnostic::{Diagnostic, Place};
pub use domain::{BoxFace, BoxRegion, Domain, Opening, face_names};
pub use file::CaseFile;
pub use gauge::{Gauge, GaugeKind};
pub use key::{KeyDoc, Number, Words};
pub use outline::{FluidOutline, SolidOutline, read_clamped};
pub use prescribed::Prescribed;
pub use reference::{Norm, Reference, Target};
pub use scheme::{FluidSide, Replayed, Scheme, Side};
pub use section::Section;
pub use shared::{Gravity, Header, Output, SECTIONS, Shared, TimeSettings, interpolate};
pub use tree::Table;
