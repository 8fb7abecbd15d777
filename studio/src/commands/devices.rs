//! `toile devices`: the cameras that are plugged in, their speed, and their problems.

use std::path::Path;

use serde_json::{Value, json};
use toile_capture::printable_path;
use toile_driver_realsense as realsense;
use toile_driver_stereo::nodes::WideNode;
use toile_driver_transport::{
    udev,
    usb::UsbCamera,
    video::{Video, kernel::KernelVideo},
};
use toile_driver_uvc_depth::nodes::DepthNode;
use toile_live::{DeviceError, Listing, LiveError};

use crate::{StudioError, outcome::Answer, session::Session};

const AFTER: &str = "\
`toile capture` records from both Kinects, RealSense D4xx, UVC depth cameras (Z16, Y16) and stereo rigs.
A camera with very wide pictures may be a stereo camera with both views side by side (docs/devices.md).

Examples:
  toile devices
  sudo toile devices --install-udev-rules";

/// List the cameras that are plugged in, their speed, and their problems
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
        if self.install_udev_rules { install() } else { Ok(list(Listing::now())) }
    }
}

fn install() -> Result<Answer, StudioError> {
    let nodes = KernelVideo::default().list().unwrap_or_default();
    let vendors: Vec<u16> = nodes.into_iter().filter_map(|node| Some(node.usb?.id.0)).collect();
    let path =
        udev::install(Path::new(udev::RULES_FOLDER), &vendors).map_err(|e| LiveError::from(DeviceError::from(e)))?;
    let text = format!(
        "{}\nRun `udevadm control --reload` (as root), then plug the cameras in again.\n",
        printable_path(&path)
    );
    Ok(Answer { text, results: json!({ "rule": printable_path(&path) }), ..Answer::default() })
}

/// Lists every camera once, as what `toile capture` drives it as.
fn list(listing: Listing) -> Answer {
    let Listing { usb, realsense, uvc_depth, wide, webcams, warnings } = listing;
    let text = text(&usb, &realsense, &uvc_depth, &wide, &webcams);
    let results = json!({
        "usb": usb,
        "realsense": realsense,
        "stereo": wide.iter().map(|n| json!({ "node": n.node, "name": n.name, "size": n.size })).collect::<Vec<Value>>(),
        "uvc_depth": uvc_depth.iter().map(|n| json!({ "node": n.node, "name": n.name })).collect::<Vec<Value>>(),
        "webcams": webcams.iter().map(|(i, name)| json!({ "index": i, "name": name })).collect::<Vec<Value>>(),
    });
    Answer { text, results, warnings, ..Answer::default() }
}

fn text(
    usb: &[UsbCamera],
    realsense: &[realsense::Camera],
    nodes: &[DepthNode],
    wide: &[WideNode],
    webcams: &[(u32, String)],
) -> String {
    let place = |(bus, address): (u8, u8)| format!("usb {bus:03}:{address:03}");
    let is_realsense = |c: &&UsbCamera| realsense.iter().any(|r| r.address == c.address);
    let mut lines: Vec<String> = usb
        .iter()
        .filter(|c| !is_realsense(c))
        .map(|c| format!("{}  {} ({:?} speed)", place(c.address), c.name, c.speed))
        .collect();
    lines.extend(realsense.iter().map(|c| {
        let parts = [("depth", &c.depth), ("infrared", &c.infrared), ("colour", &c.color)].into_iter();
        let nodes = parts.filter_map(|(name, n)| Some(format!("{name} {}", n.as_ref()?.pictures.display())));
        let nodes = nodes.collect::<Vec<_>>().join(", ");
        format!("{}  {} {} ({:?} speed): {nodes}", place(c.address), c.name, c.serial, c.speed)
    }));
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

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use toile_driver_simulated::{
        d435,
        side_by_side::{self, Views},
        uvc::Wire,
    };
    use toile_driver_transport::{
        LinkSpeed,
        known::Family,
        simulated::{SimulatedBus, SimulatedVideo},
    };

    use toile_live::missing_nodes;

    use super::*;

    struct Dark;

    impl Views for Dark {
        fn size(&self) -> (u16, u16) {
            (1280, 480)
        }
        fn brightness(&mut self, _frame: u64) -> Vec<u8> {
            vec![16; 1280 * 480]
        }
    }

    #[test]
    fn every_camera_is_listed_once_by_its_kind() {
        let bus = SimulatedBus::default();
        let d435 = bus.plug(Arc::new(Mutex::new(d435::model(d435::Pattern::default(), Wire::Bulk))));
        bus.plug(Arc::new(Mutex::new(side_by_side::model(Dark, Wire::Bulk))));
        let usb = UsbCamera {
            name: "RealSense D435",
            family: Family::Realsense,
            id: (d435.vendor, d435.product),
            address: d435.address,
            speed: LinkSpeed::High,
            problems: Vec::new(),
        };
        // The system calls every node a webcam; a laptop's own is on no known device.
        let webcams = (0..9).map(|index| (index, format!("Node {index}"))).collect();
        let answer = list(Listing::of(vec![usb], webcams, &SimulatedVideo::new(bus)));
        let lines: Vec<&str> = answer.text.lines().collect();
        let depth = "usb 001:001  RealSense D435 827313080543 (High speed): \
                     depth /dev/video0, infrared /dev/video2, colour /dev/video4";
        assert_eq!(lines[0], depth);
        assert!(lines[1].starts_with("/dev/video6") && lines[1].ends_with("(1280x480: two views side by side?)"));
        assert_eq!(lines[2..], ["webcam 8  Node 8"]);
        assert!(answer.warnings.is_empty(), "{:?}", answer.warnings);
        assert_eq!(answer.results["webcams"].as_array().map(Vec::len), Some(1));
    }

    #[test]
    fn nothing_and_a_camera_that_lacks_a_node_are_said() {
        let nothing = list(Listing::of(Vec::new(), Vec::new(), &SimulatedVideo::new(SimulatedBus::default())));
        assert_eq!(nothing.text, "No camera is plugged in.\n");
        let bus = SimulatedBus::default();
        bus.plug(Arc::new(Mutex::new(d435::d405(d435::Pattern::default(), Wire::Bulk))));
        let mut camera = realsense::list(&SimulatedVideo::new(bus)).unwrap().remove(0);
        assert_eq!(missing_nodes(&camera), None);
        camera.depth = None;
        assert!(missing_nodes(&camera).unwrap().contains("the video node for depth is missing"));
    }
}
