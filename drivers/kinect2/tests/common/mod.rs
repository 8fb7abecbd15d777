//! A Kinect made of code, and what its frames must be.
#![allow(dead_code, missing_docs, clippy::unwrap_used)]

pub mod scenes;

use std::{
    collections::BTreeMap,
    sync::{Arc, LazyLock, Mutex},
    time::Duration,
};

use toile_capture::{ColorImage, Frame};
use toile_driver_kinect2::{ColorMode, DecodeSettings, Decoder, Kinect2, Settings, color};
use toile_driver_simulated::kinect2::{Content, Fault, Pattern, SimulatedCamera, Stream, StreamFault};
use toile_driver_transport::{DeviceInfo, simulated::SimulatedBus};

/// One pattern for all tests, computed once.
pub static PATTERN: LazyLock<Pattern> = LazyLock::new(Pattern::default);

/// The expected content of each frame of the pattern: millimetres, and the decoded (mirrored) colours.
type Truth = (Vec<u16>, Vec<[u8; 3]>);
static TRUTH: LazyLock<Mutex<BTreeMap<u64, Arc<Truth>>>> = LazyLock::new(Mutex::default);

/// Quick to give up: 0.1 s of bus time without a frame, and of patience with commands. Colour as it came.
pub fn settings() -> Settings {
    Settings {
        color: ColorMode::Full,
        command_limit: Duration::from_millis(50),
        ready_limit: Duration::from_millis(60),
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
pub fn faulty(faults: &[Fault]) -> Kinect2 {
    let (bus, ..) = plugged(SimulatedCamera::new(PATTERN.clone()).with_faults(faults.iter().copied()));
    Kinect2::open(&bus, None, settings()).unwrap()
}

pub fn depth_fault(frame: u64, packet: usize, what: StreamFault) -> Fault {
    Fault { stream: Stream::Depth, frame, packet, what }
}

pub fn color_fault(frame: u64, packet: usize, what: StreamFault) -> Fault {
    Fault { stream: Stream::Color, frame, packet, what }
}

/// The expected content of frame `number`.
fn truth(number: u64) -> Arc<Truth> {
    let number = number % Pattern::FRAMES;
    let mut all = TRUTH.lock().unwrap();
    let make = || {
        let mut pattern = PATTERN.clone();
        let (_, calibration) = scenes::calibration(pattern.optics());
        let decoded = Decoder::new(&calibration, DecodeSettings::default()).decode(&pattern.depth(number)).unwrap();
        let mm = decoded.depth_mm.iter().map(|mm| (mm + 0.5) as u16).collect();
        Arc::new((mm, color::decode(&pattern.jpeg(number)).unwrap()))
    };
    all.entry(number).or_insert_with(make).clone()
}

/// True where a frame's depth is that of the pattern's packet `number`, every pixel.
pub fn has_depth_of(frame: &Frame, number: u64) -> bool {
    frame.depth.as_ref().is_some_and(|depth| depth.values == truth(number).0)
}

/// True where a frame's colours are those of the pattern's image `number`, every pixel.
pub fn has_color_of(frame: &Frame, number: u64) -> bool {
    let Some(ColorImage::Rgb(image)) = &frame.color else { return false };
    let truth = truth(number);
    image.pixels.chunks_exact(1920).zip(truth.1.chunks_exact(1920)).all(|(a, b)| a.iter().eq(b.iter().rev()))
}
