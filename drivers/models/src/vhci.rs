//! Models plugged into a Linux kernel's virtual USB host controller (`vhci_hcd`), for the wire tier.

use std::{
    fs, io,
    net::Shutdown,
    os::{fd::AsRawFd, unix::net::UnixStream},
    sync::{Arc, Mutex},
    thread::{self, JoinHandle},
};

use toile_driver_transport::twin::DeviceModel;

use crate::usbip;

/// The controller's folder.
const CONTROLLER: &str = "/sys/devices/platform/vhci_hcd.0";
/// USB 2 as the kernel numbers speeds (`USB_SPEED_HIGH` of `linux/usb/ch9.h`).
const HIGH_SPEED: u32 = 3;

/// A model that the kernel sees.
pub struct Plugged {
    line: UnixStream,
    thread: JoinHandle<io::Result<()>>,
}

/// Plugs a model into port `port` of the controller, as root.
///
/// # Errors
/// Where there is no controller, or the port is taken.
pub fn plug(model: Arc<Mutex<dyn DeviceModel>>, port: u32) -> io::Result<Plugged> {
    let (kernel, ours) = UnixStream::pair()?;
    let device = 0x1_0002 + port;
    fs::write(format!("{CONTROLLER}/attach"), format!("{port} {} {device} {HIGH_SPEED}", kernel.as_raw_fd()))?;
    let mut line = ours.try_clone()?;
    let thread = thread::spawn(move || usbip::serve(&model, &mut line));
    Ok(Plugged { line: ours, thread })
}

impl Plugged {
    /// Serves until the kernel lets go.
    ///
    /// # Errors
    /// What serving says.
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
