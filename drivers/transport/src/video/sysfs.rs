//! Which video nodes there are and which USB interface each belongs to, from sysfs.
//!
//! `class/video4linux/videoN/device` leads to the interface's folder (with `bInterfaceNumber`), whose parent is the USB
//! device's (with `idVendor`, `busnum`, ...); `Documentation/ABI/stable/sysfs-bus-usb` of Linux.

use std::{fs, path::Path};

use super::node::{NodeInfo, UsbPlace};
use crate::{LinkSpeed, TransportError};

/// The nodes below a sysfs root, in the order of their numbers. Where there is no such class, there are no nodes.
///
/// # Errors
/// [`TransportError::Video`] where the folder is there and cannot be read.
pub(super) fn nodes(sysfs: &Path) -> Result<Vec<NodeInfo>, TransportError> {
    let folder = sysfs.join("class/video4linux");
    let entries = match fs::read_dir(&folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(source) => return Err(TransportError::Video { node: folder, action: "list the video nodes", source }),
    };
    let names = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok());
    let mut numbers: Vec<u32> = names.filter_map(|name| name.strip_prefix("video")?.parse().ok()).collect();
    numbers.sort_unstable();
    Ok(numbers.into_iter().map(|number| node(&folder, number)).collect())
}

fn node(folder: &Path, number: u32) -> NodeInfo {
    let about = folder.join(format!("video{number}"));
    let name = text(&about, "name").unwrap_or_default();
    NodeInfo { node: format!("/dev/video{number}").into(), name, usb: usb(&about) }
}

fn usb(about: &Path) -> Option<UsbPlace> {
    let interface = fs::canonicalize(about.join("device")).ok()?;
    let device = interface.parent()?;
    let hexadecimal = |name| u16::from_str_radix(&text(device, name)?, 16).ok();
    let speed = match text(device, "speed").unwrap_or_default().parse::<f64>() {
        Ok(megabits) if megabits >= 5000.0 => LinkSpeed::Super,
        Ok(megabits) if megabits >= 480.0 => LinkSpeed::High,
        Ok(_) => LinkSpeed::Full,
        Err(_) => LinkSpeed::Unknown,
    };
    Some(UsbPlace {
        id: (hexadecimal("idVendor")?, hexadecimal("idProduct")?),
        address: (text(device, "busnum")?.parse().ok()?, text(device, "devnum")?.parse().ok()?),
        speed,
        interface: u8::from_str_radix(&text(&interface, "bInterfaceNumber")?, 16).ok()?,
        serial: text(device, "serial").unwrap_or_default(),
    })
}

fn text(folder: &Path, name: &str) -> Option<String> {
    Some(fs::read_to_string(folder.join(name)).ok()?.trim().to_string())
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    fn write(folder: &Path, files: &[(&str, &str)]) {
        fs::create_dir_all(folder).unwrap();
        files.iter().for_each(|(name, text)| fs::write(folder.join(name), format!("{text}\n")).unwrap());
    }

    #[test]
    fn nodes_are_found_with_their_interfaces() {
        let root = tempfile::tempdir().unwrap();
        let device = root.path().join("devices/usb2/2-1");
        let id = [("idVendor", "8086"), ("idProduct", "0b07"), ("busnum", "2"), ("devnum", "7"), ("speed", "5000")];
        write(&device, &id);
        let class = root.path().join("class/video4linux");
        for (number, interface) in [(10, "00"), (2, "03")] {
            let folder = device.join(format!("2-1:1.{interface}"));
            write(&folder, &[("bInterfaceNumber", interface)]);
            let about = class.join(format!("video{number}"));
            write(&about, &[("name", "RealSense")]);
            symlink(&folder, about.join("device")).unwrap();
        }
        write(&class.join("video3"), &[("name", "built in")]);
        write(&class.join("vbi0"), &[]);
        let found = nodes(root.path()).unwrap();
        let names: Vec<_> = found.iter().map(|n| n.node.display().to_string()).collect();
        assert_eq!(names, ["/dev/video2", "/dev/video3", "/dev/video10"]);
        assert_eq!(found[1].usb, None);
        let usb = found[2].usb.as_ref().unwrap();
        assert_eq!((usb.id, usb.address, usb.interface), ((0x8086, 0x0b07), (2, 7), 0));
        assert_eq!((usb.speed, usb.serial.as_str()), (LinkSpeed::Super, ""));
        assert_eq!(nodes(&root.path().join("nothing")).unwrap(), []);
    }
}
