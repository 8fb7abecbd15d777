//! Two images to depth: calibration, rectification, semi-global matching.
//!
//! - [`read_calibration`]: two cameras from the YAML files that OpenCV's `stereo_calib` writes;
//! - [`rectify`]: turns both views until rows correspond; [`Remap`] draws them;
//! - [`match_pair`]: disparities by semi-global matching on census costs, checked from the right image;
//! - [`DepthFromPair`]: all of it for every frame, down to a depth image.
//!
//! Camera frames: +X right, +Y down, +Z forward; pixel centres at integers; metres. The result is the same to the bit for
//! any number of threads and on every machine.
//!
//! ```
//! use toile_stereo::{GrayImage, MatchSettings, match_pair};
//! # fn main() -> Result<(), toile_stereo::StereoError> {
//! // A pattern, and the same seen 5 pixels further left.
//! let texture = |u: u32, v: u32| (u.wrapping_mul(2654435761) ^ v.wrapping_mul(40503)).wrapping_mul(2246822519).to_be_bytes()[0];
//! let image = |shift: u32| {
//!     let pixels = (0..60 * 40).map(|i| texture(i % 60 + shift, i / 60)).collect();
//!     GrayImage { width: 60, height: 40, pixels }
//! };
//! let map = match_pair(&image(0), &image(5), &MatchSettings { disparities: 32, ..MatchSettings::default() })?;
//! assert!((map.values[20 * 60 + 30] - 5.0).abs() < 0.5);
//! # Ok(())
//! # }
//! ```

mod calibration;
mod census;
mod depth;
mod error;
pub mod file_storage;
mod image;
mod lens;
mod matcher;
mod median;
mod path;
mod rectification;
mod remap;
mod row;
mod settings;
mod speckle;
#[cfg(test)]
mod testing;
mod winner;

pub use calibration::{GivenRectification, StereoCalibration, calibration_of, read_calibration};
pub use depth::{DepthFromPair, DepthSettings, PairDepth};
pub use error::StereoError;
pub use image::{GrayImage, luma};
pub use lens::Lens;
pub use matcher::{DisparityMap, match_pair};
pub use rectification::{Rectification, RectifiedView, rectify};
pub use remap::Remap;
pub use settings::MatchSettings;
