//! Pictures as JPEG: of a subject's surfaces, and of single frames.

use std::{fs, path::PathBuf};

use jpeg_encoder::{ColorType, Encoder};
use serde::{Deserialize, Serialize};
use toile_capture::{Replay, Source, Subject};
use toile_geometry::Mesh;
use toile_live::depth_colors;
use toile_pipeline::{Folders, read_mesh};
use toile_render::{Drawn, View, picture};
use utoipa::ToSchema;

use crate::{archive::Archive, error::Refusal};

/// Columns and rows of a subject's picture.
const SIZE: [u32; 2] = [240, 320];
/// Quality of pictures that people look at for long, and of live ones.
const QUALITY: u8 = 85;

/// Which picture of a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum What {
    /// Depth as colours.
    #[default]
    Depth,
    /// The camera's colour.
    Colour,
}

/// Pixels as the bytes of a JPEG file.
///
/// # Errors
/// A sentence where the size is none that such a file can have.
pub fn jpeg(pixels: &[[u8; 3]], size: [u32; 2], quality: u8) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let side = |pixels: u32| u16::try_from(pixels).map_err(|_| format!("{pixels} pixels are too many for a JPEG"));
    let (width, height) = (side(size[0])?, side(size[1])?);
    let encoder = Encoder::new(&mut bytes, quality);
    encoder.encode(pixels.as_flattened(), width, height, ColorType::Rgb).map_err(|error| error.to_string())?;
    Ok(bytes)
}

/// The picture of a subject: its garments over its body, or its last scan; kept beside the archive until its files change.
///
/// # Errors
/// 404 where nothing was made of it yet, 422 where a mesh cannot be read.
pub fn of_subject(archive: &Archive, id: &str) -> Result<Vec<u8>, Refusal> {
    let root = archive.subject(id)?;
    let (files, newest) = surfaces(&root)?;
    let kept = archive.own("pictures").join(format!("{id}-{newest}.jpg"));
    if let Ok(bytes) = fs::read(&kept) {
        return Ok(bytes);
    }
    let meshes: Vec<Mesh> = files.iter().map(|path| read_mesh(path)).collect::<Result<_, _>>()?;
    let drawn: Vec<Drawn> = meshes.iter().map(Drawn::colored).collect();
    let view = View::around(0.35, 0.05);
    let image = picture(&drawn, &view, SIZE[0], SIZE[1]).map_err(|error| Refusal::unusable(error.to_string()))?;
    let pixels: Vec<[u8; 3]> = image.pixels().map(|pixel| pixel.0).collect();
    let bytes = jpeg(&pixels, SIZE, QUALITY).map_err(Refusal::failure)?;
    // A picture that cannot be kept is drawn again.
    drop(fs::create_dir_all(archive.own("pictures")).and_then(|()| {
        remove_older(archive, id);
        fs::write(&kept, &bytes)
    }));
    Ok(bytes)
}

fn remove_older(archive: &Archive, id: &str) {
    let old = fs::read_dir(archive.own("pictures")).into_iter().flatten().flatten();
    let is_its =
        |name: &str| name.strip_prefix(id).and_then(|rest| rest.strip_prefix('-')).is_some_and(|n| !n.contains('-'));
    let its = old.filter(|entry| entry.file_name().to_str().is_some_and(is_its));
    its.for_each(|entry| drop(fs::remove_file(entry.path())));
}

/// The meshes to draw, and when the newest of them was made (seconds).
fn surfaces(root: &std::path::Path) -> Result<(Vec<PathBuf>, u64), Refusal> {
    let (subject, folders) = (Subject::open(root)?, Folders::new(root));
    let garments = subject.layers().iter().map(|layer| folders.garment(&layer.label())).filter(|path| path.exists());
    let mut files: Vec<PathBuf> = garments.collect();
    let last_scan = || subject.layers().iter().rev().map(|l| folders.scan(&l.label())).find(|path| path.exists());
    // The scan of the undressed person has the skin's colours.
    let below = subject.layers().first().map(|layer| folders.scan(&layer.label())).filter(|path| path.exists());
    if files.is_empty() {
        files.extend(last_scan());
    } else {
        files.extend(below);
    }
    let time = |path: &PathBuf| {
        let modified = fs::metadata(path).and_then(|about| about.modified()).ok()?;
        modified.duration_since(std::time::UNIX_EPOCH).ok().map(|time| time.as_secs())
    };
    let newest = files.iter().filter_map(time).max();
    let newest = newest.ok_or_else(|| Refusal::missing("nothing was made of this subject yet"))?;
    Ok((files, newest))
}

/// Frame `number` of a sensor, and its time since the sensor's first frame, seconds.
///
/// # Errors
/// 404 where there is no such frame or picture, 422 where it cannot be read.
pub fn of_frame(replay: &Replay, sensor: usize, number: u64, what: What) -> Result<(f64, Vec<u8>), Refusal> {
    let mut of_sensor = (0..replay.len()).filter(|i| replay.info(*i).is_some_and(|info| info.sensor == sensor));
    let missing = || Refusal::missing(format!("sensor {sensor} has no frame {number}"));
    let first = of_sensor.next().ok_or_else(missing)?;
    let index = match usize::try_from(number).map_err(|_| missing())? {
        0 => first,
        more => of_sensor.nth(more - 1).ok_or_else(missing)?,
    };
    let time = |i| replay.info(i).map_or(0, |info| info.device_time_ns);
    let seconds = 1e-9 * (time(index) - time(first)) as f64;
    let frame = replay.frame(index)?;
    let picture = match what {
        What::Depth => {
            let depth = frame.depth.ok_or_else(|| Refusal::missing("this frame has no depth"))?;
            let scale = replay.rig().sensors.get(sensor).map_or(1e-3, |sensor| sensor.depth_scale);
            jpeg(&depth_colors(&depth, scale), [depth.width, depth.height], QUALITY)
        }
        What::Colour => {
            let color = frame.color.ok_or_else(|| Refusal::missing("this frame has no colour"))?;
            match color {
                toile_capture::ColorImage::Jpeg(bytes) => Ok(bytes.to_vec()),
                other => {
                    let image = other.decode(index)?;
                    jpeg(&image.pixels, [image.width, image.height], QUALITY)
                }
            }
        }
    };
    Ok((seconds, picture.map_err(Refusal::unusable)?))
}
