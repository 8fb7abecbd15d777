//! The scene before the modelled camera.

use std::collections::BTreeMap;

use toile_geometry::Rigid;
use toile_synthetic::{SyntheticError, Take};

use super::{INFRARED_SIZE, NO_DEPTH, Optics, SIZE, packets::mosaic};

/// The source of a modelled camera's images.
pub trait Content: Send {
    /// Raw depth of frame `frame`, row by row: 0..2047, [`NO_DEPTH`] where there is none.
    fn depth(&mut self, frame: u64) -> Vec<u16>;
    /// Colours behind the Bayer filter.
    fn bayer(&mut self, frame: u64) -> Vec<u8>;
    /// Infrared of [`INFRARED_SIZE`], ten bits.
    fn infrared(&mut self, frame: u64) -> Vec<u16>;
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

impl Pattern {
    fn value(frame: u64, i: usize) -> u32 {
        let mixed = (i as u64 ^ frame << 20).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (mixed >> 40) as u32
    }
}

impl Content for Pattern {
    fn depth(&mut self, frame: u64) -> Vec<u16> {
        let value = |i| match Self::value(frame, i) {
            v if v % 13 == 0 => NO_DEPTH,
            v => (400 + v % 650) as u16,
        };
        (0..SIZE.0 * SIZE.1).map(value).collect()
    }

    fn bayer(&mut self, frame: u64) -> Vec<u8> {
        (0..SIZE.0 * SIZE.1).map(|i| Self::value(frame ^ 0x55, i) as u8).collect()
    }

    fn infrared(&mut self, frame: u64) -> Vec<u16> {
        (0..INFRARED_SIZE.0 * INFRARED_SIZE.1).map(|i| (Self::value(frame ^ 0xaa, i) % 1024) as u16).collect()
    }

    fn optics(&self) -> Optics {
        self.optics
    }
}

/// The first frame of other content again and again, computed once: for takes of thousands of frames.
#[derive(Debug, Clone)]
pub struct Repeated {
    optics: Optics,
    depth: Vec<u16>,
    bayer: Vec<u8>,
    infrared: Vec<u16>,
}

impl Repeated {
    /// Repeats the first frame of this.
    pub fn new(mut of: impl Content) -> Self {
        Self { optics: of.optics(), depth: of.depth(0), bayer: of.bayer(0), infrared: of.infrared(0) }
    }
}

impl Content for Repeated {
    fn depth(&mut self, _frame: u64) -> Vec<u16> {
        self.depth.clone()
    }

    fn bayer(&mut self, _frame: u64) -> Vec<u8> {
        self.bayer.clone()
    }

    fn infrared(&mut self, _frame: u64) -> Vec<u16> {
        self.infrared.clone()
    }

    fn optics(&self) -> Optics {
        self.optics
    }
}

/// One rendered frame.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderedFrame {
    /// Distance along +Z that the sensor measures, millimetres; 0 where there is none.
    pub depth_mm: Vec<u16>,
    /// The colour camera's picture.
    pub color: Vec<[u8; 3]>,
}

/// A synthetic person on a turning disk, rendered for both cameras; after the last frame the first follows.
pub struct Rendered {
    take: Take,
    color_take: Take,
    frames: BTreeMap<usize, RenderedFrame>,
}

impl Rendered {
    /// Before this scene; its settings must ask for the Kinect v1's sensor.
    pub fn new(take: Take) -> Self {
        let mut color_take = take.clone();
        color_take.room_from_camera = take.room_from_camera * Rigid::translation(Optics::default().baseline, 0.0, 0.0);
        Self { take, color_take, frames: BTreeMap::new() }
    }

    /// Frame `frame` as it was rendered.
    ///
    /// # Errors
    /// [`SyntheticError`] where it cannot be rendered.
    pub fn frame(&mut self, frame: u64) -> Result<&RenderedFrame, SyntheticError> {
        let index = (frame % self.take.moments.len() as u64) as usize;
        if !self.frames.contains_key(&index) {
            let depth_mm = self.take.frame(index)?.depth.map(|d| d.values.clone()).unwrap_or_default();
            let (_, color) = self.color_take.look(index);
            self.frames.insert(index, RenderedFrame { depth_mm, color });
        }
        Ok(&self.frames[&index])
    }
}

impl Content for Rendered {
    fn depth(&mut self, frame: u64) -> Vec<u16> {
        let optics = self.optics();
        match self.frame(frame) {
            Ok(image) => image.depth_mm.iter().map(|&mm| optics.raw_from_mm(f64::from(mm))).collect(),
            Err(_) => vec![NO_DEPTH; SIZE.0 * SIZE.1],
        }
    }

    fn bayer(&mut self, frame: u64) -> Vec<u8> {
        match self.frame(frame) {
            Ok(image) => mosaic(&image.color),
            Err(_) => vec![0; SIZE.0 * SIZE.1],
        }
    }

    fn infrared(&mut self, _frame: u64) -> Vec<u16> {
        vec![0; INFRARED_SIZE.0 * INFRARED_SIZE.1]
    }
}
