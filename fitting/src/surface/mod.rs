//! Surfaces as the fits look them up: thinned samples with a search tree, and the scan's triangles with their trust.

mod cloud;
mod scan;
mod thin;

pub(crate) use cloud::{Cloud, Nearby, Samples};
pub(crate) use scan::{Contact, ScanSurface, trust_of};
pub(crate) use thin::Thinned;
