//! Reference poses that come with a folder, for comparison only: no stage uses them.

use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Matrix4, Vector3};
use toile_geometry::Rigid;

use super::{
    format::Format,
    inventory::FolderSource,
    layout::{guess, open_folder},
    rigid::{rigid_from_matrix, rigid_from_parts},
    uva,
};
use crate::{
    CaptureError,
    files::read_text,
    trajectory::{self, TimedPose},
};

/// The poses (reference frame from camera) that come with a folder, with the device times that its frames have on import;
/// `None` where there are none.
///
/// Read are: `uva` camera.xml (R, t), `seven-scenes` pose.txt, TUM files (`groundtruth.txt`, `trajectory.txt`,
/// `truth/poses.txt`) in the folder or the one above, Open3D's `trajectory.log`.
///
/// # Errors
/// [`CaptureError`] where the folder or its poses are not readable.
pub fn reference_poses(folder: &Path) -> Result<Option<Vec<TimedPose>>, CaptureError> {
    let format = guess(folder)?;
    match format {
        Format::Uva => by_frame(&open_folder(folder, format, false)?, uva_pose).map(Some),
        Format::SevenScenes => by_frame(&open_folder(folder, format, false)?, seven_scenes_pose).map(Some),
        Format::ToileFolder | Format::Tum => beside(folder, format),
        _ => Ok(None),
    }
}

fn by_frame(
    source: &FolderSource,
    read: impl Fn(&Path) -> Result<Option<Rigid>, CaptureError>,
) -> Result<Vec<TimedPose>, CaptureError> {
    let mut poses = Vec::new();
    for entry in source.entries() {
        let Some(depth) = &entry.depth else { continue };
        if let Some(pose) = read(depth)? {
            poses.push(TimedPose { time_ns: entry.time_ns, pose });
        }
    }
    Ok(poses)
}

fn uva_pose(depth: &Path) -> Result<Option<Rigid>, CaptureError> {
    let Some(path) = sibling(depth, "_depth.png", "_camera.xml") else { return Ok(None) };
    let r = Matrix3::from_row_slice(&uva::read_matrix::<9>(&path, "R")?);
    let [x, y, z] = uva::read_matrix::<3>(&path, "t")?;
    let pose = rigid_from_parts(&r, Vector3::new(x, y, z));
    pose.map(Some).ok_or_else(|| CaptureError::field(&path, "R", "is not a rotation"))
}

fn seven_scenes_pose(depth: &Path) -> Result<Option<Rigid>, CaptureError> {
    let Some(path) = sibling(depth, ".depth.png", ".pose.txt") else { return Ok(None) };
    let text = read_text(&path)?;
    let numbers: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
    let matrix = numbers.filter(|numbers| numbers.len() == 16).map(|numbers| Matrix4::from_row_slice(&numbers));
    let pose = matrix.and_then(|matrix| rigid_from_matrix(&matrix));
    pose.map(Some).ok_or_else(|| CaptureError::format(&path, "must hold a 4x4 rigid transform"))
}

fn sibling(depth: &Path, from: &str, to: &str) -> Option<PathBuf> {
    let name = depth.file_name()?.to_str()?.strip_suffix(from)?;
    let path = depth.with_file_name(format!("{name}{to}"));
    path.exists().then_some(path)
}

fn beside(folder: &Path, format: Format) -> Result<Option<Vec<TimedPose>>, CaptureError> {
    let mut places = vec![folder.join("truth/poses.txt")];
    for place in [Some(folder), folder.parent()].into_iter().flatten() {
        places.extend(["groundtruth.txt", "trajectory.txt"].map(|name| place.join(name)));
    }
    if let Some(path) = places.iter().find(|path| path.is_file()) {
        return trajectory::read(path).map(Some);
    }
    let log = folder.join("trajectory.log");
    if !log.is_file() {
        return Ok(None);
    }
    let text = read_text(&log)?;
    let source = open_folder(folder, format, false)?;
    parse_log(&text, &source).map(Some).ok_or_else(|| {
        CaptureError::format(&log, "must hold, a frame, a line of three numbers and a 4x4 rigid transform")
    })
}

/// Open3D's log: three numbers, of which the first is the frame's position, then a 4×4 camera-to-world matrix.
fn parse_log(text: &str, source: &FolderSource) -> Option<Vec<TimedPose>> {
    let numbers: Vec<f64> = text.split_whitespace().map(|word| word.parse().ok()).collect::<Option<_>>()?;
    let (blocks, rest) = numbers.as_chunks::<19>();
    if !rest.is_empty() {
        return None;
    }
    let pose = |block: &[f64; 19]| {
        let time_ns = source.entries().get(block[0] as usize)?.time_ns;
        Some(TimedPose { time_ns, pose: rigid_from_matrix(&Matrix4::from_row_slice(&block[3..]))? })
    };
    blocks.iter().map(pose).collect()
}
