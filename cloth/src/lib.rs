//! Sheets that move.
//!
//! A [`Sheet`] is a triangle mesh at rest made of a [`Fabric`]. [`Sheet::advance`] moves it by one time step: implicit Euler as the
//! minimum of one potential (`objective`) of inertia, stretch and shear (`membrane`), bending (`bending`), [anchors](Anchors), and
//! contact with surfaces and with itself. The minimum is found by L-BFGS whose first guess of the curvature is the
//! constant matrix of projective dynamics, factorised once a time-step length (`system`).
//!
//! Everything is in metres, seconds, kilograms and newtons. The crate knows sheets, surfaces to hit and anchors.
//!
//! - Liu, Bouaziz, Kavan 2017, "Quasi-Newton methods for real-time simulation of hyperelastic materials".
//! - Grinspun, Gingold, Reisman, Zorin 2006, "Computing discrete shape operators on general meshes".
//! - Li et al. 2020, "Incremental potential contact" (the lagged, smoothed friction).

mod air;
mod bending;
pub mod contact;
mod error;
pub mod fabric;
mod membrane;
mod minimise;
mod objective;
pub mod obstacle;
mod rest;
mod self_contact;
mod sheet;
mod step;
mod system;

pub use error::ClothError;
pub use fabric::Fabric;
pub use obstacle::{MovingSurface, Near, Obstacle};
pub use rest::{Anchors, RestShape};
pub use sheet::Sheet;
pub use step::{Effort, Surroundings};
