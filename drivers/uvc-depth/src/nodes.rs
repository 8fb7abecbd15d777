//! Which video nodes offer depth.

use std::path::PathBuf;

use toile_driver_transport::video::{FourCc, Video};

/// A video node that offers depth.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DepthNode {
    /// Device node, such as `/dev/video2`.
    pub node: PathBuf,
    /// The driver's name for the camera.
    pub name: String,
}

/// The nodes that offer Z16 or Y16, in the order of their numbers; nodes that cannot be opened are left out.
pub fn list(video: &dyn Video) -> Vec<DepthNode> {
    let nodes = video.list().unwrap_or_default();
    let offers = |node: &PathBuf| {
        let offered = video.open(node).and_then(|opened| opened.formats()).unwrap_or_default();
        depth_format(&offered).is_some()
    };
    let depth = nodes.into_iter().filter(|info| offers(&info.node));
    depth.map(|info| DepthNode { node: info.node, name: info.name }).collect()
}

/// The depth format among those on offer: Z16 before Y16.
pub fn depth_format(offered: &[FourCc]) -> Option<FourCc> {
    [FourCc::Z16, FourCc::Y16].into_iter().find(|f| offered.contains(f))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn z16_is_preferred_and_colour_is_not_depth() {
        let (z16, y16, yuyv) = (FourCc::Z16, FourCc::Y16, FourCc::YUYV);
        assert_eq!(depth_format(&[yuyv, y16, z16]), Some(z16));
        assert_eq!(depth_format(&[yuyv, y16]), Some(y16));
        assert_eq!(depth_format(&[yuyv]), None);
    }
}
