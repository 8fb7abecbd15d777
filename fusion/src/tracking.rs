//! Where each frame is: registration to the model, the motion so far, and finding a lost subject again.

mod approach;
mod axis;
mod color;
mod equations;
mod grey;
mod kept;
mod motion;
mod open_directions;
mod pictures;
mod registration;
mod relocalise;
mod samples;
mod starts;
mod tracked;
mod tracker;
mod trust;
mod views;

pub(crate) use axis::{Axis, find_axis, swept_turn, widest_step};
pub(crate) use equations::{NormalEquations, Residual, accumulate, increment};
pub(crate) use kept::{Kept, KeptFrame, Past};
pub(crate) use motion::scaled;
pub(crate) use open_directions::{DEGENERATE, conditioning, hold_open_directions};
pub(crate) use registration::{CONVERGED, gate_of, register, surface_distance, tukey};
pub(crate) use samples::{Sample, centroid, samples};
pub(crate) use starts::best_of;
pub(crate) use tracked::Located;
pub(crate) use tracker::Tracker;
pub(crate) use trust::{fits, trusted};
pub(crate) use views::MAX_VIEWS;

pub use approach::track;
pub use tracked::Tracked;
