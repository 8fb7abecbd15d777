//! The camera's commands over an open device.

use std::{
    thread,
    time::{Duration, Instant},
};

use toile_driver_transport::{Setup, TransportError, UsbDevice};

use crate::{
    Calibration, Kinect2Error,
    calibration::{COLOR_BYTES, DEPTH_BYTES, P0_BYTES},
    protocol::{COMMAND_IN, COMMAND_OUT, COMPLETION_BYTES, command, completion, firmware, is_completion, serial},
};

/// Codes (libfreenect2 `protocol/command.h`).
const FIRMWARE: u32 = 0x02;
const INIT_STREAMS: u32 = 0x09;
const STOP: u32 = 0x0a;
const STATUS: u32 = 0x16;
const DATA_PAGE: u32 = 0x22;
const STREAMING: u32 = 0x2b;
const MODE: u32 = 0x4b;
/// Pages of [`DATA_PAGE`].
const PAGE_SERIAL: u32 = 1;
const PAGE_P0: u32 = 2;
const PAGE_DEPTH: u32 = 3;
const PAGE_COLOR: u32 = 4;
/// Room that the camera expects an answer with a page of calibration to have.
const PAGE_ROOM: usize = 0x1c_0000;
/// The status whose lowest bit says that the camera is ready, and the pause between looks at it.
const READY: u32 = 0x09_0000;
const PAUSE: Duration = Duration::from_millis(20);
/// Mode of streaming, and none.
const MODE_STREAMING: [u32; 4] = [1, 0x0064_0064, 0, 0];
const MODE_ON: [u32; 4] = [1, 0, 0, 0];
const MODE_OFF: [u32; 4] = [0; 4];

/// Standard requests (USB 3.2 §9.4): isochronous delay in nanoseconds, low-power states, suspension of a function.
const ISOCH_DELAY: Setup = Setup { request_type: 0, request: 0x31, value: 40, index: 0, length: 0 };
const U1_ENABLE: Setup = Setup { request_type: 0, request: 3, value: 48, index: 0, length: 0 };
const U2_ENABLE: Setup = Setup { value: 49, ..U1_ENABLE };
/// Suspension of interface 0's function; bits 9:8 of the index say whether (libfreenect2 `usb_control.cpp`).
const SUSPEND: Setup = Setup { request_type: 1, request: 3, value: 0, index: 3 << 8, length: 0 };
const RESUME: Setup = Setup { index: 0, ..SUSPEND };

/// The interface of commands and colour, and that of depth.
const CONTROL_INTERFACE: u8 = 0;
const DEPTH_INTERFACE: u8 = 1;

/// Sends commands and fetches their answers, each within `limit`.
pub(crate) struct Commands {
    sequence: u32,
    limit: Duration,
}

/// Who the camera says it is.
pub(crate) struct Identity {
    pub(crate) serial: String,
    pub(crate) firmware: String,
}

impl Commands {
    pub(crate) fn new(limit: Duration) -> Self {
        Self { sequence: 0, limit }
    }

    /// Takes the interfaces and wakes the camera (libfreenect2 `Freenect2DeviceImpl::open`).
    pub(crate) fn open(&mut self, device: &mut dyn UsbDevice) -> Result<(), Kinect2Error> {
        device.claim(CONTROL_INTERFACE, 0)?;
        device.claim(DEPTH_INTERFACE, 0)?;
        device.control_out(ISOCH_DELAY, &[], self.limit)?;
        device.set_alternate(DEPTH_INTERFACE, 0)?;
        for request in [U1_ENABLE, U2_ENABLE, SUSPEND, RESUME] {
            device.control_out(request, &[], self.limit)?;
        }
        Ok(())
    }

    /// Who it is.
    pub(crate) fn identity(&mut self, device: &mut dyn UsbDevice) -> Result<Identity, Kinect2Error> {
        let wrong = |command, what: &str| Kinect2Error::Answer { command, reason: format!("{what} cannot be read") };
        let versions = self.ask(device, FIRMWARE, &[], 0x200, 64)?;
        let firmware = firmware(&versions).ok_or_else(|| wrong(FIRMWARE, "the firmware's version"))?;
        let stated = self.ask(device, DATA_PAGE, &[PAGE_SERIAL], 0x80, 2)?;
        let serial = serial(&stated).ok_or_else(|| wrong(DATA_PAGE, "the serial number"))?;
        Ok(Identity { serial, firmware })
    }

    /// Reads the camera's own numbers.
    pub(crate) fn calibration(&mut self, device: &mut dyn UsbDevice) -> Result<Calibration, Kinect2Error> {
        let depth = self.ask(device, DATA_PAGE, &[PAGE_DEPTH], PAGE_ROOM, DEPTH_BYTES)?;
        let p0 = self.ask(device, DATA_PAGE, &[PAGE_P0], PAGE_ROOM, P0_BYTES)?;
        let color = self.ask(device, DATA_PAGE, &[PAGE_COLOR], PAGE_ROOM, COLOR_BYTES)?;
        Calibration::parse(&depth, &color, &p0)
    }

    /// Makes the camera ready (at most `ready_limit`) and switches its streams on (libfreenect2 `startStreams`).
    pub(crate) fn start(&mut self, device: &mut dyn UsbDevice, ready_limit: Duration) -> Result<(), Kinect2Error> {
        self.send(device, MODE, &MODE_STREAMING)?;
        self.send(device, MODE, &MODE_OFF)?;
        let start = Instant::now();
        while self.ask(device, STATUS, &[READY], 4, 4)?[0] & 1 == 0 {
            if start.elapsed() >= ready_limit {
                let what = "waiting for the camera to be ready".into();
                return Err(TransportError::TimedOut { what, waited: ready_limit }.into());
            }
            thread::sleep(PAUSE);
        }
        self.send(device, INIT_STREAMS, &[])?;
        device.set_alternate(DEPTH_INTERFACE, 1)?;
        self.ask(device, STATUS, &[READY], 4, 4)?;
        self.send(device, STREAMING, &[1])
    }

    /// Switches the streams off and on again.
    pub(crate) fn restart(&mut self, device: &mut dyn UsbDevice) -> Result<(), Kinect2Error> {
        self.send(device, STREAMING, &[0])?;
        self.send(device, STREAMING, &[1])
    }

    /// Switches the streams off and puts the camera to sleep (libfreenect2 `stop`).
    pub(crate) fn stop(&mut self, device: &mut dyn UsbDevice) -> Result<(), Kinect2Error> {
        device.set_alternate(DEPTH_INTERFACE, 0)?;
        let off_and_on = [&MODE_ON[..], &MODE_OFF, &MODE_ON, &MODE_OFF];
        self.send(device, MODE, &MODE_STREAMING)?;
        self.send(device, MODE, &MODE_OFF)?;
        self.send(device, STOP, &[])?;
        self.send(device, STREAMING, &[0])?;
        off_and_on.into_iter().try_for_each(|mode| self.send(device, MODE, mode))?;
        device.control_out(SUSPEND, &[], self.limit)?;
        Ok(())
    }

    /// A command without an answer.
    fn send(&mut self, device: &mut dyn UsbDevice, code: u32, parameters: &[u32]) -> Result<(), Kinect2Error> {
        self.ask(device, code, parameters, 0, 0).map(drop)
    }

    /// The answer to a command: at most `room` and at least `least` bytes.
    fn ask(
        &mut self,
        device: &mut dyn UsbDevice,
        code: u32,
        parameters: &[u32],
        room: usize,
        min: usize,
    ) -> Result<Vec<u8>, Kinect2Error> {
        let sequence = self.sequence;
        self.sequence = self.sequence.wrapping_add(1);
        let wrong = |reason| Kinect2Error::Answer { command: code, reason };
        device.bulk_out(COMMAND_OUT, &command(code, sequence, room as u32, parameters), self.limit)?;
        let mut answer = vec![0; room];
        if room > 0 {
            let length = device.bulk_in(COMMAND_IN, &mut answer, self.limit)?;
            answer.truncate(length);
            if is_completion(&answer) {
                return Err(wrong("it was completed without an answer".into()));
            }
            if length < min {
                return Err(wrong(format!("the answer has {length} bytes instead of {min}")));
            }
        }
        let mut end = [0; COMPLETION_BYTES];
        let length = device.bulk_in(COMMAND_IN, &mut end, self.limit)?;
        completion(&end[..length], sequence).map_err(wrong)?;
        Ok(answer)
    }
}
