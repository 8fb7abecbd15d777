//! The cameras that are plugged in, each once, as what it is driven as.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use serde::Serialize;
use toile_driver_realsense as realsense;
use toile_driver_stereo::{self as stereo, nodes::WideNode};
use toile_driver_transport::{
    TransportError,
    known::{self, Family},
    usb::{self, UsbCamera},
    video::{NodeInfo, Video, kernel::KernelVideo},
};
use toile_driver_uvc_depth::nodes::{self, DepthNode};
use toile_driver_webcam as webcam;

/// The cameras that are plugged in, each once, and what is wrong with them.
#[derive(Debug, Default)]
pub struct Listing {
    /// On the USB.
    pub usb: Vec<UsbCamera>,
    /// RealSense cameras with their video nodes.
    pub realsense: Vec<realsense::Camera>,
    /// Depth cameras that are plain video nodes.
    pub uvc_depth: Vec<DepthNode>,
    /// Cameras with very wide pictures: perhaps two views side by side.
    pub wide: Vec<WideNode>,
    /// Webcams by index.
    pub webcams: Vec<(u32, String)>,
    /// What is wrong, a sentence each.
    pub warnings: Vec<String>,
}

/// A camera as it can be chosen.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundDevice {
    /// What [`crate::Device`] parses.
    pub id: String,
    /// Its name for people.
    pub name: String,
    /// `virtual`, `kinect1`, `kinect2`, `realsense`, `uvc`, `stereo` or `webcam`.
    pub kind: &'static str,
    /// It can be opened as it stands; others need a file that says more of them.
    pub usable: bool,
    /// Why it cannot be used, or cannot be used well.
    pub problem: Option<String>,
    /// Where it is.
    pub detail: String,
}

impl Listing {
    /// Each kind of bus is asked by itself: that one cannot be read must not hide the others.
    pub fn now() -> Self {
        let mut warnings = Vec::new();
        let usb = usb::list().unwrap_or_else(|e| warn(&mut warnings, &e));
        let webcams = webcam::list().unwrap_or_else(|e| warn(&mut warnings, &e));
        Self { warnings, ..Self::of(usb, webcams, &KernelVideo::default()) }
    }

    /// Of what USB, webcams and video nodes say, each camera once.
    pub fn of(usb: Vec<UsbCamera>, webcams: Vec<(u32, String)>, video: &dyn Video) -> Self {
        let mut listing = Self::default();
        let cameras = realsense::list(video).unwrap_or_else(|e| warn(&mut listing.warnings, &e));
        let mut listed = nodes_already_listed(video);
        let nodes: Vec<DepthNode> = nodes::list(video).into_iter().filter(|n| !listed.contains(&n.node)).collect();
        listed.extend(nodes.iter().map(|n| n.node.clone()));
        let wide: Vec<WideNode> =
            stereo::nodes::list(video).into_iter().filter(|n| !listed.contains(&n.node)).collect();
        listed.extend(wide.iter().map(|n| n.node.clone()));
        let is_new = |(index, _): &(u32, String)| !listed.contains(Path::new(&format!("/dev/video{index}")));
        let webcams: Vec<(u32, String)> = webcams.into_iter().filter(is_new).collect();
        let refused = refused(video);
        if refused.is_empty() {
            listing.warnings.extend(cameras.iter().filter_map(missing_nodes));
        }
        listing.warnings.extend(refused);
        for camera in &usb {
            listing.warnings.extend(camera.problems.iter().map(|p| format!("{}: {p}", camera.name)));
        }
        Self { usb, realsense: cameras, uvc_depth: nodes, wide, webcams, warnings: listing.warnings }
    }

    /// All of them as they can be chosen, the virtual person first.
    pub fn devices(&self) -> Vec<FoundDevice> {
        let found = |id: String, name: &str, kind, problem: Option<String>, detail: String| FoundDevice {
            usable: problem.is_none(),
            name: name.into(),
            id,
            kind,
            problem,
            detail,
        };
        let what = "for practice: turns for ever, 30 frames a second".to_string();
        let mut all = vec![found("virtual".into(), "Virtual person", "virtual", None, what)];
        let place = |(bus, address): (u8, u8)| format!("usb {bus:03}:{address:03}");
        for camera in &self.usb {
            let kind = match camera.family {
                Family::Kinect1 => "kinect1",
                Family::Kinect2 => "kinect2",
                _ => continue,
            };
            let problem = camera.problems.first().cloned();
            all.push(found(kind.into(), camera.name, kind, problem, place(camera.address)));
        }
        for camera in &self.realsense {
            let id = format!("realsense:{}", camera.serial);
            let (problem, detail) = (missing_nodes(camera), place(camera.address));
            all.push(found(id, camera.name, "realsense", problem, detail));
        }
        let needs =
            |file: &str| Some(format!("needs {file}: record with `toile capture` (docs/devices.md has the file)"));
        for node in &self.uvc_depth {
            let (id, detail) = (format!("uvc:{},", node.node.display()), node.node.display().to_string());
            all.push(found(id, &node.name, "uvc", needs("a calibration"), detail));
        }
        for node in &self.wide {
            let detail = node.node.display().to_string();
            all.push(found(
                format!("stereo:{detail}"),
                &node.name,
                "stereo",
                needs("the file of a stereo rig"),
                detail,
            ));
        }
        for (index, name) in &self.webcams {
            let problem = Some("colour only: it goes beside a depth camera (`--color`)".to_string());
            all.push(found(format!("webcam:{index}"), name, "webcam", problem, format!("webcam {index}")));
        }
        all
    }
}

/// Nodes of cameras that are listed with their USB device (also those that the kernel's own Kinect driver makes), and
/// nodes without pictures.
fn nodes_already_listed(video: &dyn Video) -> BTreeSet<PathBuf> {
    let is_driven = |info: &NodeInfo| {
        let known = info.usb.as_ref().and_then(|usb| known::find(usb.id.0, usb.id.1));
        known.is_some_and(|known| known.family != Family::Orbbec)
    };
    let is_metadata = |info: &NodeInfo| video.open(&info.node).is_ok_and(|node| node.is_metadata());
    let nodes = video.list().unwrap_or_default().into_iter();
    nodes.filter(|info| is_driven(info) || is_metadata(info)).map(|info| info.node).collect()
}

/// Nodes that may not be opened, with what to do; once for a camera.
fn refused(video: &dyn Video) -> Vec<String> {
    let mut listed = BTreeSet::new();
    let nodes = video.list().unwrap_or_default().into_iter();
    let refused = nodes.filter_map(|info| match video.open(&info.node) {
        Err(error @ TransportError::NodePermission { .. }) => {
            Some((info.usb.map(|usb| usb.address), error.to_string()))
        }
        _ => None,
    });
    refused.filter(|(address, _)| address.is_none() || listed.insert(*address)).map(|(_, words)| words).collect()
}

fn warn<T>(warnings: &mut Vec<String>, error: &dyn std::fmt::Display) -> Vec<T> {
    warnings.push(error.to_string());
    Vec::new()
}

/// The missing parts of a RealSense camera, in a sentence.
pub fn missing_nodes(camera: &realsense::Camera) -> Option<String> {
    let no_color = camera.color.is_none() && camera.has_color_part();
    let parts = [("depth", camera.depth.is_none()), ("infrared", camera.infrared.is_none()), ("colour", no_color)];
    let missing: Vec<&str> = parts.into_iter().filter(|(_, is_missing)| *is_missing).map(|(name, _)| name).collect();
    let missing = (!missing.is_empty()).then(|| missing.join(" and "))?;
    Some(format!("{}: the video node for {missing} is missing: unplug it and plug it in again", camera.name))
}
