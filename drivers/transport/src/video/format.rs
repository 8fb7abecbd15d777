//! Pixel formats, and how the pictures of a node are laid out.

use std::fmt;

/// Code of a pixel format (`linux/videodev2.h`).
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct FourCc(pub [u8; 4]);

impl FourCc {
    /// Depth, 16 bits (V4L2_PIX_FMT_Z16).
    pub const Z16: Self = Self(*b"Z16 ");
    /// Grey, 16 bits (V4L2_PIX_FMT_Y16).
    pub const Y16: Self = Self(*b"Y16 ");
    /// Grey, 8 bits (V4L2_PIX_FMT_GREY).
    pub const GREY: Self = Self(*b"GREY");
    /// Grey of two cameras, 8 bits each, left and right in turn (V4L2_PIX_FMT_Y8I).
    pub const Y8I: Self = Self(*b"Y8I ");
    /// Brightness of every pixel, colour of every second (V4L2_PIX_FMT_YUYV).
    pub const YUYV: Self = Self(*b"YUYV");
    /// A JPEG a picture (V4L2_PIX_FMT_MJPEG).
    pub const MJPG: Self = Self(*b"MJPG");
    /// Standard header of UVC payloads (V4L2_META_FMT_UVC).
    pub const UVC_HEADER: Self = Self(*b"UVCH");
    /// Whole header of UVC payloads as RealSense cameras send it (V4L2_META_FMT_D4XX).
    pub const D4XX: Self = Self(*b"D4XX");
}

impl fmt::Display for FourCc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", String::from_utf8_lossy(&self.0).trim_end())
    }
}

impl fmt::Debug for FourCc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// How a node's pictures are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PictureLayout {
    /// Their content.
    pub format: FourCc,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes from one row to the next; 0 where there are no rows (JPEG, metadata).
    pub stride: u32,
}
