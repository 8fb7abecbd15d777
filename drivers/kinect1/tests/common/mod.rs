//! A Kinect made of code, and what its frames must be.
#![allow(dead_code, missing_docs, clippy::unwrap_used)]

use std::{
    sync::{Arc, Mutex},
    time::Duration,
};

use toile_capture::{ColorImage, Frame};
use toile_driver_kinect1::{Kinect1, Settings};
use toile_driver_simulated::kinect1::{Content, Fault, Pattern, SimulatedCamera, Stream, StreamFault};
use toile_driver_transport::{DeviceInfo, simulated::SimulatedBus};

/// Quick to give up: 0.1 s of bus time without a frame, and of patience with commands.
pub fn settings() -> Settings {
    Settings {
        command_limit: Duration::from_millis(50),
        frame_limit: Duration::from_millis(100),
        ..Settings::default()
    }
}

pub fn plugged(model: SimulatedCamera) -> (SimulatedBus, DeviceInfo, Arc<Mutex<SimulatedCamera>>) {
    let (bus, model) = (SimulatedBus::default(), Arc::new(Mutex::new(model)));
    let info = bus.plug(model.clone());
    (bus, info, model)
}

/// A Kinect before the pattern, with these faults.
pub fn faulty(faults: &[Fault]) -> Kinect1 {
    let model = SimulatedCamera::new(Pattern::default()).with_faults(faults.iter().copied());
    let (bus, ..) = plugged(model);
    Kinect1::open(&bus, None, settings()).unwrap()
}

pub fn depth_fault(frame: u64, packet: usize, what: StreamFault) -> Fault {
    Fault { stream: Stream::Depth, frame, packet, what }
}

pub fn video_fault(frame: u64, packet: usize, what: StreamFault) -> Fault {
    Fault { stream: Stream::Video, frame, packet, what }
}

/// Millimetres of a raw value: z = 10·r·e / (e − m), m = (raw / 4 − 200 − 0.375)·p (the model's optics, spelt out).
pub fn mm(raw: u16) -> u16 {
    if raw == 2047 {
        return 0;
    }
    let m = (f64::from(raw) / 4.0 - 200.375) * f64::from(0.1042_f32);
    (10.0 * 120.0 * 7.5 / (7.5 - m)).round() as u16
}

/// True where a frame's depth is the pattern's of frame `number`, every pixel.
pub fn has_depth_of(frame: &Frame, number: u64) -> bool {
    let truth: Vec<u16> = Pattern::default().depth(number).into_iter().map(mm).collect();
    frame.depth.as_ref().is_some_and(|depth| depth.values == truth)
}

/// True where a frame's colours are the pattern's of frame `number`, every pixel that the filter passed.
pub fn has_color_of(frame: &Frame, number: u64) -> bool {
    let Some(ColorImage::Rgb(image)) = &frame.color else { return false };
    let filter = |i: usize| [[1, 0], [2, 1]][i / 640 % 2][i % 2];
    let seen: Vec<u8> = image.pixels.iter().enumerate().map(|(i, p)| p[filter(i)]).collect();
    seen == Pattern::default().bayer(number)
}
