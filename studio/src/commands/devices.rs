//! `toile devices`: what is plugged in, at which speed, and what is wrong with it.

use std::path::Path;

use serde_json::{Value, json};
use toile_driver_transport::{
    udev,
    usb::{self, UsbCamera},
    video::kernel::KernelVideo,
};
use toile_driver_uvc_depth::nodes::{self, DepthNode};
use toile_driver_webcam as webcam;

use crate::{StudioError, outcome::Answer, run::Session};

const AFTER: &str = "\
`toile capture` records from the Kinect v1 and from UVC depth cameras (Z16, Y16); Kinect v2 and RealSense are only listed.

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
    let nodes = nodes::list(&KernelVideo::default());
    let webcams = webcam::list().unwrap_or_else(|e| warn(&mut answer, &e));
    answer.text = text(&usb, &nodes, &webcams);
    for camera in &usb {
        answer.warnings.extend(camera.problems.iter().map(|p| format!("{}: {p}", camera.name)));
    }
    answer.results = json!({
        "usb": usb,
        "uvc_depth": nodes.iter().map(|n| json!({ "node": n.node, "name": n.name })).collect::<Vec<Value>>(),
        "webcams": webcams.iter().map(|(i, name)| json!({ "index": i, "name": name })).collect::<Vec<Value>>(),
    });
    answer
}

fn warn<T>(answer: &mut Answer, error: &dyn std::fmt::Display) -> Vec<T> {
    answer.warnings.push(error.to_string());
    Vec::new()
}

fn text(usb: &[UsbCamera], nodes: &[DepthNode], webcams: &[(u32, String)]) -> String {
    let mut lines: Vec<String> = usb
        .iter()
        .map(|c| format!("usb {:03}:{:03}  {} ({:?} speed)", c.address.0, c.address.1, c.name, c.speed))
        .collect();
    lines.extend(nodes.iter().map(|n| format!("{}  {} (depth)", n.node.display(), n.name)));
    lines.extend(webcams.iter().map(|(index, name)| format!("webcam {index}  {name}")));
    if lines.is_empty() {
        lines.push("No camera is plugged in.".into());
    }
    lines.join("\n") + "\n"
}
