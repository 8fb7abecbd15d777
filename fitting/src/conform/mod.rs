//! The body's own surface: landmarks on the scan, the map by them, and the elastic deformation onto the scan.

mod deform;
mod elastic;
mod floor;
mod folds;
mod landmarks;
mod radial_basis;
mod segments;
mod uncross;

pub use landmarks::ScanLandmark;
pub(crate) use {
    deform::conform,
    folds::unfolded,
    landmarks::{landmarks, set_by_hand},
    uncross::uncrossed,
};
