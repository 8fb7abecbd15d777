//! A subject as folders of images, the layout that `toile import` reads, with the truth beside.

use std::{io::Cursor, path::Path};

use image::{ImageBuffer, ImageFormat, Luma};
use serde_json::json;
use toile_capture::{ColorImage, DepthImage, atomic_write};

use crate::{SyntheticError, sensor::DEPTH_SCALE, settings::SyntheticSettings, subject::Subject, take::Take, truth};

/// Writes every take of a subject: `DIR/NN-layer/` with depth/, color/, camera.json,
/// timestamps.txt and truth/, and `DIR/subject.json`.
///
/// # Errors
/// [`SyntheticError`] where a garment cannot be made or a file cannot be written.
pub fn write_subject_folder(
    subject: &Subject,
    dir: &Path,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<(), SyntheticError> {
    if subject.settings.rig.sensors > 1 {
        let reason = "folders of images hold one sensor; record a rig as a subject";
        return Err(SyntheticError::setting("sensors", reason));
    }
    for n in 0..subject.take_count() {
        let take = subject.take(n)?;
        let share = 1.0 / subject.take_count() as f32;
        let folder = dir.join(&take.name);
        write_frames(&take, &subject.settings, &folder, &|p| progress((n as f32 + 0.9 * p) * share))?;
        truth::write_take(&take, dir)?;
    }
    truth::write_person(subject, dir)?;
    progress(1.0);
    Ok(())
}

/// Writes a take's frames, camera.json and timestamps.txt.
///
/// # Errors
/// [`SyntheticError`] names the frame or file at fault.
pub fn write_frames(
    take: &Take,
    settings: &SyntheticSettings,
    folder: &Path,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<(), SyntheticError> {
    let mut times = String::new();
    for index in 0..take.moments.len() {
        let frame = take.frame(index)?;
        if let Some(depth) = &frame.depth {
            let png = encode_depth(depth).map_err(|e| SyntheticError::Encode { index, reason: e.to_string() })?;
            atomic_write(&folder.join(format!("depth/{index:06}.png")), &png)?;
        }
        if let Some(ColorImage::Jpeg(bytes)) = &frame.color {
            atomic_write(&folder.join(format!("color/{index:06}.jpg")), bytes)?;
        }
        times.push_str(&format!("{}\n", frame.device_time_ns));
        progress((index + 1) as f32 / take.moments.len() as f32);
    }
    atomic_write(&folder.join("timestamps.txt"), times.as_bytes())?;
    atomic_write(&folder.join("camera.json"), camera_json(take, settings).as_bytes())?;
    Ok(())
}

fn encode_depth(depth: &DepthImage) -> Result<Vec<u8>, image::ImageError> {
    let image: ImageBuffer<Luma<u16>, &[u16]> = ImageBuffer::from_raw(depth.width, depth.height, &depth.values[..])
        .ok_or_else(|| image::ImageError::IoError(std::io::Error::other("the depth image has no pixels")))?;
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png)?;
    Ok(bytes.into_inner())
}

fn camera_json(take: &Take, settings: &SyntheticSettings) -> String {
    let c = take.told_camera();
    let value = json!({
        "width": c.width,
        "height": c.height,
        "fx": c.fx,
        "fy": c.fy,
        "cx": c.cx,
        "cy": c.cy,
        "depth_scale": DEPTH_SCALE,
        "fps": settings.fps,
        "distortion": c.distortion,
        "convention": "pixel centre of column u, row v: x = (u - cx) / fx * z, y = (v - cy) / fy * z; x right, y down, z forward; colour registered to depth",
    });
    format!("{value:#}\n")
}
