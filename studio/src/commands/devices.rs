//! `toile devices`: what is plugged in, at which speed, and what is wrong with it.

use std::path::Path;

use serde_json::{Value, json};
use toile_driver_realsense as realsense;
use toile_driver_stereo as stereo;
use toile_driver_transport::{
    udev,
    usb::{self, UsbCamera},
    video::kernel::KernelVideo,
};
use toile_driver_uvc_depth::nodes::{self, DepthNode};
use toile_driver_webcam as webcam;

use crate::{StudioError, outcome::Answer, run::Session};

const AFTER: &str = "\
`toile capture` records from both Kinects, RealSense D4xx, UVC depth cameras (Z16, Y16) and stereo rigs.
A camera with very wide pictures may be a stereo camera with both views side by side (docs/devices.md).

Examples:
  toile devices
  sudo toile devices --install-udev-rules";

/// Tell which cameras are plugged in, at which speed, and what is wrong with them
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Devices {
    /// Write the udev rule that lets the logged-in user open the cameras (as root)
    #[arg(long)]
    install_udev_rules: bool,
}

impl Devices {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where the rule cannot be written.
    pub fn run(&self, _session: &Session) -> Result<Answer, StudioError> {
        if self.install_udev_rules { install() } else { Ok(list()) }
    }
}

fn install() -> Result<Answer, StudioError> {
    let path = udev::install(Path::new(udev::RULES_FOLDER)).map_err(|e| StudioError::Device(e.to_string()))?;
    let text =
        format!("{}\nRun `udevadm control --reload` (as root), then plug the cameras in again.\n", path.display());
    Ok(Answer { text, results: json!({ "rule": path }), ..Answer::default() })
}

/// Each kind of bus is asked by itself: that one cannot be read must not hide the others.
fn list() -> Answer {
    let mut answer = Answer::default();
    let usb = usb::list().unwrap_or_else(|e| warn(&mut answer, &e));
    let video = KernelVideo::default();
    let cameras = realsense::list(&video).unwrap_or_else(|e| warn(&mut answer, &e));
    // A RealSense camera's depth node speaks Z16 too, but is driven with its own calibration.
    let is_realsense = |node: &Path| cameras.iter().any(|c| c.depth.as_ref().is_some_and(|n| n.pictures == node));
    let nodes: Vec<DepthNode> = nodes::list(&video).into_iter().filter(|n| !is_realsense(&n.node)).collect();
    let wide = stereo::nodes::list(&video);
    let webcams = webcam::list().unwrap_or_else(|e| warn(&mut answer, &e));
    answer.text = text(&usb, &nodes, &webcams, &realsense_lines(&cameras, &mut answer.warnings), &wide);
    for camera in &usb {
        answer.warnings.extend(camera.problems.iter().map(|p| format!("{}: {p}", camera.name)));
    }
    answer.results = json!({
        "usb": usb,
        "realsense": cameras,
        "stereo": wide.iter().map(|n| json!({ "node": n.node, "name": n.name, "size": n.size })).collect::<Vec<Value>>(),
        "uvc_depth": nodes.iter().map(|n| json!({ "node": n.node, "name": n.name })).collect::<Vec<Value>>(),
        "webcams": webcams.iter().map(|(i, name)| json!({ "index": i, "name": name })).collect::<Vec<Value>>(),
    });
    answer
}

fn warn<T>(answer: &mut Answer, error: &dyn std::fmt::Display) -> Vec<T> {
    answer.warnings.push(error.to_string());
    Vec::new()
}

/// Where each RealSense camera's streams are, and which it lacks.
fn realsense_lines(cameras: &[realsense::Camera], warnings: &mut Vec<String>) -> Vec<String> {
    let line = |camera: &realsense::Camera| {
        let parts = [("depth", &camera.depth), ("infrared", &camera.infrared), ("colour", &camera.color)];
        let missing: Vec<&str> = parts.iter().filter(|(_, nodes)| nodes.is_none()).map(|(name, _)| *name).collect();
        if !missing.is_empty() {
            let missing = missing.join(" and ");
            warnings.push(format!("{}: no video node for {missing}: unplug it and plug it in again", camera.name));
        }
        let nodes = parts.iter().filter_map(|(name, nodes)| Some((name, nodes.as_ref()?)));
        let nodes: Vec<String> = nodes.map(|(name, n)| format!("{name} {}", n.pictures.display())).collect();
        format!("{} {}: {}", camera.name, camera.serial, nodes.join(", "))
    };
    cameras.iter().map(line).collect()
}

fn text(
    usb: &[UsbCamera],
    nodes: &[DepthNode],
    webcams: &[(u32, String)],
    realsense: &[String],
    wide: &[stereo::nodes::WideNode],
) -> String {
    let mut lines: Vec<String> = usb
        .iter()
        .map(|c| format!("usb {:03}:{:03}  {} ({:?} speed)", c.address.0, c.address.1, c.name, c.speed))
        .collect();
    lines.extend(realsense.iter().cloned());
    lines.extend(nodes.iter().map(|n| format!("{}  {} (depth)", n.node.display(), n.name)));
    lines.extend(wide.iter().map(|n| {
        let (width, height) = n.size;
        format!("{}  {} ({width}x{height}: two views side by side?)", n.node.display(), n.name)
    }));
    lines.extend(webcams.iter().map(|(index, name)| format!("webcam {index}  {name}")));
    if lines.is_empty() {
        lines.push("No camera is plugged in.".into());
    }
    lines.join("\n") + "\n"
}
