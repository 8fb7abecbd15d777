//! The extension unit: the hardware monitor and plain controls.
//!
//! A command is its length behind the first four bytes, 0xcdab, a code, four parameters and data, in 1024 bytes; the
//! answer begins with the code (or an error below zero) and says in its last four bytes how long it is
//! (`hw_monitor::fill_usb_buffer`, `command_transfer_over_xu`).

use std::collections::BTreeMap;

use toile_driver_transport::{Setup, simulated::Answer};

use super::Optics;

/// Bytes of a command and of an answer.
const BYTES: usize = 1024;
/// `WRONG_COMMAND` and `PARAMS_TABLE_ID_NOT_VALID` of `d400_hwmon_response`.
const WRONG_COMMAND: i32 = -1;
const NO_SUCH_TABLE: i32 = -17;

/// How the monitor answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MonitorFault {
    /// The request is refused.
    Stall,
    /// Nothing comes.
    Silence,
    /// Every command fails.
    Error,
    /// The answer is to another command.
    OtherCommand,
    /// The answer says that it is longer than an answer can be.
    Length,
    /// Tables have one bit turned.
    Bit,
    /// Tables end early.
    ShortTable,
    /// The table is another one.
    OtherTable,
    /// The first answers, this many, are that the hardware is not ready.
    NotReady(u32),
    /// All bytes are 0xff.
    Nonsense,
}

/// The extension unit's state.
pub struct Monitor {
    pub(super) optics: Optics,
    /// The problem.
    pub fault: Option<MonitorFault>,
    serial: [u8; 6],
    answer: Vec<u8>,
    controls: BTreeMap<u8, Vec<u8>>,
}

impl Monitor {
    pub(super) fn new(optics: Optics) -> Self {
        // Selector, and its value when switched on: emitter on, exposure 8.5 ms, laser 150 mW, no preset, exposure by itself.
        let controls: [(u8, &[u8]); 10] = [
            (2, &[1]),
            (3, &[0x34, 0x21, 0, 0]),
            (4, &[150, 0]),
            (6, &[0]),
            (7, &[0]),
            (8, &[0]),
            (9, &[45, 40]),
            (0x0a, &[1]),
            (0x0b, &[1]),
            (0x0e, &[0, 0]),
        ];
        let controls = controls.map(|(selector, value)| (selector, value.to_vec())).into();
        Self { optics, fault: None, serial: [0x81, 0x72, 0x12, 0x07, 0x04, 0x42], answer: vec![0; BYTES], controls }
    }

    /// A control's value as a driver left it.
    pub fn control(&self, selector: u8) -> Option<&[u8]> {
        self.controls.get(&selector).map(Vec::as_slice)
    }

    /// The camera's own serial number, as printed on it.
    pub fn serial(&self) -> String {
        self.serial.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    pub(super) fn request(&mut self, setup: Setup, data: &[u8]) -> Answer {
        let selector = (setup.value >> 8) as u8;
        let length = if selector == 1 { BYTES } else { self.controls.get(&selector).map_or(4, Vec::len) };
        match (setup.request, selector) {
            (0x85, _) => Answer::Data((length as u16).to_le_bytes().to_vec()),
            (0x86, _) => Answer::Data(vec![3]),
            (0x01, 1) => self.command(data),
            (0x81, 1) => Answer::Data(self.answer.clone()),
            (0x01, _) if data.len() == length => {
                self.controls.insert(selector, data.to_vec());
                Answer::Data(Vec::new())
            }
            (0x81, _) => Answer::Data(self.controls.get(&selector).cloned().unwrap_or(vec![0; 4])),
            (0x82, _) => Answer::Data(vec![0; length]),
            (0x83, 3) => Answer::Data(165_000u32.to_le_bytes().to_vec()),
            (0x83, 4) => Answer::Data(360u16.to_le_bytes().to_vec()),
            (0x83 | 0x84 | 0x87, _) => {
                let mut one = vec![0; length];
                one[0] = if selector == 4 { 30 } else { 1 };
                Answer::Data(one)
            }
            _ => Answer::Stall,
        }
    }

    fn command(&mut self, data: &[u8]) -> Answer {
        match &mut self.fault {
            Some(MonitorFault::Stall) => return Answer::Stall,
            Some(MonitorFault::Silence) => return Answer::Silence,
            Some(MonitorFault::NotReady(0)) => self.fault = None,
            // HW_NOT_READY
            Some(MonitorFault::NotReady(times)) => {
                *times -= 1;
                self.answer = answer(-7, &[]);
                return Answer::Data(Vec::new());
            }
            _ => {}
        }
        let word = |i: usize| data.get(4 * i..4 * i + 4).map_or(0, |b| i32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let is_command = data.len() == BYTES && data[2..4] == [0xab, 0xcd];
        let (code, parameter) = (word(1), word(2));
        let (code, mut body) = match (code, parameter) {
            _ if !is_command => (WRONG_COMMAND, Vec::new()),
            (0x10, _) => (code, self.details()),
            (0x15, 25) => (code, self.optics.coefficients()),
            (0x15, 32) => (code, self.optics.color()),
            (0x15, _) => (NO_SUCH_TABLE, Vec::new()),
            // RECPARAMSGET: the cameras of depth, one after another (`new_calibration_item`).
            (0x7e, _) => (code, self.optics.cameras()),
            // UAMG, whether advanced mode is on: no. Temperature, sub-presets and the like: not modelled.
            (0x30, _) => (code, vec![0; 4]),
            _ => (WRONG_COMMAND, Vec::new()),
        };
        let is_table = code == 0x15 && body.len() > 20;
        match self.fault {
            Some(MonitorFault::Bit) if is_table => body[20] ^= 0x10,
            Some(MonitorFault::ShortTable) if is_table => body.truncate(100),
            Some(MonitorFault::OtherTable) if is_table => body[2] ^= 0xff,
            _ => {}
        }
        self.answer = answer(code, &body);
        match self.fault {
            Some(MonitorFault::Error) => self.answer = answer(WRONG_COMMAND, &[]),
            Some(MonitorFault::OtherCommand) => self.answer[0] ^= 0x40,
            Some(MonitorFault::Length) => self.answer[BYTES - 4..].copy_from_slice(&60_000u32.to_le_bytes()),
            Some(MonitorFault::Nonsense) => self.answer.fill(0xff),
            _ => {}
        }
        Answer::Data(Vec::new())
    }

    /// GVD: what the camera is (`gvd_fields` of `ds-private.h`).
    fn details(&self) -> Vec<u8> {
        let mut details = vec![0; 276];
        // Firmware 5.12.7.100, its last number first.
        details[12..16].copy_from_slice(&[100, 7, 12, 5]);
        details[48..54].copy_from_slice(&self.serial);
        details[64..70].copy_from_slice(&[0x82, 0x73, 0x13, 0x08, 0x05, 0x43]);
        // Global shutter; a projector; colour; no motion sensor.
        (details[166], details[170], details[174], details[178]) = (2, 1, 1, 0);
        details
    }
}

fn answer(code: i32, body: &[u8]) -> Vec<u8> {
    let mut bytes = code.to_le_bytes().to_vec();
    bytes.extend(body);
    bytes.resize(BYTES, 0);
    bytes[BYTES - 4..].copy_from_slice(&(body.len() as u32).to_le_bytes());
    bytes
}
