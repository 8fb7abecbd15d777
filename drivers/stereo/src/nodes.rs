//! Which video nodes look like stereo cameras.

use std::path::PathBuf;

use toile_driver_transport::video::{FourCc, Video};

/// A node whose pictures are so wide that they may be two views side by side.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WideNode {
    /// Device node, such as `/dev/video2`.
    pub node: PathBuf,
    /// The driver's name for the camera.
    pub name: String,
    /// Columns and rows of both views together, the largest on offer.
    pub size: (u32, u32),
}

/// Two views of 4:3 side by side are 2.67 times as wide as tall; the widest single view in use, 21:9, is 2.33 times.
const WIDE: f64 = 2.5;

/// The nodes with such pictures, in the order of their numbers; nodes that cannot be opened are left out.
pub fn list(video: &dyn Video) -> Vec<WideNode> {
    let nodes = video.list().unwrap_or_default().into_iter();
    let wide = |node: &PathBuf| {
        let opened = video.open(node).ok()?;
        let formats = [FourCc::MJPG, FourCc::YUYV, FourCc::GREY].into_iter();
        let sizes = formats.flat_map(|format| opened.sizes(format).unwrap_or_default());
        sizes.filter(|(w, h)| f64::from(*w) >= WIDE * f64::from(*h)).max_by_key(|(w, h)| u64::from(*w) * u64::from(*h))
    };
    nodes.filter_map(|info| Some(WideNode { size: wide(&info.node)?, node: info.node, name: info.name })).collect()
}
