//! The video nodes of this machine, over V4L2.
//!
//! The extension units' request is `UVCIOC_CTRL_QUERY` of `linux/uvcvideo.h`, which `v4l` does not have.
#![allow(unsafe_code)]

use std::{
    ffi::c_void,
    io, mem,
    os::unix::ffi::OsStrExt,
    path::{Path, PathBuf},
    ptr,
    time::Duration,
};

use v4l::{
    Device, Format, FourCC as RawCode, capability,
    control::{Control, Value},
    framesize::FrameSizeEnum,
    v4l_sys::v4l2_format,
    v4l2::{self, vidioc},
    video::{Capture, capture::Parameters},
};

use super::{
    format::{FourCc, PictureLayout},
    mapped::Mapped,
    node::{NodeInfo, Video, VideoBuffer, VideoNode},
    sysfs,
};
use crate::{TransportError, udev::advice};

/// V4L2_BUF_TYPE_VIDEO_CAPTURE and _META_CAPTURE; V4L2_CAP_META_CAPTURE.
const VIDEO_CAPTURE: u32 = 1;
const META_CAPTURE: u32 = 13;
const CAN_META_CAPTURE: u32 = 0x0080_0000;
/// Requests of the UVC specification 1.1, table A-8.
const SET_CUR: u8 = 0x01;
const GET_CUR: u8 = 0x81;
/// `_IOWR('u', 0x21, struct uvc_xu_control_query)` with its 16 bytes.
const UVCIOC_CTRL_QUERY: vidioc::_IOC_TYPE = (3 << 30) | (16 << 16) | (0x75 << 8) | 0x21;
/// Errors as Linux numbers them.
const EPIPE: i32 = 32;
const EREMOTEIO: i32 = 121;

/// `struct uvc_xu_control_query` (`linux/uvcvideo.h`).
#[repr(C)]
struct ExtensionQuery {
    unit: u8,
    selector: u8,
    query: u8,
    size: u16,
    data: *mut c_void,
}

/// The video nodes of this machine.
#[derive(Debug, Clone)]
pub struct KernelVideo {
    sysfs: PathBuf,
}

impl Default for KernelVideo {
    fn default() -> Self {
        Self { sysfs: "/sys".into() }
    }
}

impl Video for KernelVideo {
    fn list(&self) -> Result<Vec<NodeInfo>, TransportError> {
        sysfs::nodes(&self.sysfs)
    }

    fn open(&self, node: &Path) -> Result<Box<dyn VideoNode>, TransportError> {
        let vendor = || {
            let nodes = sysfs::nodes(&self.sysfs).unwrap_or_default();
            nodes.into_iter().find(|n| n.node == node).and_then(|n| n.usb).map_or(0, |usb| usb.id.0)
        };
        match KernelNode::open(node) {
            Err(TransportError::Video { source, .. }) if source.kind() == io::ErrorKind::PermissionDenied => {
                Err(TransportError::NodePermission { node: node.into(), advice: advice(vendor()) })
            }
            other => Ok(Box::new(other?)),
        }
    }
}

struct KernelNode {
    node: PathBuf,
    name: String,
    device: Device,
    is_metadata: bool,
    stream: Option<Mapped>,
}

impl KernelNode {
    fn open(node: &Path) -> Result<Self, TransportError> {
        let failed = |action| move |source| TransportError::from_video(node, action, source);
        // `v4l` panics on it.
        if node.as_os_str().as_bytes().contains(&0) {
            return Err(failed("open it")(io::ErrorKind::InvalidInput.into()));
        }
        let device = Device::with_path(node).map_err(failed("open it"))?;
        let about = device.query_caps().map_err(failed("ask what it is"))?;
        let is_metadata = about.capabilities.contains(META_CAPTURE_FLAG);
        Ok(Self { node: node.into(), name: about.card, device, is_metadata, stream: None })
    }

    fn failed(&self, action: &'static str) -> impl Fn(io::Error) -> TransportError {
        move |source| TransportError::from_video(&self.node, action, source)
    }

    fn set_metadata_format(&self, format: FourCc) -> io::Result<FourCc> {
        // SAFETY: a structure of numbers, for which zero is a value.
        let mut about: v4l2_format = unsafe { mem::zeroed() };
        about.type_ = META_CAPTURE;
        about.fmt.meta.dataformat = u32::from_le_bytes(format.0);
        // SAFETY: the structure is what VIDIOC_S_FMT was defined with, and outlives the call.
        unsafe { v4l2::ioctl(self.device.handle().fd(), vidioc::VIDIOC_S_FMT, ptr::from_mut(&mut about).cast())? };
        // SAFETY: `meta` is the member that belongs to this type of buffer.
        Ok(FourCc(unsafe { about.fmt.meta.dataformat }.to_le_bytes()))
    }

    fn extension(&self, unit: u8, selector: u8, query: u8, data: &mut [u8]) -> Result<(), TransportError> {
        let size = u16::try_from(data.len()).unwrap_or(u16::MAX);
        let mut request = ExtensionQuery { unit, selector, query, size, data: data.as_mut_ptr().cast() };
        // SAFETY: the structure is what the request was defined with; `data` has at least `size` bytes and outlives it.
        let answer =
            unsafe { v4l2::ioctl(self.device.handle().fd(), UVCIOC_CTRL_QUERY, ptr::from_mut(&mut request).cast()) };
        answer.map_err(|source| match source.raw_os_error() {
            Some(EPIPE | EREMOTEIO) => {
                TransportError::Stalled { what: format!("extension unit {unit}, control {selector}") }
            }
            _ => TransportError::from_video(&self.node, "ask its extension unit", source),
        })
    }
}

/// `v4l` knows this bit by the same name.
const META_CAPTURE_FLAG: capability::Flags = capability::Flags::from_bits_truncate(CAN_META_CAPTURE);

impl VideoNode for KernelNode {
    fn is_metadata(&self) -> bool {
        self.is_metadata
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn formats(&self) -> Result<Vec<FourCc>, TransportError> {
        if self.is_metadata {
            return Ok(Vec::new());
        }
        let offered = self.device.enum_formats().map_err(self.failed("list its formats"))?;
        Ok(offered.into_iter().map(|format| FourCc(format.fourcc.repr)).collect())
    }

    fn sizes(&self, format: FourCc) -> Result<Vec<(u32, u32)>, TransportError> {
        let offered = self.device.enum_framesizes(RawCode::new(&format.0)).map_err(self.failed("list its sizes"))?;
        let discrete = offered.into_iter().filter_map(|offer| match offer.size {
            FrameSizeEnum::Discrete(size) => Some((size.width, size.height)),
            FrameSizeEnum::Stepwise(_) => None,
        });
        Ok(discrete.collect())
    }

    fn set_format(&mut self, format: FourCc, width: u32, height: u32) -> Result<PictureLayout, TransportError> {
        if self.is_metadata {
            let format = self.set_metadata_format(format).map_err(self.failed("set its format"))?;
            return Ok(PictureLayout { format, width: 0, height: 0, stride: 0 });
        }
        let asked = Format::new(width, height, RawCode::new(&format.0));
        let given = self.device.set_format(&asked).map_err(self.failed("set its format"))?;
        let Format { width, height, stride, fourcc, .. } = given;
        Ok(PictureLayout { format: FourCc(fourcc.repr), width, height, stride })
    }

    fn set_rate(&mut self, fps: u32) -> Result<f64, TransportError> {
        let given = self.device.set_params(&Parameters::with_fps(fps)).map_err(self.failed("set its rate"))?;
        let interval = given.interval;
        Ok(f64::from(interval.denominator) / f64::from(interval.numerator.max(1)))
    }

    fn start(&mut self, buffers: u32) -> Result<(), TransportError> {
        self.stop();
        let kind = if self.is_metadata { META_CAPTURE } else { VIDEO_CAPTURE };
        let started = Mapped::start(self.device.handle(), kind, buffers);
        self.stream = Some(started.map_err(self.failed("start streaming"))?);
        Ok(())
    }

    fn next_buffer(&mut self, limit: Duration) -> Result<VideoBuffer, TransportError> {
        let Some(stream) = &mut self.stream else {
            return Err(TransportError::from_video(&self.node, "read from it", io::ErrorKind::NotConnected.into()));
        };
        stream.next(limit).map_err(|source| match source.kind() {
            io::ErrorKind::TimedOut => TransportError::TimedOut {
                what: format!("waiting for a picture of {}", self.node.display()),
                waited: limit,
            },
            _ => TransportError::from_video(&self.node, "read from it", source),
        })
    }

    fn stop(&mut self) {
        self.stream = None;
    }

    fn control(&self, id: u32) -> Result<i64, TransportError> {
        match self.device.control(id).map_err(self.failed("read a control"))?.value {
            Value::Integer(value) => Ok(value),
            Value::Boolean(value) => Ok(value.into()),
            _ => Err(TransportError::from_video(&self.node, "read a control", io::ErrorKind::InvalidData.into())),
        }
    }

    fn set_control(&mut self, id: u32, value: i64) -> Result<(), TransportError> {
        self.device.set_control(Control { id, value: Value::Integer(value) }).map_err(self.failed("set a control"))
    }

    fn extension_get(&mut self, unit: u8, selector: u8, data: &mut [u8]) -> Result<(), TransportError> {
        self.extension(unit, selector, GET_CUR, data)
    }

    fn extension_set(&mut self, unit: u8, selector: u8, data: &[u8]) -> Result<(), TransportError> {
        self.extension(unit, selector, SET_CUR, &mut data.to_vec())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_that_is_not_there_is_named() {
        let error = KernelVideo::default().open(Path::new("/dev/video-none")).err().map(|e| e.to_string());
        assert!(error.is_some_and(|e| e.contains("/dev/video-none") && e.contains("open it")));
    }

    #[test]
    fn what_the_kernel_is_asked_with_is_as_long_as_the_kernel_thinks() {
        assert_eq!(mem::size_of::<ExtensionQuery>(), 16);
        assert_eq!(mem::offset_of!(ExtensionQuery, size), 4);
        assert_eq!(mem::offset_of!(ExtensionQuery, data), 8);
    }
}
