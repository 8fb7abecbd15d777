//! A subject that stands still before several resting cameras, without a turntable.
//!
//! 1. `agreed` takes the depth that each sensor's frames agree on; the subject is what stands where all cameras look;
//! 2. `align` refines where the cameras stand, from the recorded places: neighbours share little of the subject, but all
//!    see the floor;
//! 3. `shared` says whether the cameras overlap and agree;
//! 4. `fuse` fuses every frame from its camera's place.

mod agreed;
mod align;
mod fuse;
mod shared;

#[cfg(test)]
mod tests;

pub(crate) use fuse::fuse_standing;
