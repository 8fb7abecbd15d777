//! A simulated device that is plugged in.

use std::{
    collections::BTreeMap,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::Duration,
};

use super::{
    device::{Answer, SimulatedDevice},
    flow::Flow,
};
use crate::{DeviceInfo, TransportError};

/// A simulated device that is plugged in; clones are the same device.
#[derive(Clone)]
pub(super) struct Plugged {
    pub(super) info: DeviceInfo,
    pub(super) device: Arc<Mutex<dyn SimulatedDevice>>,
    pub(super) here: Arc<AtomicBool>,
    pub(super) open: Arc<AtomicBool>,
    /// Bus time of its video streams, microframes.
    pub(super) clock: Arc<AtomicU64>,
    /// Video streams by their interfaces.
    pub(super) flows: Arc<Mutex<BTreeMap<u8, Arc<Mutex<Flow>>>>>,
}

impl Plugged {
    /// The latest microframe of its video streams.
    pub(super) fn clock(&self) -> u64 {
        self.clock.load(Ordering::Acquire)
    }

    pub(super) fn advance(&self, microframe: u64) {
        self.clock.fetch_max(microframe, Ordering::AcqRel);
    }

    /// Shared by the nodes of a streaming interface.
    pub(super) fn flow(&self, interface: u8) -> Arc<Mutex<Flow>> {
        let mut flows = self.flows.lock().unwrap_or_else(PoisonError::into_inner);
        flows.entry(interface).or_default().clone()
    }

    /// Asks the device, where it is still plugged in.
    pub(super) fn ask(
        &self,
        what: &str,
        limit: Duration,
        question: impl FnOnce(&mut dyn SimulatedDevice) -> Answer,
    ) -> Result<Vec<u8>, TransportError> {
        self.check_here()?;
        let answer = question(&mut *self.device());
        match answer {
            Answer::Data(data) => Ok(data),
            Answer::Stall => Err(TransportError::Stalled { what: what.into() }),
            Answer::Silence => Err(TransportError::TimedOut { what: what.into(), waited: limit }),
            Answer::Gone => {
                self.leave();
                Err(TransportError::Unplugged)
            }
        }
    }

    /// False once it was unplugged.
    pub(super) fn is_here(&self) -> bool {
        self.here.load(Ordering::Acquire)
    }

    /// [`TransportError::Unplugged`] once it was unplugged.
    pub(super) fn check_here(&self) -> Result<(), TransportError> {
        if self.is_here() { Ok(()) } else { Err(TransportError::Unplugged) }
    }

    /// Nobody has it open any more.
    pub(super) fn close(&self) {
        self.open.store(false, Ordering::Release);
    }

    /// It is unplugged from now on.
    pub(super) fn leave(&self) {
        self.here.store(false, Ordering::Release);
    }

    pub(super) fn device(&self) -> MutexGuard<'_, dyn SimulatedDevice + 'static> {
        self.device.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
