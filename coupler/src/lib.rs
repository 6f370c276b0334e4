//! The coupler, in the role of REVOCAP_Coupler: it takes the fluid's pressures and forces at its side of the interface,
//! maps them to the solid's surface, predicts the interface motion for the fluid, and keeps the ledger of both sides.
//!
//! One coupling step is `step.rs`: one screen, one line a phase.
//!
//! Data layout: flat arrays, node after node, `D` components each; the fluid's side is a
//! [`fluid_side::FluidSide`], the solid's side its [`protocol::interface::Surface`]. In 2-D all forces are per metre of depth.
//!
//! Deliberately absent: any particle and any element.

pub mod acceleration;
pub mod added_mass;
mod booking;
pub mod case;
mod coupled;
pub mod dummy_mesh;
pub mod escalation;
mod exchange;
pub mod fluid_side;
pub mod guard;
mod handshake;
pub mod ledger;
pub mod load;
pub mod mapping;
mod marker_place;
pub mod motion;
mod parallel;
pub mod participant;
pub mod passes;
mod point_place;
pub mod record;
mod restart;
pub mod resultant;
mod step;
mod turned;
