//! `.sens`: recordings of BundleFusion and ScanNet (version 4). Numbers are little-endian; depth is 16 bits, packed with zlib
//! or not; colour is JPEG or PNG. The cameras' matrices stand at the start, as they are for the recorded sizes.

use std::{
    fs::File,
    io::{Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

use toile_geometry::{Rigid, camera::PinholeCamera};

use super::{
    inventory::{DEFAULT_FPS, steady_time},
    stored::{Album, Shot, StoredSource, fps},
};
use crate::{CaptureError, ColorImage, DepthImage, DeviceIdentity, Rig, Sensor, encoded, files::open_regular};

/// The version that is read.
const VERSION: u32 = 4;
/// Bytes of a frame before its pictures: a pose, two times, two lengths.
const FRAME_HEAD: usize = 96;
/// The largest picture, packed, bytes.
const MAX_PICTURE: u64 = 160 << 20;
/// More frames than these are not indexed: nine hours at 30 a second.
const MAX_FRAMES: u64 = 1 << 20;

/// How pictures are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum DepthPacking {
    Raw,
    Zlib,
}

/// Opens a recording.
///
/// # Errors
/// [`CaptureError`] that says what is wrong, or which kind of it is not read.
pub(super) fn open(path: &Path) -> Result<StoredSource, CaptureError> {
    let wrong = |reason: String| CaptureError::format(path, reason);
    let mut file = open_regular(path)?;
    let length = file.metadata().map_err(|error| CaptureError::io(path, error))?.len();
    let head = Head::read(&mut file).map_err(wrong)?;
    let mut remarks = Vec::new();
    let frames = list_frames(&mut file, length, head.frames).map_err(wrong)?;
    if (frames.len() as u64) < head.frames {
        remarks.push(format!("of {} frames that it announces, {} are in it: it is cut off", head.frames, frames.len()));
    }
    let is_timed = frames.windows(2).all(|pair| pair[1].time_us > pair[0].time_us);
    if !is_timed {
        remarks.push(format!("its frames have no times that rise; {DEFAULT_FPS} frames a second are assumed"));
    }
    let has_color = frames.iter().any(|frame| frame.color.1 > 0);
    let color = (has_color && head.color.is_some()).then_some(head.color).flatten();
    if has_color && color.is_none() {
        remarks.push("its colour is left out: the calibration of the colour camera is not that of a camera".into());
    }
    let shot = |(k, frame): (usize, &FrameAt)| Shot {
        number: k as u64,
        time_ns: if is_timed { frame.time_us.saturating_mul(1000) } else { steady_time(k as u64, DEFAULT_FPS) },
        depth: (frame.depth.1 > 0).then_some(k),
        color: (frame.color.1 > 0).then_some(k),
    };
    let shots: Vec<Shot> = frames.iter().enumerate().map(shot).collect();
    let sensor = Sensor {
        name: "camera".into(),
        identity: DeviceIdentity { model: "import:sens".into(), ..DeviceIdentity::default() },
        depth: head.depth,
        depth_scale: head.depth_scale,
        color,
        color_from_depth: Rigid::identity(),
        rig_from_depth: Rigid::identity(),
        fps: fps(&shots),
    };
    let album = SensAlbum {
        path: path.to_path_buf(),
        file,
        frames,
        packing: head.packing,
        size: (head.depth.width, head.depth.height),
    };
    StoredSource::new(path.to_path_buf(), Rig { sensors: vec![sensor] }, shots, Box::new(album), remarks)
}

/// The start of a file.
#[derive(Debug)]
struct Head {
    depth: PinholeCamera,
    color: Option<PinholeCamera>,
    depth_scale: f64,
    packing: DepthPacking,
    frames: u64,
}

impl Head {
    /// # Errors
    /// What is wrong with it.
    fn read(reader: &mut impl Read) -> Result<Self, String> {
        let version = u32::from_le_bytes(array(reader)?);
        if version != VERSION {
            return Err(format!("is not a .sens file of version {VERSION}: its first number is {version}"));
        }
        let name_length = u64::from_le_bytes(array(reader)?);
        if name_length > 4096 {
            return Err("is not a .sens file: the name of its sensor is too long".into());
        }
        reader.take(name_length).read_to_end(&mut Vec::new()).map_err(|error| error.to_string())?;
        let mut matrix = || -> Result<[f32; 16], String> {
            let bytes: [u8; 64] = array(reader)?;
            Ok(std::array::from_fn(|k| {
                f32::from_le_bytes([bytes[4 * k], bytes[4 * k + 1], bytes[4 * k + 2], bytes[4 * k + 3]])
            }))
        };
        let [color_k, _, depth_k, _] = [matrix()?, matrix()?, matrix()?, matrix()?];
        let mut word = || array(reader).map(u32::from_le_bytes);
        let (_, packing) = (word()?, word()?);
        let [color_width, color_height, width, height] = [word()?, word()?, word()?, word()?];
        let shift = f32::from_le_bytes(array(reader)?);
        let frames = u64::from_le_bytes(array(reader)?);
        let packing = match packing {
            0 => DepthPacking::Raw,
            1 => DepthPacking::Zlib,
            other => return Err(format!("packs its depth in the way {other} (OpenNI's codec), which is not read")),
        };
        let camera = |k: &[f32; 16], width, height| {
            let [fx, cx, fy, cy] = [0, 2, 5, 6].map(|i| f64::from(k[i]));
            Some(PinholeCamera::ideal(width, height, fx, fy, cx, cy)).filter(PinholeCamera::is_valid)
        };
        let depth =
            camera(&depth_k, width, height).ok_or("says a calibration of depth that is not that of a camera")?;
        let pixels = u64::from(width) * u64::from(height);
        if !(1.0..=1e6).contains(&shift) || pixels > 1 << 26 || frames > MAX_FRAMES {
            return Err(format!(
                "says {frames} frames of {width} x {height} pixels at {shift} units a metre: it is damaged"
            ));
        }
        let color = camera(&color_k, color_width, color_height);
        Ok(Self { depth, color, depth_scale: 1.0 / f64::from(shift), packing, frames })
    }
}

fn array<const N: usize>(reader: &mut impl Read) -> Result<[u8; N], String> {
    let mut bytes = [0; N];
    reader.read_exact(&mut bytes).map(|()| bytes).map_err(|_| "is cut off in its head".to_string())
}

/// Where the pictures of a frame are: offset and length.
#[derive(Debug)]
struct FrameAt {
    time_us: i64,
    color: (u64, u64),
    depth: (u64, u64),
}

fn list_frames(file: &mut File, length: u64, count: u64) -> Result<Vec<FrameAt>, String> {
    let mut frames = Vec::new();
    let mut at = file.stream_position().map_err(|error| error.to_string())?;
    for _ in 0..count {
        let mut head = [0; FRAME_HEAD];
        if file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(&mut head)).is_err() {
            break;
        }
        let word = |k: usize| u64::from_le_bytes(std::array::from_fn(|i| head[64 + 8 * k + i]));
        let [color_time, depth_time, color_length, depth_length] = [0, 1, 2, 3].map(word);
        let color_at = at + FRAME_HEAD as u64;
        let depth_at = color_at.saturating_add(color_length);
        let end = depth_at.saturating_add(depth_length);
        if end > length || color_length > MAX_PICTURE || depth_length > MAX_PICTURE {
            break;
        }
        let time = if depth_time > 0 { depth_time } else { color_time };
        let time_us = i64::try_from(time).unwrap_or(0);
        frames.push(FrameAt { time_us, color: (color_at, color_length), depth: (depth_at, depth_length) });
        at = end;
    }
    Ok(frames)
}

#[derive(Debug)]
struct SensAlbum {
    path: PathBuf,
    file: File,
    frames: Vec<FrameAt>,
    packing: DepthPacking,
    size: (u32, u32),
}

impl SensAlbum {
    fn read(&mut self, (at, length): (u64, u64)) -> Result<Vec<u8>, String> {
        let mut bytes = vec![0; length as usize];
        let read = self.file.seek(SeekFrom::Start(at)).and_then(|_| self.file.read_exact(&mut bytes));
        read.map(|()| bytes).map_err(|error| format!("cannot be read from {}: {error}", self.path.display()))
    }
}

impl Album for SensAlbum {
    fn depth(&mut self, k: usize) -> Result<DepthImage, String> {
        let packed = self.read(self.frames[k].depth)?;
        unpack_depth(&packed, self.packing, self.size)
    }

    fn color(&mut self, k: usize) -> Result<ColorImage, String> {
        let bytes = self.read(self.frames[k].color)?;
        encoded::size(&bytes)?;
        let is_png = encoded::is_png(&bytes);
        Ok(if is_png { ColorImage::Png(bytes.into()) } else { ColorImage::Jpeg(bytes.into()) })
    }
}

fn unpack_depth(packed: &[u8], packing: DepthPacking, (width, height): (u32, u32)) -> Result<DepthImage, String> {
    let size = 2 * width as usize * height as usize;
    let unpacked;
    let bytes = match packing {
        DepthPacking::Raw => packed,
        DepthPacking::Zlib => {
            unpacked = miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(packed, size)
                .map_err(|error| format!("cannot be unpacked: {error}"))?;
            unpacked.as_slice()
        }
    };
    if bytes.len() != size {
        return Err(format!("has {} bytes, but {width} x {height} pixels need {size}", bytes.len()));
    }
    let values = bytes.as_chunks::<2>().0.iter().map(|b| u16::from_le_bytes(*b)).collect();
    Ok(DepthImage { width, height, values })
}

/// Reads a head and a packed picture; for `fuzz/`.
pub(super) fn parse(bytes: &[u8]) {
    let _ = (Head::read(&mut &bytes[..]).is_ok(), unpack_depth(bytes, DepthPacking::Zlib, (8, 8)).is_ok());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Source;

    /// A file of `count` frames of 4 × 2 pixels, written from the format's public description.
    pub(super) fn sens(count: u64, packing: u32, times: &[u64]) -> Vec<u8> {
        let matrix = |f: f32, cx: f32, cy: f32| {
            let m = [f, 0.0, cx, 0.0, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
            m.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>()
        };
        let mut bytes = [4_u32.to_le_bytes().to_vec(), 3_u64.to_le_bytes().to_vec(), b"abc".to_vec()].concat();
        bytes.extend(
            [matrix(9.0, 3.0, 2.0), matrix(1.0, 0.0, 0.0), matrix(5.0, 1.5, 0.5), matrix(1.0, 0.0, 0.0)].concat(),
        );
        [2, packing, 8, 4, 4, 2].iter().for_each(|n: &u32| bytes.extend(n.to_le_bytes()));
        bytes.extend(1000_f32.to_le_bytes());
        bytes.extend(count.to_le_bytes());
        for (k, time) in times.iter().enumerate() {
            let raw: Vec<u8> = (0..8).flat_map(|p| (1000 * k as u16 + p).to_le_bytes()).collect();
            let depth = if packing == 1 { miniz_oxide::deflate::compress_to_vec_zlib(&raw, 6) } else { raw };
            let mut jpeg = Vec::new();
            let picture = image::RgbImage::from_pixel(8, 4, image::Rgb([90, 90, 90]));
            picture.write_to(&mut std::io::Cursor::new(&mut jpeg), image::ImageFormat::Jpeg).unwrap();
            bytes.extend([0; 64]);
            [0, *time, jpeg.len() as u64, depth.len() as u64].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
            bytes.extend(jpeg);
            bytes.extend(depth);
        }
        bytes
    }

    fn opened(bytes: &[u8]) -> Result<StoredSource, String> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("scene.sens");
        std::fs::write(&path, bytes).unwrap();
        open(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn frames_come_with_their_times_and_both_cameras() {
        for packing in [0, 1] {
            let mut source = opened(&sens(2, packing, &[1_000_000, 1_050_000])).unwrap();
            let sensor = source.rig().sensors[0].clone();
            let [depth, color] = [sensor.depth, sensor.color.unwrap()];
            assert_eq!((depth.fx, depth.cx, depth.cy, color.fx, color.cy), (5.0, 1.5, 0.5, 9.0, 2.0));
            assert!((sensor.fps - 20.0).abs() < 1e-9 && source.remarks().is_empty());
            source.next_frame().unwrap();
            let frame = source.next_frame().unwrap().unwrap();
            assert_eq!((frame.device_time_ns, frame.depth.unwrap().values[7]), (1_050_000_000, 1007));
            assert_eq!(frame.color.unwrap().decode(1).unwrap().width, 8);
        }
    }

    #[test]
    fn what_is_missing_is_said() {
        let whole = sens(3, 1, &[0, 0, 0]);
        let source = opened(&whole[..whole.len() - 5]).unwrap();
        assert_eq!(source.frame_count(), Some(2));
        let said = source.remarks().join("; ");
        assert!(said.contains("of 3 frames") && said.contains("assumed"), "{said}");
        assert!(opened(&sens(1, 2, &[0])).unwrap_err().contains("OpenNI"));
        assert!(opened(&whole[..100]).unwrap_err().contains("cut off"));
        assert!(opened(&[9; 100]).unwrap_err().contains("version 4"));
    }
}
