//! The video nodes of a simulated bus: what `uvcvideo` makes of its devices, in this process and in bus time.
//!
//! A camera part has a node for pictures and one for metadata for each of its streams, numbered in the order of the bus,
//! as with Linux.

use std::path::{Path, PathBuf};

use super::{
    bus::SimulatedBus,
    device::Answer,
    node::SimulatedNode,
    plugged::Plugged,
    uvc::{self, Function, Streaming},
};
use crate::{
    Setup, TransportError,
    video::{NodeInfo, UsbPlace, Video, VideoNode},
};

/// The video nodes of a simulated bus.
#[derive(Clone)]
pub struct SimulatedVideo {
    bus: SimulatedBus,
    /// Metadata has whole headers, as where the kernel knows the camera's format (V4L2_META_FMT_D4XX).
    whole_headers: bool,
}

impl SimulatedVideo {
    /// The nodes of a bus, with the standard part of payload headers as metadata.
    pub fn new(bus: SimulatedBus) -> Self {
        Self { bus, whole_headers: false }
    }

    /// As a kernel that knows RealSense cameras: metadata nodes give whole headers where asked to.
    pub fn with_whole_headers(bus: SimulatedBus) -> Self {
        Self { bus, whole_headers: true }
    }

    fn nodes(&self) -> Vec<(NodeInfo, Plugged, Function, Streaming, bool)> {
        let mut nodes = Vec::new();
        for plugged in self.bus.plugged() {
            for function in uvc::functions(&configuration(&plugged)) {
                for stream in &function.streams {
                    for is_metadata in [false, true] {
                        let node = format!("/dev/video{}", nodes.len()).into();
                        let info = about(node, &plugged, &function);
                        nodes.push((info, plugged.clone(), function.clone(), stream.clone(), is_metadata));
                    }
                }
            }
        }
        nodes
    }
}

impl Video for SimulatedVideo {
    fn list(&self) -> Result<Vec<NodeInfo>, TransportError> {
        Ok(self.nodes().into_iter().map(|(info, ..)| info).collect())
    }

    fn open(&self, node: &Path) -> Result<Box<dyn VideoNode>, TransportError> {
        let found = self.nodes().into_iter().find(|(info, ..)| info.node == node);
        let missing = || TransportError::from_video(node, "open it", std::io::ErrorKind::NotFound.into());
        let (info, plugged, function, stream, is_metadata) = found.ok_or_else(missing)?;
        let whole_headers = self.whole_headers;
        Ok(Box::new(SimulatedNode::new(info, plugged, (function, stream), is_metadata, whole_headers)))
    }
}

fn configuration(plugged: &Plugged) -> Vec<u8> {
    let setup = Setup { request_type: 0x80, request: 0x06, value: 0x0200, index: 0, length: u16::MAX };
    match plugged.device().control(setup, &[]) {
        Answer::Data(bytes) => bytes,
        _ => Vec::new(),
    }
}

fn about(node: PathBuf, plugged: &Plugged, function: &Function) -> NodeInfo {
    let serial = plugged.device().info().serial;
    let info = &plugged.info;
    let place = UsbPlace {
        id: (info.vendor, info.product),
        address: info.address,
        speed: info.speed,
        interface: function.interface,
        serial,
    };
    NodeInfo { node, name: format!("{:04x}:{:04x}", info.vendor, info.product), usb: Some(place) }
}
