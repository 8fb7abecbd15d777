//! Several sensors into one model.
//!
//! The leading sensor is tracked as if it were alone, and its turn is closed: then it is known how the disk has turned at
//! any time. Each further sensor is resting too, so that one pose, its place in the room, says where all its frames are:
//!
//! 1. `clocks` bring all frames to the host's time, `path` says how the disk stood then;
//! 2. `sighting` registers frames of the sensor from the place that the recording names, or from a search all around;
//!    places that most frames agree on are believed;
//! 3. `alignment` refines the place over all frames together; `moved` notices a camera that was pushed aside;
//! 4. `join` fuses the frames at their own registrations, and goes on with the next sensor.
//!
//! The joint optimisation of `finish` then holds frames of all sensors.

mod alignment;
mod clocks;
mod found;
mod join;
mod member;
mod moved;
mod path;
mod place;
mod settled;
mod sighting;

#[cfg(test)]
mod tests;

pub(crate) use found::{FoundSensor, RigFound};
pub(crate) use join::join;
pub(crate) use member::{Member, volume_at};
pub(crate) use settled::{rig_warnings, settle};
