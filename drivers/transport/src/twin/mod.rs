//! The bus in this process: device models plug into it, drivers see the same traits as with libusb.
//!
//! Time is bus time: a transfer is filled when it is waited for, each isochronous packet takes one microframe (125 µs),
//! and of several endpoints the one whose transfer ends first is served first. So a run is the same every time, at
//! whatever speed the machine has.
//!
//! - [`model::DeviceModel`]: what a model answers; it serves a real kernel over USB/IP just as well;
//! - [`VirtualBus`]: plug and unplug; [`device::TwinDevice`]: an open model.

pub mod device;
pub mod model;

use std::{
    collections::BTreeMap,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
};

pub use model::{Answer, DeviceModel, ModelInfo, Packet};

use crate::{Bus, DeviceInfo, TransportError, UsbDevice, video::twin::Flow};
use device::TwinDevice;

/// A model that is plugged in.
#[derive(Clone)]
pub(crate) struct Plugged {
    pub(crate) info: DeviceInfo,
    pub(crate) model: Arc<Mutex<dyn DeviceModel>>,
    pub(crate) here: Arc<AtomicBool>,
    pub(crate) open: Arc<AtomicBool>,
    /// Bus time of its video streams, microframes.
    clock: Arc<AtomicU64>,
    /// Video streams by their interfaces.
    flows: Arc<Mutex<BTreeMap<u8, Arc<Mutex<Flow>>>>>,
}

impl Plugged {
    /// The latest microframe of its video streams.
    pub(crate) fn clock(&self) -> u64 {
        self.clock.load(Ordering::Acquire)
    }

    pub(crate) fn advance(&self, microframe: u64) {
        self.clock.fetch_max(microframe, Ordering::AcqRel);
    }

    /// What the nodes of a streaming interface share.
    pub(crate) fn flow(&self, interface: u8) -> Arc<Mutex<Flow>> {
        let mut flows = self.flows.lock().unwrap_or_else(PoisonError::into_inner);
        flows.entry(interface).or_default().clone()
    }

    pub(crate) fn model(&self) -> MutexGuard<'_, dyn DeviceModel + 'static> {
        self.model.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A bus of device models. Clones are the same bus.
#[derive(Clone, Default)]
pub struct VirtualBus(Arc<Mutex<Ports>>);

#[derive(Default)]
struct Ports {
    next_address: u8,
    plugged: Vec<Plugged>,
}

impl VirtualBus {
    /// Plugs a model in; it gets the next address, as on a real bus.
    pub fn plug(&self, model: Arc<Mutex<dyn DeviceModel>>) -> DeviceInfo {
        let about = model.lock().unwrap_or_else(PoisonError::into_inner).info();
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
        ports.plugged.push(Plugged { info: info.clone(), model, here, open, clock, flows });
        info
    }

    /// Pulls the device at this address out; an open one notices at its next request.
    pub fn unplug(&self, info: &DeviceInfo) {
        let mut ports = self.ports();
        ports.plugged.iter().filter(|p| p.info == *info).for_each(|p| p.here.store(false, Ordering::Release));
        ports.plugged.retain(|p| p.info != *info);
    }

    /// What is plugged in now.
    pub(crate) fn plugged(&self) -> Vec<Plugged> {
        let mut ports = self.ports();
        // A model that unplugged itself is off the bus.
        ports.plugged.retain(|p| p.here.load(Ordering::Acquire));
        ports.plugged.clone()
    }

    fn ports(&self) -> MutexGuard<'_, Ports> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Bus for VirtualBus {
    fn list(&self) -> Result<Vec<DeviceInfo>, TransportError> {
        Ok(self.plugged().into_iter().map(|p| p.info).collect())
    }

    fn open(&self, info: &DeviceInfo) -> Result<Box<dyn UsbDevice>, TransportError> {
        let found = self.ports().plugged.iter().find(|p| p.info == *info).cloned();
        let plugged = found.ok_or_else(|| TransportError::NotFound { what: info.to_string() })?;
        if plugged.open.swap(true, Ordering::AcqRel) {
            return Err(TransportError::Busy { device: info.clone() });
        }
        Ok(Box::new(TwinDevice::new(plugged)))
    }
}
