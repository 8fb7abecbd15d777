//! Models plugged into a Linux kernel's virtual USB host controller (`vhci_hcd`), for the wire tier.

use std::{
    fs, io,
    net::Shutdown,
    os::{fd::AsRawFd, unix::net::UnixStream},
    sync::{Arc, Mutex, PoisonError},
    thread::{self, JoinHandle},
};

use toile_driver_transport::{LinkSpeed, simulated::SimulatedDevice};

use crate::usbip;

/// The controller's folder.
const CONTROLLER: &str = "/sys/devices/platform/vhci_hcd.0";
/// Speeds as the kernel numbers them (`USB_SPEED_HIGH` and `_SUPER` of `linux/usb/ch9.h`), each with its hub's name in
/// the controller's list of ports.
const HIGH: (u32, &str) = (3, "hs");
const SUPER: (u32, &str) = (5, "ss");
/// The state of a free port in that list (`VDEV_ST_NULL` of `usbip_common.h`).
const FREE: &str = "004";

/// A model that the kernel sees.
pub struct Plugged {
    line: UnixStream,
    thread: JoinHandle<io::Result<()>>,
}

/// Plugs a model into a free port of the controller, of the hub for its speed, as root.
///
/// # Errors
/// Where there is no controller, or no free port.
pub fn plug(model: Arc<Mutex<dyn SimulatedDevice>>) -> io::Result<Plugged> {
    let is_super = model.lock().unwrap_or_else(PoisonError::into_inner).info().speed == LinkSpeed::Super;
    let (speed, hub) = if is_super { SUPER } else { HIGH };
    let port = free_port(&fs::read_to_string(format!("{CONTROLLER}/status"))?, hub)
        .ok_or_else(|| io::Error::other("the virtual host controller has no free port of this speed"))?;
    let (kernel, ours) = UnixStream::pair()?;
    let device = 0x1_0002 + port;
    fs::write(format!("{CONTROLLER}/attach"), format!("{port} {} {device} {speed}", kernel.as_raw_fd()))?;
    let mut line = ours.try_clone()?;
    let thread = thread::spawn(move || usbip::serve(&model, &mut line));
    Ok(Plugged { line: ours, thread })
}

/// The first free port of a hub: "ss 0008 004 000 00000000 000000 0-0".
fn free_port(status: &str, hub: &str) -> Option<u32> {
    status.lines().find_map(|line| match line.split_whitespace().collect::<Vec<_>>()[..] {
        [its_hub, port, FREE, ..] if its_hub == hub => port.parse().ok(),
        _ => None,
    })
}

impl Plugged {
    /// Serves until the kernel lets go.
    ///
    /// # Errors
    /// The error of serving.
    pub fn wait(self) -> io::Result<()> {
        self.thread.join().map_err(|_| io::Error::other("the server panicked"))?
    }

    /// Pulls it out.
    ///
    /// # Errors
    /// Where the line cannot be closed.
    pub fn unplug(self) -> io::Result<()> {
        self.line.shutdown(Shutdown::Both)?;
        // What the server was writing to a kernel that no longer listens does not matter.
        let _ = self.thread.join().map_err(|_| io::Error::other("the server panicked"))?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_free_port_of_the_speed_is_taken() {
        let status = "hub port sta spd dev      sockfd local_busid\n\
            hs  0000 006 003 00010002 000003 1-1\nhs  0001 004 000 00000000 000000 0-0\n\
            ss  0008 006 005 0001000a 000004 2-1\nss  0009 004 000 00000000 000000 0-0\n";
        assert_eq!((free_port(status, "hs"), free_port(status, "ss")), (Some(1), Some(9)));
        assert_eq!(free_port("hs 0000 006 000", "hs"), None);
    }
}
