//! Depth buffers from a V4L2 node.

use std::path::{Path, PathBuf};

use v4l::{
    Device, FourCC,
    buffer::Type,
    io::{mmap::Stream, traits::CaptureStream},
    video::Capture,
};

use crate::{UvcDepthError, decode::Layout};

/// Buffers that the kernel may fill ahead of us.
const BUFFERS: u32 = 4;

/// A V4L2 node that offers depth.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DepthNode {
    /// Device node, such as `/dev/video2`.
    pub node: PathBuf,
    /// What the driver calls the camera.
    pub name: String,
}

/// The nodes that offer Z16 or Y16, in the order of their names; nodes that cannot be opened are left out.
pub fn list() -> Vec<DepthNode> {
    let Ok(entries) = std::fs::read_dir("/dev") else { return Vec::new() };
    let is_video = |p: &Path| p.file_name().is_some_and(|n| n.to_string_lossy().starts_with("video"));
    let mut nodes: Vec<PathBuf> = entries.flatten().map(|e| e.path()).filter(|p| is_video(p)).collect();
    nodes.sort();
    nodes.into_iter().filter_map(depth_node).collect()
}

fn depth_node(node: PathBuf) -> Option<DepthNode> {
    let device = Device::with_path(&node).ok()?;
    let offered: Vec<FourCC> = device.enum_formats().ok()?.iter().map(|f| f.fourcc).collect();
    depth_format(&offered)?;
    let name = device.query_caps().map(|c| c.card).unwrap_or_default();
    Some(DepthNode { node, name })
}

/// A filled buffer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Buffer {
    /// Image bytes.
    pub bytes: Vec<u8>,
    /// The driver's frame counter.
    pub sequence: u32,
    /// The driver's monotonic clock, nanoseconds.
    pub time_ns: i64,
}

/// Whatever yields depth buffers: a V4L2 node, or a stand-in for one.
pub trait Buffers: Send {
    /// How the buffers are laid out.
    fn layout(&self) -> Layout;

    /// The next buffer; `None` when the device is gone or was stopped.
    ///
    /// # Errors
    /// What the system said.
    fn next_buffer(&mut self) -> std::io::Result<Option<Buffer>>;
}

/// A V4L2 node that streams depth into mapped memory.
pub struct V4l2Buffers {
    stream: Stream<'static>,
    layout: Layout,
}

impl V4l2Buffers {
    /// Opens `node`, asks for Z16 (else Y16) at the size given, and starts streaming.
    ///
    /// # Errors
    /// [`UvcDepthError::Device`] where a call fails, [`UvcDepthError::Format`] where the node offers no depth.
    pub fn open(node: &Path, width: u32, height: u32) -> Result<Self, UvcDepthError> {
        let failed = |action| move |source| UvcDepthError::Device { node: PathBuf::from(node), action, source };
        let device = Device::with_path(node).map_err(failed("open it"))?;
        let offered: Vec<FourCC> =
            device.enum_formats().map_err(failed("list its formats"))?.iter().map(|f| f.fourcc).collect();
        let fourcc = depth_format(&offered).ok_or_else(|| UvcDepthError::Format {
            node: node.to_path_buf(),
            offered: offered.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "),
        })?;
        let format = device.set_format(&v4l::Format::new(width, height, fourcc)).map_err(failed("set its format"))?;
        let stream = Stream::with_buffers(&device, Type::VideoCapture, BUFFERS).map_err(failed("start streaming"))?;
        Ok(Self { stream, layout: Layout { width: format.width, height: format.height, stride: format.stride } })
    }
}

fn depth_format(offered: &[FourCC]) -> Option<FourCC> {
    [FourCC::new(b"Z16 "), FourCC::new(b"Y16 ")].into_iter().find(|f| offered.contains(f))
}

impl Buffers for V4l2Buffers {
    fn layout(&self) -> Layout {
        self.layout
    }

    fn next_buffer(&mut self) -> std::io::Result<Option<Buffer>> {
        match self.stream.next() {
            Ok((bytes, meta)) => {
                let used = bytes.len().min(meta.bytesused as usize);
                let time_ns = meta.timestamp.sec * 1_000_000_000 + meta.timestamp.usec * 1000;
                Ok(Some(Buffer { bytes: bytes[..used].to_vec(), sequence: meta.sequence, time_ns }))
            }
            // An unplugged camera answers ENODEV: the take ends, it does not fail.
            Err(error) if error.raw_os_error() == Some(NO_SUCH_DEVICE) => Ok(None),
            Err(error) => Err(error),
        }
    }
}

/// `ENODEV` of Linux (asm-generic/errno-base.h).
const NO_SUCH_DEVICE: i32 = 19;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn z16_is_preferred_and_colour_is_no_depth() {
        let (z16, y16, yuyv) = (FourCC::new(b"Z16 "), FourCC::new(b"Y16 "), FourCC::new(b"YUYV"));
        assert_eq!(depth_format(&[yuyv, y16, z16]), Some(z16));
        assert_eq!(depth_format(&[yuyv, y16]), Some(y16));
        assert_eq!(depth_format(&[yuyv]), None);
    }

    #[test]
    fn a_node_that_is_not_there_is_named() {
        let error = V4l2Buffers::open(Path::new("/dev/video-none"), 640, 480).err().map(|e| e.to_string());
        assert!(error.is_some_and(|e| e.contains("/dev/video-none")));
    }
}
