//! The firmware's monitor: commands over the extension unit of the depth part.
//!
//! Layout: `hw_monitor::fill_usb_buffer` and `command_transfer_over_xu::send_receive` of librealsense
//! (`src/hw-monitor.cpp`, `src/platform/uvc-option.cpp`): 1024 bytes each way.

use std::{thread, time::Duration};

use toile_driver_transport::video::VideoNode;

use crate::RealsenseError;

/// Unit of the depth part (`depth_xu` of `src/ds/ds-private.h`), and its selector for the monitor (`DS5_HWMONITOR`).
pub const UNIT: u8 = 3;
const SELECTOR: u8 = 1;
/// `HW_MONITOR_BUFFER_SIZE`, and where an answer says how much data it has (`HW_MONITOR_DATA_SIZE_OFFSET`).
const BYTES: usize = 1024;
const LENGTH_AT: usize = 1020;
/// `IVCAM_MONITOR_MAGIC_NUMBER`.
const MAGIC: u16 = 0xcdab;
/// Camera details, and a calibration table by its number (`fw_cmd::GVD`, `GETINTCAL`).
const DETAILS: u32 = 0x10;
pub(crate) const TABLE: u32 = 0x15;
/// `HW_NOT_READY` of `d400_hwmon_response`, and how often and long it is waited for (`hw_monitor::get_gvd`: 50 × 0.1 s).
const NOT_READY: i32 = -7;
const TRIES: u32 = 20;
const PAUSE: Duration = Duration::from_millis(100);

/// The identity of the camera.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Details {
    /// Firmware version, such as `5.12.7.100`.
    pub firmware: String,
    /// Serial number of the camera, as printed on it.
    pub serial: String,
}

/// The bytes of a command with one parameter.
pub fn command(code: u32, parameter: u32) -> Vec<u8> {
    // Code and four parameters: what follows the first four bytes.
    let mut bytes = 20u16.to_le_bytes().to_vec();
    bytes.extend(MAGIC.to_le_bytes());
    bytes.extend([code, parameter, 0, 0, 0].map(u32::to_le_bytes).as_flattened());
    bytes.resize(BYTES, 0);
    bytes
}

/// The data of an answer to command `code`.
///
/// # Errors
/// [`Refusal`]: it says that the command failed, or is not an answer to it.
pub fn answer(code: u32, bytes: &[u8]) -> Result<&[u8], Refusal> {
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let (Some(said), Some(length)) = (word(0), word(LENGTH_AT)) else {
        return Err(Refusal::Wrong(format!("the answer has {} bytes instead of {BYTES}", bytes.len())));
    };
    if said != code {
        let number = said as i32;
        return Err(match number {
            NOT_READY => Refusal::NotReady,
            -100..0 => Refusal::Wrong(format!("the camera refuses it with error {number}")),
            _ => Refusal::Wrong(format!("the answer is to command {said:#x}")),
        });
    }
    let stated = length as usize;
    let data = bytes.get(4..LENGTH_AT).and_then(|data| data.get(..stated));
    data.ok_or_else(|| Refusal::Wrong(format!("the answer says that it has {stated} bytes")))
}

/// Why an answer cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Refusal {
    /// The firmware is still starting.
    NotReady,
    /// Anything else.
    Wrong(String),
}

/// The identity that the camera states (`gvd_fields` of `src/ds/ds-private.h`).
pub fn details(data: &[u8]) -> Option<Details> {
    let version: Vec<String> = data.get(12..16)?.iter().rev().map(u8::to_string).collect();
    let serial = data.get(48..54)?.iter().map(|byte| format!("{byte:02x}")).collect();
    Some(Details { firmware: version.join("."), serial })
}

/// Asks for the details.
///
/// # Errors
/// [`RealsenseError`] where the firmware does not answer as it should.
pub fn ask_details(node: &mut dyn VideoNode) -> Result<Details, RealsenseError> {
    let data = ask(node, DETAILS, 0)?;
    let short = || RealsenseError::Answer { command: DETAILS, reason: format!("the answer has {} bytes", data.len()) };
    details(&data).ok_or_else(short)
}

/// Sends a command and gives the data of its answer; waits for firmware that is starting, at most two seconds.
///
/// # Errors
/// [`RealsenseError`] where the firmware does not answer as it should.
pub fn ask(node: &mut dyn VideoNode, code: u32, parameter: u32) -> Result<Vec<u8>, RealsenseError> {
    let mut tries = 0;
    loop {
        node.extension_set(UNIT, SELECTOR, &command(code, parameter))?;
        let mut bytes = vec![0; BYTES];
        node.extension_get(UNIT, SELECTOR, &mut bytes)?;
        let reason = match answer(code, &bytes) {
            Ok(data) => return Ok(data.to_vec()),
            Err(Refusal::NotReady) if tries < TRIES => {
                tries += 1;
                thread::sleep(PAUSE);
                continue;
            }
            Err(Refusal::NotReady) => "the camera is still starting".into(),
            Err(Refusal::Wrong(reason)) => reason,
        };
        return Err(RealsenseError::Answer { command: code, reason });
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_command_is_what_librealsense_sends() {
        let bytes = command(TABLE, 25);
        assert_eq!(bytes[..12], [20, 0, 0xab, 0xcd, 0x15, 0, 0, 0, 25, 0, 0, 0]);
        assert_eq!(bytes.len(), 1024);
    }

    #[test]
    fn answers_say_how_long_they_are() {
        let mut bytes = vec![0; BYTES];
        (bytes[0], bytes[4], bytes[5], bytes[LENGTH_AT]) = (0x10, 7, 8, 2);
        assert_eq!(answer(0x10, &bytes), Ok(&[7, 8][..]));
        assert!(matches!(answer(0x15, &bytes), Err(Refusal::Wrong(_))));
        bytes[LENGTH_AT + 1] = 4;
        assert!(matches!(answer(0x10, &bytes), Err(Refusal::Wrong(_))));
        bytes[..4].copy_from_slice(&NOT_READY.to_le_bytes());
        assert_eq!(answer(0x10, &bytes), Err(Refusal::NotReady));
    }

    proptest! {
        #[test]
        fn no_answer_makes_it_panic(bytes in proptest::collection::vec(any::<u8>(), 0..1100), code in 0u32..40) {
            if let Ok(data) = answer(code, &bytes) {
                prop_assert!(data.len() <= LENGTH_AT - 4);
                let _ = details(data);
            }
        }
    }
}
