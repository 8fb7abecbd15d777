//! Cameras on USB and their video nodes.

use std::path::PathBuf;

use serde::Serialize;
use toile_driver_transport::{
    LinkSpeed, TransportError,
    known::{self, Family},
    video::{FourCc, UsbPlace, Video},
};

use crate::RealsenseError;

/// Products without a camera part for colour: `rs400_device`, `rs410_device` and `rs405_device` of librealsense
/// `src/ds/d400/d400-factory.cpp` (the D405 can send colour in the place of infrared, which is not asked for here).
const WITHOUT_COLOR: [u16; 3] = [0x0ad1, 0x0ad2, 0x0b5b];

/// A node for pictures and the one that carries their metadata, where the kernel has one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Nodes {
    /// Pictures.
    pub pictures: PathBuf,
    /// Metadata of the same pictures.
    pub metadata: Option<PathBuf>,
}

/// A camera that is plugged in.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Camera {
    /// The name that people use.
    pub name: &'static str,
    /// Vendor and product id.
    pub id: (u16, u16),
    /// Bus and address.
    pub address: (u8, u8),
    /// Speed of its link.
    pub speed: LinkSpeed,
    /// Serial number of the USB device (the camera's own is stated by [`crate::Realsense`]).
    pub serial: String,
    /// Depth (Z16).
    pub depth: Option<Nodes>,
    /// The infrared pair (Y8I or GREY).
    pub infrared: Option<Nodes>,
    /// Colour (YUYV), of another camera part than depth.
    pub color: Option<Nodes>,
}

impl Camera {
    /// True where such cameras have a part for colour.
    pub fn has_color_part(&self) -> bool {
        !WITHOUT_COLOR.contains(&self.id.1)
    }
}

/// The cameras that are plugged in, in the order of their first nodes. Nodes that cannot be opened are left out
/// (`refusal` says why).
///
/// # Errors
/// [`RealsenseError::Transport`] where nodes cannot be listed at all.
pub fn list(video: &dyn Video) -> Result<Vec<Camera>, RealsenseError> {
    let mut cameras: Vec<Camera> = Vec::new();
    // A metadata node follows the node of its pictures (`uvc_register_chains` of Linux' uvcvideo).
    let mut last: Option<((u8, u8), u8, Part)> = None;
    for info in video.list()? {
        let Some(place) = info.usb else { continue };
        let Some(name) = name(&place) else { continue };
        let index = cameras.iter().position(|c| c.address == place.address).unwrap_or_else(|| {
            cameras.push(camera(name, &place));
            cameras.len() - 1
        });
        let Ok(node) = video.open(&info.node) else {
            last = None;
            continue;
        };
        let camera = &mut cameras[index];
        if node.is_metadata() {
            if let Some((address, interface, part)) = last.take()
                && (address, interface) == (place.address, place.interface)
            {
                part.of(camera).iter_mut().for_each(|nodes| nodes.metadata = Some(info.node.clone()));
            }
            continue;
        }
        let part = Part::from_formats(&node.formats().unwrap_or_default());
        last = part.map(|part| (place.address, place.interface, part));
        if let Some(part) = part {
            part.of(camera).get_or_insert(Nodes { pictures: info.node, metadata: None });
        }
    }
    Ok(cameras)
}

/// Why a node of this camera cannot be opened; `None` where all can.
pub fn refusal(video: &dyn Video, camera: &Camera) -> Option<TransportError> {
    let nodes = video.list().unwrap_or_default().into_iter();
    let its = nodes.filter(|info| info.usb.as_ref().is_some_and(|usb| usb.address == camera.address));
    its.map(|info| video.open(&info.node)).find_map(Result::err)
}

/// The content of a node.
#[derive(Clone, Copy)]
enum Part {
    Depth,
    Infrared,
    Color,
}

impl Part {
    fn from_formats(offered: &[FourCc]) -> Option<Self> {
        let has = |format| offered.contains(&format);
        if has(FourCc::Z16) {
            Some(Self::Depth)
        } else if has(FourCc::Y8I) || has(FourCc::GREY) {
            Some(Self::Infrared)
        } else {
            has(FourCc::YUYV).then_some(Self::Color)
        }
    }

    fn of(self, camera: &mut Camera) -> &mut Option<Nodes> {
        match self {
            Self::Depth => &mut camera.depth,
            Self::Infrared => &mut camera.infrared,
            Self::Color => &mut camera.color,
        }
    }
}

fn name(place: &UsbPlace) -> Option<&'static str> {
    known::find(place.id.0, place.id.1).filter(|known| known.family == Family::Realsense).map(|known| known.name)
}

fn camera(name: &'static str, place: &UsbPlace) -> Camera {
    Camera {
        name,
        id: place.id,
        address: place.address,
        speed: place.speed,
        serial: place.serial.clone(),
        depth: None,
        infrared: None,
        color: None,
    }
}
