//! The scene before the modelled camera.

use std::collections::BTreeMap;

use toile_synthetic::Take;

use super::Optics;

/// The source of a modelled camera's images; sizes are columns and rows.
pub trait Content: Send {
    /// Depth of frame `frame` in millimetres, row by row; 0 where there is none.
    fn depth(&mut self, frame: u64, size: (u16, u16)) -> Vec<u16>;
    /// Brightness of every pixel and colour of every second: two bytes a pixel.
    fn yuyv(&mut self, frame: u64, size: (u16, u16)) -> Vec<u8>;
    /// Left and right infrared.
    fn infrared(&mut self, frame: u64, size: (u16, u16)) -> Vec<[u8; 2]>;
    /// The calibration of the camera.
    fn optics(&self) -> Optics {
        Optics::default()
    }
}

/// Made-up images, another one each frame; every pixel differs from its neighbours.
#[derive(Debug, Clone, Default)]
pub struct Pattern {
    /// The calibration of the camera.
    pub optics: Optics,
}

fn value(frame: u64, i: usize) -> u32 {
    let mixed = (i as u64 ^ frame << 22).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed >> 40) as u32
}

fn count((width, height): (u16, u16)) -> usize {
    usize::from(width) * usize::from(height)
}

impl Content for Pattern {
    fn depth(&mut self, frame: u64, size: (u16, u16)) -> Vec<u16> {
        let millimetres = |i| match value(frame, i) {
            v if v % 13 == 0 => 0,
            v => (300 + v % 9000) as u16,
        };
        (0..count(size)).map(millimetres).collect()
    }

    fn yuyv(&mut self, frame: u64, size: (u16, u16)) -> Vec<u8> {
        (0..2 * count(size)).map(|i| value(frame ^ 0x55, i) as u8).collect()
    }

    fn infrared(&mut self, frame: u64, size: (u16, u16)) -> Vec<[u8; 2]> {
        (0..count(size)).map(|i| value(frame ^ 0xaa, i)).map(|v| [v as u8, (v >> 8) as u8]).collect()
    }

    fn optics(&self) -> Optics {
        self.optics
    }
}

/// A synthetic person on a turning disk, in 640×480 alone; after the last frame the first follows. Colour is seen from
/// where depth is, and infrared is its brightness.
pub struct Rendered {
    take: Take,
    frames: BTreeMap<usize, (Vec<u16>, Vec<[u8; 3]>)>,
}

impl Rendered {
    /// Before this scene; its settings must ask for the stereo sensor.
    pub fn new(take: Take) -> Self {
        Self { take, frames: BTreeMap::new() }
    }

    /// Depth in millimetres and colour of frame `frame` as it was rendered.
    pub fn frame(&mut self, frame: u64) -> &(Vec<u16>, Vec<[u8; 3]>) {
        let index = (frame % self.take.moments.len().max(1) as u64) as usize;
        let take = &self.take;
        self.frames.entry(index).or_insert_with(|| {
            let depth = take.frame(index).ok().and_then(|f| f.depth).map(|d| d.values.clone());
            (depth.unwrap_or_default(), take.look(index).1)
        })
    }
}

impl Content for Rendered {
    fn depth(&mut self, frame: u64, size: (u16, u16)) -> Vec<u16> {
        let mut depth = self.frame(frame).0.clone();
        depth.resize(count(size), 0);
        depth
    }

    fn yuyv(&mut self, frame: u64, size: (u16, u16)) -> Vec<u8> {
        let mut bytes: Vec<u8> = self.frame(frame).1.as_chunks::<2>().0.iter().copied().flat_map(yuyv).collect();
        bytes.resize(2 * count(size), 128);
        bytes
    }

    fn infrared(&mut self, frame: u64, size: (u16, u16)) -> Vec<[u8; 2]> {
        let mut bytes: Vec<[u8; 2]> = self.frame(frame).1.iter().map(|p| [p[1]; 2]).collect();
        bytes.resize(count(size), [0; 2]);
        bytes
    }

    /// The stereo sensor's camera for depth and colour alike.
    fn optics(&self) -> Optics {
        let camera = self.take.camera();
        Optics {
            focal: camera.fx,
            center: [camera.cx, camera.cy],
            color_focal: camera.fx,
            color_center: [camera.cx, camera.cy],
            color_from_depth_rotation: nalgebra::Matrix3::identity(),
            color_from_depth_translation: nalgebra::Vector3::zeros(),
            ..Optics::default()
        }
    }
}

/// Two pixels by ITU-R BT.601, studio range; the colour is the first one's.
fn yuyv(pixels: [[u8; 3]; 2]) -> [u8; 4] {
    let weigh = |p: [u8; 3], w: [f64; 3], offset: f64| {
        let sum: f64 = p.iter().zip(w).map(|(c, w)| f64::from(*c) * w).sum();
        (sum / 255.0 + offset).round().clamp(0.0, 255.0) as u8
    };
    let y = |p| weigh(p, [65.481, 128.553, 24.966], 16.0);
    let u = weigh(pixels[0], [-37.797, -74.203, 112.0], 128.0);
    let v = weigh(pixels[0], [112.0, -93.786, -18.214], 128.0);
    [y(pixels[0]), u, y(pixels[1]), v]
}
