//! Helpers for tests across processes: the programs built once, small scenes, runs started and watched, and the
//! proof that nothing is left of them.
//!
//! - [`programs`]: builds all executables and says where they are.
//! - [`scene`]: small case files.
//! - [`run`]: a run of `tidewall` from start to end.
//! - [`traces`]: what a run leaves in shared memory, in the file system and among the processes.
//! - [`twin`]: the same participants as threads of the test.
//! - [`case_docs`]: `docs/case-file.md` made from what the programs say about their keys.
//! - [`study_docs`]: `docs/study-file.md`, likewise.
//!
//! Waits are for conditions, looked at every millisecond; there is no fixed sleep and no asserted run time.

pub mod case_docs;
pub mod programs;
pub mod run;
pub mod scene;
pub mod study_docs;
pub mod traces;
pub mod twin;
