//! Import: folders of images that others recorded, as a [`Source`](crate::Source).
//!
//! | Format | Layout |
//! |---|---|
//! | `toile-folder` | `depth/NNNNNN.png`, `color/NNNNNN.jpg` (or none), `camera.json`, `timestamps.txt` (or none) |
//! | `tum` | TUM RGB-D: `depth.txt`, `rgb.txt`; or pairs such as `X_depth.png`, `X_color.png` |
//! | `uva` | `N.jpg`, `N_depth.png`, `N_mask.jpg`, `N_camera.xml` |
//! | `seven-scenes` | `frame-N.color.jpg`, `frame-N.depth.png`, `frame-N.pose.txt`, `camera-intrinsics.txt` |
//! | `mcap` | a recording of Toile's own, or of another program with Foxglove's messages |
//!
//! Nothing but names and calibration is read on opening; each frame is read when it is asked for. Frames pair by their
//! numbers (TUM, and files that are named by times: by their times); where one of a pair is missing, the other is delivered alone.
//!
//! ```no_run
//! use toile_capture::import;
//! let mut source = import::open("somewhere/anna/00-body".as_ref(), None)?;
//! while let Some(frame) = source.next_frame()? {
//!     println!("{} {}", frame.index, frame.depth.is_some());
//! }
//! # Ok::<(), toile_capture::CaptureError>(())
//! ```

mod camera_file;
mod folder;
mod images;
mod inventory;
mod layout;
mod number_list;
mod poses;
mod record;
mod rigid;
mod seven_scenes;
mod timed;
mod tum;
mod uva;

pub use layout::{Format, ImportOptions, files, guess, open, open_with};
pub(crate) use number_list::number_list;
pub use poses::reference_poses;
pub use record::{ImportReport, record};

/// Reads the text of a calibration file as each reader of one would; for `fuzz/`.
pub(crate) fn parse_calibration(text: &str) {
    let _ = (camera_file::parse(text), uva::parse_matrix::<9>(text, "intrinsic"));
}

/// Reads a file's name; for `fuzz/`.
pub(crate) fn parse_name(name: &str) {
    let _ = (timed::time_of_name(name), inventory::last_number(name), tum::natural(name));
}
