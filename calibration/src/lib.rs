//! Cameras from pictures of a chessboard or of a ChArUco board: intrinsics, lens distortion, and where each camera of a rig stands.
//!
//! - [`find_corners`]: the inner corners of a board in a picture, below a tenth of a pixel;
//! - [`find_charuco`]: those that are seen of a board with markers, by their numbers;
//! - [`calibrate`]: intrinsics of each camera (or those that are told), places of all cameras, from pictures in which
//!   several cameras see the board at rest.
//!
//! Inside: `saddle` finds corners (crossings of edges), `grid` puts them in rows and columns, `charuco` numbers them by markers; `homography` and `closed_form`
//! give first values (Zhang 2000, "A flexible new technique for camera calibration"), `bundle` refines everything together.
//!
//! ```
//! use toile_calibration::{Board, Grey, find_corners};
//! let board = Board { columns: 9, rows: 6, square_m: 0.025 };
//! let empty = Grey::new(64, 48, vec![128.0; 64 * 48]);
//! assert!(find_corners(&empty, &board).is_none());
//! ```

mod board;
mod bundle;
mod charuco;
mod closed_form;
mod error;
mod grey;
mod grid;
mod homography;
mod moments;
mod rig;
mod saddle;
mod steps;

#[cfg(test)]
mod picture;
#[cfg(test)]
mod tests;

pub use board::{Board, Corner};
pub use charuco::{Charuco, Dictionary, find_charuco};
pub use error::CalibrationError;
pub use grey::Grey;
pub use grid::find_corners;
pub use moments::{Sighting, views_of};
pub use rig::{CalibratedRig, View, calibrate};
