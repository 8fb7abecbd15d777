//! The camera's shape, and its scene.

use toile_driver_transport::{Setup, simulated::Answer};

use super::{Content, Monitor};
use crate::uvc::{
    ExtensionShape, FormatShape, FunctionShape, Picture, Scene, Shape, SimulatedCamera, StreamShape, Wire,
};

/// Streams in the order of the descriptors.
pub const DEPTH: usize = 0;
/// The infrared pair.
pub const INFRARED: usize = 1;
/// Colour.
pub const COLOR: usize = 2;

/// GUID of the depth part's extension unit (`depth_xu` of `ds-private.h`), as it stands in the descriptor.
const EXTENSION: [u8; 16] =
    [0xcb, 0x6c, 0x60, 0xc9, 0x4c, 0x59, 0x25, 0x4d, 0xaf, 0x47, 0xcc, 0xc4, 0x96, 0x43, 0x59, 0x95];
const SIZES: [(u16, u16); 4] = [(640, 480), (848, 480), (1280, 720), (424, 240)];
const RATES: [u32; 3] = [30, 15, 6];

/// The scene before the camera, and the answers of its units.
pub struct D435 {
    content: Box<dyn Content>,
    /// The extension unit.
    pub monitor: Monitor,
}

/// A D435 before some content.
pub fn model(content: impl Content + 'static, wire: Wire) -> SimulatedCamera<D435> {
    SimulatedCamera::new(shape(wire), D435::new(content))
}

/// A D405 before some content: the depth part alone.
pub fn d405(content: impl Content + 'static, wire: Wire) -> SimulatedCamera<D435> {
    let mut shape = shape(wire);
    shape.ids[1] = 0x0b5b;
    shape.strings[0] = "Intel(R) RealSense(TM) Depth Camera 405".into();
    shape.strings[1] = shape.strings[0].clone();
    shape.functions.truncate(1);
    SimulatedCamera::new(shape, D435::new(content))
}

fn shape(wire: Wire) -> Shape {
    let format = |code, bits| FormatShape { code, bits, sizes: SIZES.into(), rates: RATES.into() };
    let stream = |endpoint, formats: &[([u8; 4], u8)]| StreamShape {
        endpoint,
        formats: formats.iter().map(|&(code, bits)| format(code, bits)).collect(),
    };
    let depth = FunctionShape {
        streams: vec![stream(0x82, &[(*b"Z16 ", 16)]), stream(0x83, &[(*b"Y8I ", 16), (*b"Y800", 8)])],
        extension: Some(ExtensionShape { unit: 3, guid: EXTENSION, selectors: 17 }),
    };
    let color = FunctionShape { streams: vec![stream(0x84, &[(*b"YUY2", 16)])], extension: None };
    Shape {
        ids: [0x8086, 0x0b07, 0x50c7],
        strings: [
            "Intel(R) RealSense(TM) Depth Camera 435".into(),
            "Intel(R) RealSense(TM) Depth Camera 435".into(),
            "827313080543".into(),
        ],
        functions: vec![depth, color],
        wire,
    }
}

impl D435 {
    fn new(content: impl Content + 'static) -> Self {
        let monitor = Monitor::new(content.optics());
        Self { content: Box::new(content), monitor }
    }

    /// The scene.
    pub fn content(&mut self) -> &mut dyn Content {
        &mut *self.content
    }
}

impl Scene for D435 {
    fn picture(&mut self, picture: Picture) -> Vec<u8> {
        let Picture { stream, format, size, frame, .. } = picture;
        match (stream, format) {
            (DEPTH, _) => self.content.depth(frame, size).into_iter().flat_map(u16::to_le_bytes).collect(),
            (INFRARED, 0) => self.content.infrared(frame, size).as_flattened().to_vec(),
            (INFRARED, _) => self.content.infrared(frame, size).into_iter().map(|[left, _]| left).collect(),
            _ => self.content.yuyv(frame, size),
        }
    }

    /// `md_capture_timing` of librealsense `src/metadata.h`; times in microseconds.
    fn extra_header(&mut self, picture: Picture) -> Vec<u8> {
        let interval = 1_000_000 / picture.fps.max(1);
        let time = (picture.frame * 1_000_000 / u64::from(picture.fps.max(1))) as u32;
        let exposure = self.monitor.control(3).and_then(|b| b.first_chunk()).map_or(0, |b| u32::from_le_bytes(*b));
        let numbers = [0x8000_0001, 40, 1, 0x3f, picture.frame as u32, time, 0, exposure, interval, 0];
        numbers.map(u32::to_le_bytes).as_flattened().to_vec()
    }

    fn extension(&mut self, _unit: u8, setup: Setup, data: &[u8]) -> Answer {
        self.monitor.request(setup, data)
    }
}
