//! The camera's commands over an open device.

use std::{
    thread,
    time::{Duration, Instant},
};

use toile_driver_transport::{Setup, TransportError, UsbDevice};

use crate::{
    Calibration, Kinect1Error,
    calibration::{PADDING_BYTES, REGISTRATION_BYTES, SHIFT_BYTES},
    protocol::{ANSWER_ROOM, answer, command},
};

/// Opcodes (libfreenect `src/flags.c`, `src/cameras.c`).
const WRITE_REGISTER: u16 = 0x03;
const FIXED_PARAMETERS: u16 = 0x04;
const ALGORITHM_PARAMETERS: u16 = 0x16;
/// Pause between looks for an answer.
const PAUSE: Duration = Duration::from_micros(500);

/// Sends commands and fetches their answers, each within `limit`.
pub(crate) struct Commands {
    tag: u16,
    limit: Duration,
}

impl Commands {
    pub(crate) fn new(limit: Duration) -> Self {
        Self { tag: 0, limit }
    }

    /// Writes a register.
    pub(crate) fn write(&mut self, device: &mut dyn UsbDevice, register: u16, value: u16) -> Result<(), Kinect1Error> {
        self.send(device, WRITE_REGISTER, &[register, value], 2).map(drop)
    }

    /// Reads the camera's own numbers.
    pub(crate) fn calibration(&mut self, device: &mut dyn UsbDevice) -> Result<Calibration, Kinect1Error> {
        // Parameter, format, resolution (1: 640 columns), frames a second, offset (libfreenect `src/cameras.c`).
        let algorithm = |parameter| [parameter, 0, 1, 30, 0];
        let padding = self.send(device, ALGORITHM_PARAMETERS, &algorithm(0x41), PADDING_BYTES)?;
        let fixed = self.send(device, FIXED_PARAMETERS, &[0; 5], 94 + 16)?;
        let registration = self.send(device, ALGORITHM_PARAMETERS, &algorithm(0x40), REGISTRATION_BYTES)?;
        let shift = self.send(device, ALGORITHM_PARAMETERS, &algorithm(0x00), SHIFT_BYTES)?;
        Calibration::parse(&fixed, &registration, &padding, &shift)
    }

    /// The data of the answer to a command, which has at least `least` bytes.
    fn send(
        &mut self,
        device: &mut dyn UsbDevice,
        code: u16,
        words: &[u16],
        min: usize,
    ) -> Result<Vec<u8>, Kinect1Error> {
        let tag = self.tag;
        self.tag = self.tag.wrapping_add(1);
        device.control_out(Setup::vendor_out(0, 0), &command(code, tag, words), self.limit)?;
        let bytes = self.fetch(device, code)?;
        let wrong = |reason| Kinect1Error::Answer { command: code, reason };
        let data = answer(&bytes, code, tag).map_err(wrong)?;
        if data.len() < min {
            return Err(wrong(format!("the answer has {} bytes instead of {min}", data.len())));
        }
        Ok(data.to_vec())
    }

    /// Asks until the answer is there: it is empty, or as long as the room, before (libfreenect `send_cmd`).
    fn fetch(&self, device: &mut dyn UsbDevice, code: u16) -> Result<Vec<u8>, Kinect1Error> {
        let (start, mut room) = (Instant::now(), vec![0; ANSWER_ROOM]);
        loop {
            let length = device.control_in(Setup::vendor_in(0, 0), &mut room, self.limit)?;
            if length > 0 && length < ANSWER_ROOM {
                room.truncate(length);
                return Ok(room);
            }
            if start.elapsed() >= self.limit {
                let what = format!("command {code:#04x}");
                return Err(TransportError::TimedOut { what, waited: self.limit }.into());
            }
            thread::sleep(PAUSE);
        }
    }
}
