//! Pictures from one camera: a video node, a folder, or a stand-in.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use toile_capture::host_now_ns;
use toile_driver_transport::video::{FourCc, Video, VideoNode};

use crate::{
    StereoDriverError,
    decode::{self, Layout, PixelFormat},
    pairing::{Picture, Side},
};

/// Whatever yields the pictures of one camera in the order of time.
pub trait Pictures: Send {
    /// The next picture; `None` when the recording is over.
    ///
    /// # Errors
    /// [`StereoDriverError::Picture`], after which the next call may go on; any other ends the camera (unplugged).
    fn next_picture(&mut self) -> Result<Option<Picture>, StereoDriverError>;

    /// True for cameras: when one of a rig is gone, the other's pictures are of no more use.
    fn is_live(&self) -> bool {
        false
    }
}

/// Buffers that the kernel may fill ahead of us.
const BUFFERS: u32 = 8;

/// How long to wait for a picture before the camera is taken for stuck.
const TIMEOUT: Duration = Duration::from_secs(2);

/// Formats in the order they are asked for: JPEG first, because two cameras share a bus.
const FORMATS: [(PixelFormat, FourCc); 3] =
    [(PixelFormat::Mjpg, FourCc::MJPG), (PixelFormat::Yuyv, FourCc::YUYV), (PixelFormat::Grey, FourCc::GREY)];

/// The pictures of a video node.
pub struct NodePictures {
    node: Box<dyn VideoNode>,
    side: Side,
    layout: Layout,
}

impl NodePictures {
    /// Opens `node`, asks for pictures of a size, and starts streaming.
    ///
    /// # Errors
    /// [`StereoDriverError::Transport`] where a call fails, [`StereoDriverError::Format`] where the node has no such
    /// pictures.
    pub fn open(
        video: &dyn Video,
        node: &Path,
        side: Side,
        (width, height): (u32, u32),
    ) -> Result<Self, StereoDriverError> {
        let format = |offered: String| StereoDriverError::Format { node: node.to_path_buf(), offered, width, height };
        let mut opened = video.open(node)?;
        let offered = opened.formats()?;
        let (chosen, code) = FORMATS
            .into_iter()
            .find(|(_, code)| offered.contains(code))
            .ok_or_else(|| format(offered.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")))?;
        let given = opened.set_format(code, width, height)?;
        if (given.width, given.height, given.format) != (width, height, code) {
            return Err(format(format!("{} {}x{}", given.format, given.width, given.height)));
        }
        opened.start(BUFFERS)?;
        let layout = Layout { format: chosen, width, height, stride: given.stride };
        Ok(Self { node: opened, side, layout })
    }
}

impl Pictures for NodePictures {
    fn next_picture(&mut self) -> Result<Option<Picture>, StereoDriverError> {
        let buffer = self.node.next_buffer(TIMEOUT)?;
        let sequence = u64::from(buffer.sequence);
        let image = decode::picture(&buffer.bytes, self.layout).map_err(|reason| StereoDriverError::Picture {
            side: self.side,
            sequence,
            reason,
        })?;
        Ok(Some(Picture { image: Arc::new(image), sequence, time_ns: buffer.time_ns, host_time_ns: host_now_ns() }))
    }

    fn is_live(&self) -> bool {
        true
    }
}

/// A sequence of picture files: `left01.png`, `left02.png`, ... The number in a name is the picture's number, and its time
/// by the frame rate.
#[derive(Debug)]
pub struct FolderPictures {
    side: Side,
    files: std::vec::IntoIter<(u64, PathBuf)>,
    fps: f64,
}

impl FolderPictures {
    /// The PNG and JPEG files of `folder` whose names begin with `prefix` (which may be empty) and go on with a number.
    ///
    /// # Errors
    /// [`StereoDriverError::Recorded`] where there are none, or the rate is impossible.
    pub fn open(folder: &Path, prefix: &str, side: Side, fps: f64) -> Result<Self, StereoDriverError> {
        let wrong = |reason: String| StereoDriverError::Recorded { path: folder.to_path_buf(), reason };
        if !(fps.is_finite() && fps > 0.0) {
            return Err(wrong(format!("{fps} pictures a second is not a possible rate")));
        }
        let entries = std::fs::read_dir(folder).map_err(|e| wrong(e.to_string()))?;
        let mut files: Vec<(u64, PathBuf)> =
            entries.flatten().map(|e| e.path()).filter_map(|path| Some((number(&path, prefix)?, path))).collect();
        files.sort();
        if files.is_empty() {
            return Err(wrong(format!("holds no pictures named {prefix}NUMBER.png or .jpg")));
        }
        Ok(Self { side, files: files.into_iter(), fps })
    }
}

fn number(path: &Path, prefix: &str) -> Option<u64> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    let digits = path.file_stem()?.to_str()?.strip_prefix(prefix)?;
    ["png", "jpg", "jpeg"].contains(&extension.as_str()).then(|| digits.parse().ok())?
}

impl Pictures for FolderPictures {
    fn next_picture(&mut self) -> Result<Option<Picture>, StereoDriverError> {
        let Some((sequence, path)) = self.files.next() else { return Ok(None) };
        let image = image::open(&path)
            .map_err(|e| {
                let reason = format!("({}) is not readable: {e}", path.display());
                StereoDriverError::Picture { side: self.side, sequence, reason }
            })?
            .to_rgb8();
        let pixels = image.pixels().map(|p| p.0).collect();
        let image = toile_capture::RgbImage { width: image.width(), height: image.height(), pixels };
        let time_ns = (sequence as f64 / self.fps * 1e9).round() as i64;
        Ok(Some(Picture { image: Arc::new(image), sequence, time_ns, host_time_ns: time_ns }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_give_numbers() {
        assert_eq!(number(Path::new("a/left07.JPG"), "left"), Some(7));
        assert_eq!(number(Path::new("a/000120.png"), ""), Some(120));
        assert_eq!(number(Path::new("a/leftover.png"), "left"), None);
        assert_eq!(number(Path::new("a/left07.txt"), "left"), None);
    }
}
