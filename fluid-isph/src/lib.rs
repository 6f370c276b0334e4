//! Stabilised incompressible SPH for water with a free surface (the fluid of the paper).
//!
//! One step is read in `step.rs`; what it works on is [`Fluid`]. A [`Scene`] is the case as resolved, `case.rs` reads
//! it from the file, `participant.rs` makes it a process of a coupled run.
//!
//! - [`kernel`], [`kernel_shape`], [`cells`], [`neighbours`], [`lanes`], [`lattice`]: kernel, neighbour search, its vectors, initial particles.
//! - [`flow`], [`obstacle`], [`surface`], [`periodic`]: what a scene may add.
//! - [`particles`], [`walls`], [`body`]: columns of water, wall and structure; [`nodes`] moves the last, which hangs on the
//!   cells of a mesh ([`embedding`]) or is points of its own ([`offer`], [`columns`]).
//! - [`viscosity`], [`turbulence`], [`assembly`], [`air`], [`source`], [`pressure`], [`wall_pressure`], [`correction`], [`shifting`],
//!   [`markers`]: one term of the method each.
//! - [`weakly_compressible`]: the explicit scheme, for comparison (`step_explicit.rs`).
//! - [`gauges`], [`health`]: what is measured.
//!
//! Deliberately absent: any free-surface flag in the matrix, wall unknowns, position clamps.

pub mod air;
pub mod assembly;
pub mod body;
pub mod body_layout;
pub mod case;
pub mod cells;
pub mod columns;
pub mod correction;
pub mod embedding;
pub mod error;
pub mod facet_normals;
pub mod flow;
pub mod fluid;
pub mod gauges;
pub mod health;
mod interface;
pub mod kernel;
pub mod kernel_shape;
pub mod lanes;
pub mod lattice;
#[cfg(test)]
mod leave_out;
pub mod markers;
pub mod neighbours;
pub mod nodes;
pub mod obstacle;
pub mod offer;
pub mod output;
mod parallel;
pub mod participant;
pub mod particles;
pub mod periodic;
mod phases;
mod phases_explicit;
mod phases_scene;
mod plan;
pub mod pressure;
mod retire;
mod rows;
pub mod scene;
mod setup;
pub mod shifting;
pub mod snapshot;
pub mod source;
mod step;
mod step_explicit;
pub mod surface;
pub mod time_step;
pub mod turbulence;
pub mod vector;
pub mod viscosity;
pub mod wall_pressure;
pub mod walls;
pub mod weakly_compressible;

pub use body::Structure;
pub use error::{FluidError, SetupError, StepFault};
pub use fluid::Fluid;
pub use nodes::Motion;
pub use scene::Scene;
