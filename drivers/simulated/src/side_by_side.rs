//! A stereo camera that sends both views side by side (YUYV), as many cheap USB modules do.

use crate::uvc::{FormatShape, FunctionShape, Picture, Scene, Shape, SimulatedCamera, StreamShape, Wire};

/// The view of both eyes: brightness of frame `frame`, row by row over both views.
pub trait Views: Send {
    /// Columns of both views together, and rows.
    fn size(&self) -> (u16, u16);
    /// Brightness, row by row.
    fn brightness(&mut self, frame: u64) -> Vec<u8>;
}

/// The camera's scene.
pub struct SideBySide {
    views: Box<dyn Views>,
}

/// A side-by-side camera before these views.
pub fn model(views: impl Views + 'static, wire: Wire) -> SimulatedCamera<SideBySide> {
    let format = FormatShape { code: *b"YUY2", bits: 16, sizes: vec![views.size()], rates: vec![30] };
    let stream = StreamShape { endpoint: 0x81, formats: vec![format] };
    let shape = Shape {
        ids: [0x32e4, 0x9750, 0x0100],
        strings: ["Model".into(), "Stereo camera".into(), String::new()],
        functions: vec![FunctionShape { streams: vec![stream], extension: None }],
        wire,
    };
    SimulatedCamera::new(shape, SideBySide { views: Box::new(views) })
}

impl Scene for SideBySide {
    fn picture(&mut self, picture: Picture) -> Vec<u8> {
        self.views.brightness(picture.frame).into_iter().flat_map(|y| [y, 128]).collect()
    }
}
