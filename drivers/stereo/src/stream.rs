//! Pictures from one camera: a V4L2 node, a folder, or a stand-in.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, SystemTime},
};

use v4l::{
    Device, FourCC,
    buffer::Type,
    io::{mmap::Stream, traits::CaptureStream},
    video::Capture,
};

use crate::{
    StereoDriverError,
    decode::{self, Layout, PixelFormat},
    pairing::{Picture, Side},
};

/// Whatever yields the pictures of one camera in the order of time.
pub trait Pictures: Send {
    /// The next picture; `None` when the camera is gone or the recording is over.
    ///
    /// # Errors
    /// [`StereoDriverError`]; after [`StereoDriverError::Picture`] the next call may go on.
    fn next_picture(&mut self) -> Result<Option<Picture>, StereoDriverError>;

    /// True for cameras: when one of a rig is gone, the other's pictures are of no more use.
    fn is_live(&self) -> bool {
        false
    }
}

/// Buffers that the kernel may fill ahead of us.
const BUFFERS: u32 = 4;

/// How long to wait for a picture before the camera is taken for stuck.
const TIMEOUT: Duration = Duration::from_secs(2);

/// `ENODEV` of Linux (asm-generic/errno-base.h): what an unplugged camera answers.
const NO_SUCH_DEVICE: i32 = 19;

/// Formats in the order they are asked for: JPEG first, because two cameras share a bus.
const FORMATS: [(PixelFormat, &[u8; 4]); 3] =
    [(PixelFormat::Mjpg, b"MJPG"), (PixelFormat::Yuyv, b"YUYV"), (PixelFormat::Grey, b"GREY")];

/// A V4L2 node that streams pictures into mapped memory.
pub struct V4l2Pictures {
    node: PathBuf,
    side: Side,
    stream: Stream<'static>,
    layout: Layout,
}

impl V4l2Pictures {
    /// Opens `node`, asks for pictures of a size, and starts streaming.
    ///
    /// # Errors
    /// [`StereoDriverError::Device`] where a call fails, [`StereoDriverError::Format`] where the node has no such pictures.
    pub fn open(node: &Path, side: Side, width: u32, height: u32) -> Result<Self, StereoDriverError> {
        let failed = |action| move |source| StereoDriverError::Device { node: node.to_path_buf(), action, source };
        let format = |offered: String| StereoDriverError::Format { node: node.to_path_buf(), offered, width, height };
        let device = Device::with_path(node).map_err(failed("open it"))?;
        let offered: Vec<FourCC> =
            device.enum_formats().map_err(failed("list its formats"))?.iter().map(|f| f.fourcc).collect();
        let (chosen, code) = FORMATS
            .into_iter()
            .find(|(_, code)| offered.contains(&FourCC::new(code)))
            .ok_or_else(|| format(offered.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")))?;
        let asked = v4l::Format::new(width, height, FourCC::new(code));
        let given = device.set_format(&asked).map_err(failed("set its format"))?;
        if (given.width, given.height, given.fourcc) != (width, height, asked.fourcc) {
            return Err(format(format!("{} {}x{}", given.fourcc, given.width, given.height)));
        }
        let mut stream =
            Stream::with_buffers(&device, Type::VideoCapture, BUFFERS).map_err(failed("start streaming"))?;
        stream.set_timeout(TIMEOUT);
        let layout = Layout { format: chosen, width, height, stride: given.stride };
        Ok(Self { node: node.to_path_buf(), side, stream, layout })
    }
}

impl Pictures for V4l2Pictures {
    fn next_picture(&mut self) -> Result<Option<Picture>, StereoDriverError> {
        let (bytes, meta) = match self.stream.next() {
            Ok(buffer) => buffer,
            // An unplugged camera ends the take; it does not fail it.
            Err(error) if error.raw_os_error() == Some(NO_SUCH_DEVICE) => return Ok(None),
            Err(source) => {
                return Err(StereoDriverError::Device { node: self.node.clone(), action: "read a picture", source });
            }
        };
        let used = bytes.len().min(meta.bytesused as usize);
        let sequence = u64::from(meta.sequence);
        let image = decode::picture(&bytes[..used], self.layout).map_err(|reason| StereoDriverError::Picture {
            side: self.side,
            sequence,
            reason,
        })?;
        let time_ns = meta.timestamp.sec * 1_000_000_000 + meta.timestamp.usec * 1000;
        Ok(Some(Picture { image: Arc::new(image), sequence, time_ns, host_time_ns: host_time_ns() }))
    }

    fn is_live(&self) -> bool {
        true
    }
}

fn host_time_ns() -> i64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
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
    /// [`StereoDriverError::Recorded`] where there are none, or the rate is no rate.
    pub fn open(folder: &Path, prefix: &str, side: Side, fps: f64) -> Result<Self, StereoDriverError> {
        let wrong = |reason: String| StereoDriverError::Recorded { path: folder.to_path_buf(), reason };
        if !(fps.is_finite() && fps > 0.0) {
            return Err(wrong(format!("{fps} pictures a second is no rate")));
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
    fn a_node_that_is_not_there_is_named() {
        let error = V4l2Pictures::open(Path::new("/dev/video-none"), Side::Left, 640, 480).err().map(|e| e.to_string());
        assert!(error.is_some_and(|e| e.contains("/dev/video-none") && e.contains("open it")));
    }

    #[test]
    fn names_give_numbers() {
        assert_eq!(number(Path::new("a/left07.JPG"), "left"), Some(7));
        assert_eq!(number(Path::new("a/000120.png"), ""), Some(120));
        assert_eq!(number(Path::new("a/leftover.png"), "left"), None);
        assert_eq!(number(Path::new("a/left07.txt"), "left"), None);
    }
}
