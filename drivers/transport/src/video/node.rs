//! Video nodes as a program sees them: a list, and open nodes.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use serde::Serialize;

use super::format::{FourCc, PictureLayout};
use crate::{LinkSpeed, TransportError};

/// The USB interface behind a node.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct UsbPlace {
    /// Vendor and product id.
    pub id: (u16, u16),
    /// Bus and address.
    pub address: (u8, u8),
    /// Speed of its link.
    pub speed: LinkSpeed,
    /// Number of the interface that controls the camera; nodes of one camera part share it.
    pub interface: u8,
    /// Serial number of the USB device; empty where it has none.
    pub serial: String,
}

/// A node, known without opening it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct NodeInfo {
    /// Such as `/dev/video2`.
    pub node: PathBuf,
    /// The driver's name for the camera.
    pub name: String,
    /// Where it is on USB; `None` for other cameras.
    pub usb: Option<UsbPlace>,
}

/// The buffers that the driver filled. Those of which it knows that bytes are missing are kept from callers; their numbers are
/// missing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VideoBuffer {
    /// The picture, or metadata.
    pub bytes: Vec<u8>,
    /// The driver's number; those left out were lost.
    pub sequence: u32,
    /// The host's monotonic clock at the picture's first byte, nanoseconds.
    pub time_ns: i64,
}

/// All video nodes of a machine.
pub trait Video: Send + Sync {
    /// The nodes that are there now, in the order of their numbers.
    ///
    /// # Errors
    /// [`TransportError::Video`] where the list cannot be read at all.
    fn list(&self) -> Result<Vec<NodeInfo>, TransportError>;

    /// Opens a node.
    ///
    /// # Errors
    /// [`TransportError::NodePermission`], [`TransportError::Video`].
    fn open(&self, node: &Path) -> Result<Box<dyn VideoNode>, TransportError>;
}

/// An open node. Dropping it stops it. After an unplug all calls fail with [`TransportError::Unplugged`].
pub trait VideoNode: Send {
    /// True where it carries metadata of another node's pictures instead of pictures.
    fn is_metadata(&self) -> bool;

    /// The driver's name for the camera.
    fn name(&self) -> &str;

    /// Formats on offer, in the driver's order; for metadata nodes the list is empty.
    ///
    /// # Errors
    /// [`TransportError::Video`].
    fn formats(&self) -> Result<Vec<FourCc>, TransportError>;

    /// Columns and rows on offer in a format; for a node that has any size the list is empty.
    ///
    /// # Errors
    /// [`TransportError::Video`].
    fn sizes(&self, format: FourCc) -> Result<Vec<(u32, u32)>, TransportError>;

    /// Asks for pictures of a kind and size (metadata nodes: the kind alone); returns what the driver gives, which may
    /// be something else.
    ///
    /// # Errors
    /// [`TransportError::Video`].
    fn set_format(&mut self, format: FourCc, width: u32, height: u32) -> Result<PictureLayout, TransportError>;

    /// Asks for this many pictures a second; returns what the driver gives.
    ///
    /// # Errors
    /// [`TransportError::Video`].
    fn set_rate(&mut self, fps: u32) -> Result<f64, TransportError>;

    /// Starts streaming into this many buffers.
    ///
    /// # Errors
    /// [`TransportError::Video`].
    fn start(&mut self, buffers: u32) -> Result<(), TransportError>;

    /// The next buffer that is full.
    ///
    /// # Errors
    /// [`TransportError::TimedOut`] where none is in time (the stream goes on), [`TransportError::Video`].
    fn next_buffer(&mut self, limit: Duration) -> Result<VideoBuffer, TransportError>;

    /// Stops streaming; buffers that are full are given up.
    fn stop(&mut self);

    /// A control's value.
    ///
    /// # Errors
    /// [`TransportError::Video`] where there is no such control.
    fn control(&self, id: u32) -> Result<i64, TransportError>;

    /// Sets a control.
    ///
    /// # Errors
    /// As [`Self::control`].
    fn set_control(&mut self, id: u32, value: i64) -> Result<(), TransportError>;

    /// Reads `data.len()` bytes from an extension unit: what its selector has by the UVC request GET_LEN.
    ///
    /// # Errors
    /// [`TransportError::Stalled`], [`TransportError::Video`].
    fn extension_get(&mut self, unit: u8, selector: u8, data: &mut [u8]) -> Result<(), TransportError>;

    /// Writes to an extension unit.
    ///
    /// # Errors
    /// As [`Self::extension_get`].
    fn extension_set(&mut self, unit: u8, selector: u8, data: &[u8]) -> Result<(), TransportError>;
}
