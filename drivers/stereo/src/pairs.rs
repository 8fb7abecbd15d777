//! Where pairs come from: one side-by-side camera, two cameras, or a recording of two sensors.

use std::sync::Arc;

use toile_capture::{RgbImage, Source};

use crate::{
    StereoDriverError,
    pairing::{Moment, Pairer, Picture, Side},
    stream::Pictures,
};

/// Whatever yields pairs, and the pictures that found no partner.
pub trait Pairs: Send {
    /// The next event; `None` at the end.
    ///
    /// # Errors
    /// [`StereoDriverError`]; after [`StereoDriverError::Picture`] the next call may go on.
    fn next_moment(&mut self) -> Result<Option<Moment>, StereoDriverError>;
}

/// One camera whose pictures hold the left view in their left half and the right view in their right half.
pub struct SideBySide<P: Pictures> {
    pictures: P,
}

impl<P: Pictures> SideBySide<P> {
    /// Halves the pictures of a camera.
    pub fn new(pictures: P) -> Self {
        Self { pictures }
    }
}

impl<P: Pictures> Pairs for SideBySide<P> {
    fn next_moment(&mut self) -> Result<Option<Moment>, StereoDriverError> {
        let Some(picture) = self.pictures.next_picture()? else { return Ok(None) };
        if picture.image.width % 2 != 0 {
            let reason = format!("is {} pixels wide, which cannot be halved", picture.image.width);
            return Err(StereoDriverError::Picture { side: Side::Left, sequence: picture.sequence, reason });
        }
        let half = |k| Picture { image: Arc::new(half(&picture.image, k)), ..picture.clone() };
        Ok(Some(Moment::Pair(half(0), half(1))))
    }
}

fn half(image: &RgbImage, k: usize) -> RgbImage {
    let width = image.width as usize / 2;
    let rows = image.pixels.chunks_exact(2 * width.max(1));
    let pixels = rows.flat_map(|row| &row[k * width..][..width]).copied().collect();
    RgbImage { width: width as u32, height: image.height, pixels }
}

/// Two cameras, paired by time.
pub struct TwoCameras<L: Pictures, R: Pictures> {
    left: L,
    right: R,
    pairer: Pairer,
    ended: [bool; 2],
    /// The error that ended a camera, to be reported after the pairs that came.
    failed: Option<StereoDriverError>,
}

impl<L: Pictures, R: Pictures> TwoCameras<L, R> {
    /// Pairs two cameras that take `fps` pictures a second.
    pub fn new(left: L, right: R, fps: f64) -> Self {
        Self { left, right, pairer: Pairer::new(period_ns(fps)), ended: [false; 2], failed: None }
    }
}

impl<L: Pictures, R: Pictures> Pairs for TwoCameras<L, R> {
    fn next_moment(&mut self) -> Result<Option<Moment>, StereoDriverError> {
        loop {
            if let Some(moment) = self.pairer.pop() {
                return Ok(Some(moment));
            }
            let is_over = match self.ended {
                [false, false] => false,
                [true, true] => true,
                // The rest of a recording is given, the rest of a camera without a partner is not waited for.
                [_, right] => {
                    if right {
                        self.left.is_live()
                    } else {
                        self.right.is_live()
                    }
                }
            };
            if is_over {
                return self.failed.take().map_or(Ok(None), Err);
            }
            let side = self.pairer.wants();
            let next = match side {
                Side::Left => self.left.next_picture(),
                Side::Right => self.right.next_picture(),
            };
            match next {
                Ok(Some(picture)) => self.pairer.push(side, picture),
                Err(torn @ StereoDriverError::Picture { .. }) => return Err(torn),
                ended => {
                    self.pairer.end(side);
                    self.ended[side as usize] = true;
                    self.failed = self.failed.take().or(ended.err());
                }
            }
        }
    }
}

/// A recording whose sensors 0 and 1 are the left and the right camera, in colour.
pub struct TwoSensors<S: Source> {
    source: S,
    pairer: Pairer,
    is_over: bool,
}

impl<S: Source> TwoSensors<S> {
    /// Pairs the colour pictures of the first two sensors of a recording made at `fps` frames a second.
    pub fn new(source: S, fps: f64) -> Self {
        Self { source, pairer: Pairer::new(period_ns(fps)), is_over: false }
    }
}

impl<S: Source> Pairs for TwoSensors<S> {
    fn next_moment(&mut self) -> Result<Option<Moment>, StereoDriverError> {
        loop {
            if let Some(moment) = self.pairer.pop() {
                return Ok(Some(moment));
            }
            if self.is_over {
                return Ok(None);
            }
            let Some(frame) = self.source.next_frame()? else {
                self.is_over = true;
                [Side::Left, Side::Right].into_iter().for_each(|side| self.pairer.end(side));
                continue;
            };
            let side = match frame.sensor {
                0 => Side::Left,
                1 => Side::Right,
                _ => continue,
            };
            let sequence = frame.device_frame;
            let wrong = |reason: String| StereoDriverError::Picture { side, sequence, reason };
            let color = frame.color.ok_or_else(|| wrong("has no colour".into()))?;
            let image = color.decode(frame.index).map_err(|e| wrong(format!("is torn: {e}")))?;
            let (time_ns, host_time_ns) = (frame.device_time_ns, frame.host_time_ns);
            self.pairer.push(side, Picture { image, sequence, time_ns, host_time_ns });
        }
    }
}

/// Nanoseconds a frame; an impossible rate counts as 30.
fn period_ns(fps: f64) -> i64 {
    let fps = if fps.is_finite() && fps > 0.0 { fps } else { 30.0 };
    (1e9 / fps).round() as i64
}
