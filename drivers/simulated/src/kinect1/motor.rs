//! LED, tilt and accelerometer: a device of its own (libfreenect `src/tilt.c`, OpenKinect wiki).

use toile_driver_transport::{
    LinkSpeed, Setup,
    simulated::{Answer, SimulatedDevice, SimulatedInfo},
};

use crate::descriptors::Descriptors;

/// Readings that the accelerometer gives for one g.
const COUNTS_PER_G: f64 = 819.0;

/// The motor board. It tilts at once.
#[derive(Debug, Clone, Default)]
pub struct SimulatedMotor {
    /// Value of the LED as it was set.
    pub led: u16,
    /// Tilt above the horizon, in half degrees.
    pub tilt: i8,
    /// Refuse every request.
    pub stalls: bool,
}

impl SimulatedMotor {
    /// The content of its descriptors.
    pub fn descriptors(&self) -> Descriptors {
        let strings = ["Microsoft", "Xbox NUI Motor", ""].map(String::from);
        Descriptors { ids: [0x045e, 0x02b0, 0x0105], strings, endpoints: Vec::new() }
    }

    fn state(&self) -> Vec<u8> {
        let angle = f64::from(self.tilt) / 2.0;
        let (sin, cos) = angle.to_radians().sin_cos();
        let counts = [0.0, cos, -sin].map(|g: f64| ((g * COUNTS_PER_G).round() as i16).to_be_bytes());
        let mut data = vec![0, 0];
        data.extend(counts.as_flattened());
        data.extend([self.tilt as u8, 0]);
        data
    }
}

impl SimulatedDevice for SimulatedMotor {
    fn info(&self) -> SimulatedInfo {
        let [vendor, product, release] = self.descriptors().ids;
        let (serial, iso_endpoints) = (String::new(), Vec::new());
        SimulatedInfo { vendor, product, release, speed: LinkSpeed::Full, serial, iso_endpoints }
    }

    fn control(&mut self, setup: Setup, _data: &[u8]) -> Answer {
        if self.stalls {
            return Answer::Stall;
        }
        if let Some(answer) = self.descriptors().answer(setup) {
            return answer;
        }
        match (setup.request_type, setup.request) {
            (0xc0, 0x10) => Answer::Data(vec![0x22]),
            (0xc0, 0x32) => Answer::Data(self.state()),
            (0x40, 0x06) => {
                self.led = setup.value;
                Answer::Data(Vec::new())
            }
            (0x40, 0x31) => {
                self.tilt = setup.value as i8;
                Answer::Data(Vec::new())
            }
            _ => Answer::Stall,
        }
    }
}
