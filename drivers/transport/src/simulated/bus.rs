//! The bus in this process.

use std::sync::{
    Arc, Mutex, MutexGuard, PoisonError,
    atomic::{AtomicBool, Ordering},
};

use super::{device::SimulatedDevice, open::OpenDevice, plugged::Plugged};
use crate::{Bus, DeviceInfo, TransportError, UsbDevice};

/// A bus of simulated devices. Clones are the same bus.
#[derive(Clone, Default)]
pub struct SimulatedBus(Arc<Mutex<Ports>>);

#[derive(Default)]
struct Ports {
    next_address: u8,
    plugged: Vec<Plugged>,
}

impl SimulatedBus {
    /// Plugs a device in; it gets the next address, as on a real bus.
    pub fn plug(&self, device: Arc<Mutex<dyn SimulatedDevice>>) -> DeviceInfo {
        let about = device.lock().unwrap_or_else(PoisonError::into_inner).info();
        let mut ports = self.ports();
        ports.next_address = ports.next_address % 127 + 1;
        let info = DeviceInfo {
            vendor: about.vendor,
            product: about.product,
            release: about.release,
            address: (1, ports.next_address),
            hub: vec![1],
            speed: about.speed,
        };
        let (here, open) = (Arc::new(AtomicBool::new(true)), Arc::new(AtomicBool::new(false)));
        let (clock, flows) = (Arc::default(), Arc::default());
        ports.plugged.push(Plugged { info: info.clone(), device, here, open, clock, flows });
        info
    }

    /// Pulls the device at this address out; an open one notices at its next request.
    pub fn unplug(&self, info: &DeviceInfo) {
        let mut ports = self.ports();
        ports.plugged.iter().filter(|p| p.info == *info).for_each(Plugged::leave);
        ports.plugged.retain(|p| p.info != *info);
    }

    /// The devices that are plugged in now.
    pub(super) fn plugged(&self) -> Vec<Plugged> {
        let mut ports = self.ports();
        // A device that unplugged itself is off the bus.
        ports.plugged.retain(Plugged::is_here);
        ports.plugged.clone()
    }

    fn ports(&self) -> MutexGuard<'_, Ports> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Bus for SimulatedBus {
    fn list(&self) -> Result<Vec<DeviceInfo>, TransportError> {
        Ok(self.plugged().into_iter().map(|p| p.info).collect())
    }

    fn open(&self, info: &DeviceInfo) -> Result<Box<dyn UsbDevice>, TransportError> {
        let found = self.ports().plugged.iter().find(|p| p.info == *info).cloned();
        let plugged = found.ok_or_else(|| TransportError::NotFound { what: info.to_string() })?;
        if plugged.open.swap(true, Ordering::AcqRel) {
            return Err(TransportError::Busy { device: info.clone() });
        }
        Ok(Box::new(OpenDevice::new(plugged)))
    }
}
