//! Where the subject is: what moves before what rests.

mod background;
mod bend;
mod cut;
mod floor;
mod standing;
mod upright;
mod volume;

pub(crate) use background::Resting;
pub(crate) use standing::{Eye, find_standing};
pub(crate) use volume::{SURVEY_FRAMES, find_volume};

pub use {cut::SubjectVolume, upright::ImageSide};
