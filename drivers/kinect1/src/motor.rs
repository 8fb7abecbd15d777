//! LED, tilt and accelerometer: a USB device of its own inside the Kinect's housing.

use std::time::Duration;

use toile_driver_transport::{Bus, DeviceInfo, Setup, UsbDevice, open_known};

use crate::{Kinect1Error, find::MICROSOFT};

/// Product id of the motor (libfreenect `src/freenect_internal.h`).
const MOTOR: u16 = 0x02b0;
/// Requests (libfreenect `src/tilt.c`, OpenKinect wiki "Protocol Documentation").
const SET_LED: u8 = 0x06;
const SET_TILT: u8 = 0x31;
const STATE: u8 = 0x32;
/// Readings for one g: the KXSD9's data sheet, by libfreenect `include/libfreenect.h`.
const COUNTS_PER_G: f64 = 819.0;
/// Metres a second squared.
const G: f64 = 9.806_65;
/// The motor must not be driven farther (libfreenect `MAX_TILT_ANGLE`), degrees.
const MAX_TILT: f64 = 31.0;
/// Each request is answered at once or never.
const LIMIT: Duration = Duration::from_millis(500);

/// The state of the LED (libfreenect `freenect_led_options`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u16)]
#[allow(missing_docs)] // the names are the documentation
pub enum Led {
    Off = 0,
    Green = 1,
    Red = 2,
    Yellow = 3,
    BlinkingGreen = 4,
    BlinkingRedYellow = 6,
}

/// A measurement of the motor board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorState {
    /// Acceleration in the Kinect's own axes (+X right, +Y up, +Z towards the scene's back), m/s²; at rest it shows up.
    pub acceleration: [f64; 3],
    /// Tilt of the head above the horizon, radians; `None` while the motor runs.
    pub tilt: Option<f64>,
    /// True where it reached the end of its way.
    pub at_limit: bool,
}

/// The motor board.
pub struct Motor {
    device: Box<dyn UsbDevice>,
}

impl Motor {
    /// Opens the motor in the same housing as `camera`, or the only one there is. Kinects after model 1414 have none:
    /// theirs is driven through the microphones' firmware, which this driver does not load.
    ///
    /// # Errors
    /// [`Kinect1Error::Transport`] where there is none, or it cannot be opened.
    pub fn open(bus: &dyn Bus, camera: Option<&DeviceInfo>) -> Result<Self, Kinect1Error> {
        let is_motor = |info: &DeviceInfo| (info.vendor, info.product) == (MICROSOFT, MOTOR);
        let motors: Vec<DeviceInfo> = bus.list()?.into_iter().filter(is_motor).collect();
        let near = |m: &DeviceInfo| camera.is_none_or(|c| m.address.0 == c.address.0 && m.hub == c.hub);
        let chosen = motors.iter().find(|m| near(m)).or(motors.first().filter(|_| motors.len() == 1));
        let mut device = open_known(bus, |info| Some(info) == chosen, "the motor of a Kinect v1 (model 1414)")?;
        device.claim(0, 0)?;
        Ok(Self { device })
    }

    /// Sets the LED.
    ///
    /// # Errors
    /// [`Kinect1Error::Transport`] where the request fails.
    pub fn set_led(&mut self, led: Led) -> Result<(), Kinect1Error> {
        self.device.control_out(Setup::vendor_out(SET_LED, led as u16), &[], LIMIT)?;
        Ok(())
    }

    /// Tilts the head to `angle` radians above the horizon, at most 31° either way. The motor takes a second or two.
    ///
    /// # Errors
    /// [`Kinect1Error::Transport`] where the request fails.
    pub fn set_tilt(&mut self, angle: f64) -> Result<(), Kinect1Error> {
        let half_degrees = 2.0 * angle.to_degrees().clamp(-MAX_TILT, MAX_TILT);
        // Two's complement in sixteen bits, as libfreenect sends it; a NaN is level.
        self.device.control_out(Setup::vendor_out(SET_TILT, half_degrees.round() as i16 as u16), &[], LIMIT)?;
        Ok(())
    }

    /// The current measurement of the board.
    ///
    /// # Errors
    /// [`Kinect1Error`] where the request fails or is answered too short.
    pub fn state(&mut self) -> Result<MotorState, Kinect1Error> {
        let mut data = [0; 10];
        let length = self.device.control_in(Setup::vendor_in(STATE, 0), &mut data, LIMIT)?;
        if length != data.len() {
            let reason = format!("the answer has {length} bytes instead of {}", data.len());
            return Err(Kinect1Error::Answer { command: u16::from(STATE), reason });
        }
        let counts = [2, 4, 6].map(|i| i16::from_be_bytes([data[i], data[i + 1]]));
        Ok(MotorState {
            acceleration: counts.map(|c| f64::from(c) / COUNTS_PER_G * G),
            // -128 while it moves (OpenKinect wiki); status 4 says the same.
            tilt: (data[8] != 0x80 && data[9] != 4).then(|| (f64::from(data[8] as i8) / 2.0).to_radians()),
            at_limit: data[9] == 1,
        })
    }
}
