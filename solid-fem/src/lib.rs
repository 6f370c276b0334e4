//! Total-Lagrangian finite elements for structures.
//!
//! [`scene::Scene`] -> [`solid::Solid`]; one step is in `step.rs`. Deliberately absent: any knowledge of the fluid.

pub mod account;
mod assembly;
mod body;
pub mod box_grid;
pub mod case;
pub mod cell;
pub mod element;
pub mod error;
pub mod export;
mod facet;
mod halving;
pub mod integrator;
pub mod linear;
pub mod load;
pub mod material;
pub mod mesh;
pub mod mesh_file;
pub mod modes;
pub mod participant;
pub mod probe;
pub mod quadrature;
mod recorder;
pub mod rigid;
pub mod scene;
pub mod solid;
mod state;
mod step;
pub mod support;
mod surface;

pub use state::Counts;
