//! Import: folders of images that others recorded, as a [`Source`](crate::Source).
//!
//! | Format | Layout |
//! |---|---|
//! | `toile-folder` | `depth/NNNNNN.png`, `color/NNNNNN.jpg` (or none), `camera.json`, `timestamps.txt` (or none) |
//! | `tum` | TUM RGB-D: `depth.txt`, `rgb.txt`; or pairs such as `X_depth.png`, `X_color.png` |
//! | `uva` | `N.jpg`, `N_depth.png`, `N_mask.jpg`, `N_camera.xml` |
//! | `seven-scenes` | `frame-N.color.jpg`, `frame-N.depth.png`, `frame-N.pose.txt`, `camera-intrinsics.txt` |
//! | `redwood` | `depth/NNNNNNN-TTTTTTTTTTTT.png`, `rgb/` or `image/` likewise |
//! | `associated` | `associations.txt` (ICL-NUIM, TUM RGB-D): `t depth t colour` |
//! | `stray-scanner` | `camera_matrix.csv`, `odometry.csv`, `depth/NNNNNN.png` |
//! | `freenect` | `INDEX.txt`, `d-TIME-STAMP.pgm`, `r-TIME-STAMP.ppm` |
//! | `record3d` | an `.r3d` archive, or `metadata` and `rgbd/N.depth`, `rgbd/N.jpg` |
//! | `sens` | BundleFusion and ScanNet |
//! | `mkv` | Matroska of k4arecorder and of what records as it does |
//! | `oni` | OpenNI 1 and 2 |
//! | `bag` | a ROS 1 bag with `sensor_msgs`, as librealsense records, too |
//! | `ros-mcap` | MCAP with `sensor_msgs` of ROS 1 or ROS 2 |
//! | `ros2-bag` | the folder of a ROS 2 bag (SQLite or MCAP), or one `.db3` of it |
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

#[cfg(test)]
mod archives;
mod associated;
mod camera_file;
mod folder;
mod format;
mod freenect;
mod images;
mod inventory;
mod layout;
mod matroska;
mod number_list;
mod oni;
mod poses;
mod record;
mod record3d;
mod redwood;
mod rigid;
mod ros;
mod sens;
mod seven_scenes;
mod sniff;
mod stored;
mod stray;
mod timed;
mod tum;
mod uva;
mod zip;

pub use format::Format;
pub use layout::{ImportOptions, files, guess, open, open_with};
pub(crate) use number_list::number_list;
pub use poses::reference_poses;
pub use record::{ImportReport, record};

/// Reads the text of a calibration file as each reader of one would; for `fuzz/`.
pub(crate) fn parse_calibration(text: &str) {
    let _ = (camera_file::parse(text), uva::parse_matrix::<9>(text, "intrinsic"));
}

/// Reads pictures, messages and lists of other programs' recordings; for `fuzz/`.
pub(crate) fn parse_recording(bytes: &[u8]) {
    ros::parse(bytes);
    sens::parse(bytes);
    matroska::parse(bytes);
    oni::parse(bytes);
    zip::parse(bytes);
    record3d::parse(bytes);
    freenect::parse(bytes);
}

/// Reads a file's name; for `fuzz/`.
pub(crate) fn parse_name(name: &str) {
    let _ = (timed::time_of_name(name), inventory::last_number(name), tum::natural(name));
}
