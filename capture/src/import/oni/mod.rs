//! `.oni`: recordings of OpenNI 1 and 2. Depth is raw or packed (`16zP`, `16zT`), colour JPEG or raw; the field of view stands in a
//! property of the stream. Pictures that were recorded mirrored, as these cameras do by default, are turned back.

mod codec;
mod records;

use std::{fs::File, path::Path, sync::Arc};

use toile_geometry::{Rigid, camera::PinholeCamera};

use super::stored::{Album, StoredSource, fps, numbered, shots};
use crate::{
    CaptureError, ColorImage, DepthImage, DeviceIdentity, Rig, Sensor, encoded,
    files::open_regular,
    frame::rgb_image,
    pixels::{Rows, yuyv},
    printable,
};
use records::{Node, Place, Records, bytes};

/// What a file starts with.
pub(super) const MAGIC: &[u8] = b"NI10";
const DEPTH: u32 = 2;
const COLOR: u32 = 3;
/// Numbers of formats: depth in tenths of a millimetre, and colours.
const TENTHS: u64 = 101;
const RGB: [u64; 2] = [1, 200];
const UYVY: [u64; 2] = [2, 201];
const YUYV: u64 = 205;
const DEPTH_CODECS: [&str; 3] = ["NONE", "16zP", "16zT"];
/// The largest number of pixels of a picture.
const MAX_PIXELS: u64 = 1 << 26;
/// Focal length of cameras of this kind, pixels of 640, where a file does not say its field of view.
const USUAL_FOCAL: f64 = 570.3;

/// Opens a recording.
///
/// # Errors
/// [`CaptureError`] that says what is wrong, or which kind of it is not read.
pub(super) fn open(path: &Path) -> Result<StoredSource, CaptureError> {
    let wrong = |reason: String| CaptureError::format(path, reason);
    let mut file = open_regular(path)?;
    let records = Records::read(&mut file).map_err(wrong)?;
    let mut remarks = Vec::new();
    if records.is_torn {
        remarks
            .push("it ends in the middle, as where the recorder was stopped; what stands before was read".to_string());
    }
    let of = |kind: u32| records.nodes.values().find(|node| node.kind == kind && !node.pictures.is_empty());
    let depth = of(DEPTH).ok_or_else(|| wrong("has no depth pictures".into()))?;
    if !DEPTH_CODECS.contains(&depth.codec.as_str()) {
        return Err(wrong(format!("packs its depth as `{}`, which is not read", printable(&depth.codec))));
    }
    let stream = Stream::new(depth).map_err(wrong)?;
    let color = of(COLOR).and_then(|node| match color_of(depth, node) {
        Ok(stream) => Some((stream, node.pictures.clone())),
        Err(reason) => {
            remarks.push(format!("colour is left out: {reason}"));
            None
        }
    });
    let focal = stream.focal();
    let times = |places: &[Place]| -> Vec<i64> {
        places.iter().map(|place| i64::try_from(place.time_us).unwrap_or(0).saturating_mul(1000)).collect()
    };
    let color_times = color.as_ref().map_or_else(Vec::new, |(_, places)| times(places));
    let shots = shots(&times(&depth.pictures), &color_times);
    let (shots, missing) = numbered(shots, stream.period_ns());
    let is_tenths = depth.integers.get("oniPixelFormat") == Some(&TENTHS);
    let identity = DeviceIdentity {
        model: "import:oni".into(),
        calibration_assumed: !stream.has_view(),
        ..DeviceIdentity::default()
    };
    let sensor = Sensor {
        name: "camera".into(),
        identity,
        depth: stream.camera(focal),
        depth_scale: if is_tenths { 0.0001 } else { 0.001 },
        color: color
            .as_ref()
            .map(|(color, _)| color.camera(focal.map(|f| f * f64::from(color.width) / f64::from(stream.width)))),
        color_from_depth: Rigid::identity(),
        rig_from_depth: Rigid::identity(),
        fps: fps(&shots),
    };
    let album = OniAlbum { file, depth: (stream, depth.pictures.clone()), color };
    let source = StoredSource::new(path.to_path_buf(), Rig { sensors: vec![sensor] }, shots, Box::new(album), remarks)?;
    Ok(source.missing(missing))
}

/// The colour stream, where its pictures can be read and belong to depth.
fn color_of(depth: &Node, color: &Node) -> Result<Stream, String> {
    if depth.integers.get("Registration") != Some(&1) {
        return Err("the recording does not say that depth is registered to it, nor where its camera stands".into());
    }
    let stream = Stream::new(color)?;
    let is_known = stream.codec == "JPEG"
        || (stream.codec == "NONE"
            && (RGB.contains(&stream.format) || UYVY.contains(&stream.format) || stream.format == YUYV));
    if is_known { Ok(stream) } else { Err(format!("its packing `{}` is not read", printable(&stream.codec))) }
}

/// What is known of a stream.
#[derive(Debug, Clone)]
struct Stream {
    codec: String,
    format: u64,
    width: u32,
    height: u32,
    /// Frames a second; 0 where it does not say.
    rate: u32,
    is_mirrored: bool,
    /// Across and down, radians.
    view: Option<[f64; 2]>,
}

impl Stream {
    /// # Errors
    /// What the file does not say.
    fn new(node: &Node) -> Result<Self, String> {
        let mode = node.general.get("xnMapOutputMode").and_then(|bytes| bytes.first_chunk::<12>());
        let mode = mode.ok_or("does not say the size of its pictures")?;
        let [width, height, rate] =
            [0, 4, 8].map(|k| u32::from_le_bytes([mode[k], mode[k + 1], mode[k + 2], mode[k + 3]]));
        if width == 0 || height == 0 || u64::from(width) * u64::from(height) > MAX_PIXELS {
            return Err(format!("says pictures of {width} x {height} pixels: it is damaged"));
        }
        // Cropping: enabled (four bytes), then offsets and size.
        if node.general.get("xnCropping").is_some_and(|bytes| bytes.iter().take(4).any(|byte| *byte != 0)) {
            return Err("has cropped pictures, which are not read".into());
        }
        let number = |name: &str| node.integers.get(name).copied();
        let view = node.general.get("xnFOV").and_then(|bytes| bytes.first_chunk::<16>());
        let view = view.map(|bytes| [0, 8].map(|at| f64::from_le_bytes(std::array::from_fn(|k| bytes[at + k]))));
        Ok(Self {
            codec: node.codec.clone(),
            format: number("oniPixelFormat").or(number("xnPixelFormat")).unwrap_or(0),
            width,
            height,
            rate,
            is_mirrored: number("xnMirror") == Some(1),
            view: view.filter(|view| view.iter().all(|angle| (0.1..3.0).contains(angle))),
        })
    }

    fn has_view(&self) -> bool {
        self.view.is_some()
    }

    /// Focal lengths across and down, pixels.
    fn focal(&self) -> [f64; 2] {
        let usual = USUAL_FOCAL * f64::from(self.width) / 640.0;
        let of = |[across, down]: [f64; 2]| {
            [0.5 * f64::from(self.width) / (0.5 * across).tan(), 0.5 * f64::from(self.height) / (0.5 * down).tan()]
        };
        self.view.map_or([usual; 2], of)
    }

    fn camera(&self, [fx, fy]: [f64; 2]) -> PinholeCamera {
        let centre = |size: u32| 0.5 * (f64::from(size) - 1.0);
        PinholeCamera::ideal(self.width, self.height, fx, fy, centre(self.width), centre(self.height))
    }

    fn period_ns(&self) -> i64 {
        if self.rate > 0 { 1_000_000_000 / i64::from(self.rate) } else { 0 }
    }

    /// # Errors
    /// What is wrong with a picture.
    fn depth(&self, bytes: &[u8]) -> Result<DepthImage, String> {
        let count = self.width as usize * self.height as usize;
        let mut values = match self.codec.as_str() {
            "NONE" => bytes.as_chunks::<2>().0.iter().map(|b| u16::from_le_bytes(*b)).collect(),
            codec => codec::unpack(bytes, codec == "16zT", count)?,
        };
        if values.len() != count {
            return Err(format!(
                "has {} bytes, but {} x {} pixels need {}",
                bytes.len(),
                self.width,
                self.height,
                2 * count
            ));
        }
        if self.is_mirrored {
            values.chunks_exact_mut(self.width as usize).for_each(<[u16]>::reverse);
        }
        Ok(DepthImage { width: self.width, height: self.height, values })
    }

    /// # Errors
    /// What is wrong with a picture.
    fn color(&self, bytes: Vec<u8>) -> Result<ColorImage, String> {
        let rows = Rows { width: self.width, height: self.height, stride: 2 * self.width };
        let image = if self.codec == "JPEG" {
            if !self.is_mirrored {
                encoded::size(&bytes)?;
                return Ok(ColorImage::Jpeg(bytes.into()));
            }
            ColorImage::Jpeg(bytes.into())
        } else if RGB.contains(&self.format) {
            rgb_image(self.width, self.height, &bytes)
                .ok_or_else(|| format!("has {} bytes, which is not its size", bytes.len()))?
        } else {
            let swapped = if self.format == YUYV {
                bytes
            } else {
                bytes.as_chunks::<2>().0.iter().flat_map(|[a, b]| [*b, *a]).collect()
            };
            ColorImage::Rgb(Arc::new(yuyv(&swapped, rows).map_err(|error| error.to_string())?))
        };
        if !self.is_mirrored {
            return Ok(image);
        }
        let mut turned = (*image.decode(0).map_err(|error| error.to_string())?).clone();
        let width = turned.width as usize;
        turned.pixels.chunks_exact_mut(width.max(1)).for_each(<[[u8; 3]]>::reverse);
        Ok(ColorImage::Rgb(Arc::new(turned)))
    }
}

/// The pictures of a file.
#[derive(Debug)]
struct OniAlbum {
    file: File,
    depth: (Stream, Vec<Place>),
    color: Option<(Stream, Vec<Place>)>,
}

impl Album for OniAlbum {
    fn depth(&mut self, k: usize) -> Result<DepthImage, String> {
        let place = self.depth.1[k];
        self.depth.0.depth(&bytes(&mut self.file, place.at, place.length)?)
    }

    fn color(&mut self, k: usize) -> Result<ColorImage, String> {
        let (stream, places) = self.color.as_ref().ok_or("is of no stream")?;
        stream.color(bytes(&mut self.file, places[k].at, places[k].length)?)
    }
}

/// Reads a whole file and packed depth; for `fuzz/`.
pub(super) fn parse(data: &[u8]) {
    let _ = Records::read(&mut std::io::Cursor::new(data));
    let _ = (codec::unpack(data, false, 64), codec::unpack(data, true, 64));
}

#[cfg(test)]
mod tests;
