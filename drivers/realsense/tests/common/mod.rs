//! A D435 made of code, and what its frames must be.
#![allow(dead_code, missing_docs, clippy::unwrap_used)]

use std::{
    sync::{Arc, Mutex},
    time::Duration,
};

use toile_capture::{ColorImage, Frame};
use toile_driver_realsense::{Realsense, Settings};
use toile_driver_simulated::{
    d435::{self, Content, D435, Pattern},
    uvc::{Fault, SimulatedCamera, StreamFault, Wire},
};
use toile_driver_transport::{
    DeviceInfo,
    simulated::{SimulatedBus, SimulatedVideo},
};

pub const SIZE: (u16, u16) = (640, 480);

/// Quick to give up: 0.2 s of bus time without a frame.
pub fn settings() -> Settings {
    Settings { frame_limit: Duration::from_millis(200), ..Settings::default() }
}

pub fn plugged(model: SimulatedCamera<D435>) -> (SimulatedBus, DeviceInfo, Arc<Mutex<SimulatedCamera<D435>>>) {
    let (bus, model) = (SimulatedBus::default(), Arc::new(Mutex::new(model)));
    let info = bus.plug(model.clone());
    (bus, info, model)
}

pub fn pattern(wire: Wire) -> SimulatedCamera<D435> {
    d435::model(Pattern::default(), wire)
}

/// A camera before the pattern, with these faults.
pub fn faulty(wire: Wire, faults: &[Fault]) -> Realsense {
    let (bus, ..) = plugged(pattern(wire).with_faults(faults.iter().copied()));
    Realsense::open(&SimulatedVideo::new(bus), None, settings()).unwrap()
}

pub fn depth_fault(frame: u64, packet: usize, what: StreamFault) -> Fault {
    Fault { stream: d435::DEPTH, frame, packet, what }
}

pub fn color_fault(frame: u64, packet: usize, what: StreamFault) -> Fault {
    Fault { stream: d435::COLOR, frame, packet, what }
}

/// True where a frame's depth is the pattern's of frame `number`, every pixel.
pub fn has_depth_of(frame: &Frame, number: u64) -> bool {
    let truth = Pattern::default().depth(number, SIZE);
    frame.depth.as_ref().is_some_and(|depth| depth.values == truth)
}

/// True where a frame's colours are the pattern's of frame `number`, every pixel: ITU-R BT.601 in floating point, which
/// integers follow within one step.
pub fn has_color_of(frame: &Frame, number: u64) -> bool {
    let Some(ColorImage::Rgb(image)) = &frame.color else { return false };
    let bytes = Pattern::default().yuyv(number, SIZE);
    let near = |seen: u8, truth: f64| (f64::from(seen) - truth.clamp(0.0, 255.0)).abs() <= 1.0;
    image.pixels.iter().enumerate().all(|(i, pixel)| {
        let at = i / 2 * 4;
        let y = 1.164_383 * (f64::from(bytes[at + i % 2 * 2]) - 16.0);
        let (u, v) = (f64::from(bytes[at + 1]) - 128.0, f64::from(bytes[at + 3]) - 128.0);
        let truth = [y + 1.596_027 * v, y - 0.391_762 * u - 0.812_968 * v, y + 2.017_232 * u];
        pixel.iter().zip(truth).all(|(seen, truth)| near(*seen, truth))
    }) && image.pixels.len() == bytes.len() / 2
}
