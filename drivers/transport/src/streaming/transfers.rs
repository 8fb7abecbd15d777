//! Steps of streams whose pictures come in USB transfers.

use std::{ops::ControlFlow, time::Duration};

use super::Progress;
use crate::{TransferStatus, TransportError, UsbDevice, usb::Transfer};

/// The next transfer that came back from the bus, to be read and submitted again; `Break` with what the step brought
/// where there is nothing to read.
///
/// Silence is measured in the bus time of the transfers that came, so the clock decides only where transfers themselves
/// no longer come back: after three times `limit`, the longest time without a whole picture.
///
/// # Errors
/// [`TransportError::Unplugged`], and what the bus reports.
pub fn next_transfer(
    device: &mut dyn UsbDevice,
    limit: Duration,
) -> Result<ControlFlow<Progress, Transfer>, TransportError> {
    let transfer = match device.wait(3 * limit) {
        Ok(transfer) => transfer,
        Err(TransportError::TimedOut { .. }) => return Ok(ControlFlow::Break(Progress::TimedOut)),
        Err(other) => return Err(other),
    };
    match transfer.status() {
        TransferStatus::Unplugged => Err(TransportError::Unplugged),
        TransferStatus::Cancelled => Ok(ControlFlow::Break(Progress::Silence(Duration::ZERO))),
        _ => Ok(ControlFlow::Continue(transfer)),
    }
}
