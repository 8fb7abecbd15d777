//! Where the subject is: the cylinder about the axis of the turn, above the disk or floor.
//!
//! The camera rests and the subject turns, so what moves is the subject. Depth images spread over the take give the
//! farthest stable depth of each pixel (the background); pixels well before it are moving points. Their largest
//! cluster stands on the highest level patch of background near it: the disk, the floor, or nothing at all.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use toile_geometry::{Rigid, camera::PinholeCamera};

use super::{
    background::Background,
    cut::SubjectVolume,
    floor::Floor,
    upright::{ImageSide, find_up},
};
use crate::{
    FusionError,
    frame::{is_measured, unproject},
};

/// Frames that are looked at, at most.
pub(crate) const SURVEY_FRAMES: usize = 40;
/// A pixel moves where it is this much nearer than its background: metres, and share of the depth.
const MOVING: (f32, f32) = (0.06, 0.03);
/// Edge of the cells that moving points are clustered in, metres.
const CELL: f32 = 0.10;
/// Smallest number of moving pixels a frame that counts as somebody, as a share of the image.
const MIN_MOVING: f32 = 0.001;
/// Room left around what moved, metres.
pub(super) const MARGIN: f64 = 0.06;

/// Finds the subject's volume in depth images (metres, edges already dropped) spread over a take.
///
/// # Errors
/// [`FusionError::NobodyInIt`] where nothing of a person's size moves.
pub(crate) fn find_volume(camera: &PinholeCamera, depths: &[Vec<f32>]) -> Result<SubjectVolume, FusionError> {
    let background = Background::new(depths);
    let moving = moving_points(camera, depths, &background);
    let least = (MIN_MOVING * background.far.len() as f32) as usize * depths.len();
    let nobody = |reason: String| FusionError::NobodyInIt { reason };
    if moving.len() * SAMPLE * SAMPLE < least {
        return Err(nobody(format!("only {} of the looked-at pixels ever move", moving.len() * SAMPLE * SAMPLE)));
    }
    let subject = largest_cluster(&moving);
    if subject.len() * SAMPLE * SAMPLE < least {
        return Err(nobody("the moving parts are scattered, not one subject".into()));
    }
    let (image_up, floor) = find_up(camera, &background.resting, &subject);
    Ok(cylinder(&subject, image_up, floor))
}

/// Pixels between the rows, and between the columns, that the survey looks at.
pub(super) const SAMPLE: usize = 2;

fn moving_points(camera: &PinholeCamera, depths: &[Vec<f32>], background: &Background) -> Vec<Point3<f32>> {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let mut points = Vec::new();
    for depth in depths {
        for y in (0..h).step_by(SAMPLE) {
            for x in (0..w).step_by(SAMPLE) {
                let i = y * w + x;
                let (d, far) = (depth[i], background.far[i]);
                let passes = background.open[i] || d < far - MOVING.0.max(MOVING.1 * far);
                if is_measured(d) && passes {
                    points.push(unproject(camera, x as f32, y as f32, d).into());
                }
            }
        }
    }
    points
}

/// The points in the largest 26-connected group of occupied cells.
pub(super) fn largest_cluster(points: &[Point3<f32>]) -> Vec<Point3<f32>> {
    use std::collections::BTreeMap;
    let cell = |p: &Point3<f32>| [p.x, p.y, p.z].map(|c| (c / CELL).floor() as i32);
    let mut counts: BTreeMap<[i32; 3], usize> = BTreeMap::new();
    points.iter().for_each(|p| *counts.entry(cell(p)).or_default() += 1);
    let least = (points.len() / 20_000).max(3);
    counts.retain(|_, n| *n >= least);
    let mut label: BTreeMap<[i32; 3], usize> = BTreeMap::new();
    let mut best = (0, usize::MAX);
    for (name, &start) in counts.keys().enumerate() {
        if label.contains_key(&start) {
            continue;
        }
        let (mut stack, mut total) = (vec![start], 0);
        label.insert(start, name);
        while let Some(c) = stack.pop() {
            total += counts[&c];
            for k in 0..27 {
                let n = [c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1];
                if counts.contains_key(&n) && !label.contains_key(&n) {
                    label.insert(n, name);
                    stack.push(n);
                }
            }
        }
        if total > best.0 {
            best = (total, name);
        }
    }
    points.iter().filter(|p| label.get(&cell(p)) == Some(&best.1)).copied().collect()
}

/// The cylinder about the axis: its lateral centre is the middle of the swept silhouette, its depth that of the
/// points at the silhouette's lateral extremes, where a surface of revolution is as deep as its axis.
fn cylinder(subject: &[Point3<f32>], image_up: ImageSide, floor: Option<Floor>) -> SubjectVolume {
    let up = floor.as_ref().map_or_else(|| image_up.direction(), |f| f.normal);
    let leveled_from_camera = level(up);
    let leveled: Vec<Point3<f64>> = subject.iter().map(|p| leveled_from_camera * p.cast::<f64>()).collect();
    let xs = sorted(leveled.iter().map(|p| p.x));
    let (left, right) = (percentile(&xs, 0.002), percentile(&xs, 0.998));
    let x = 0.5 * (left + right);
    let reach = 0.5 * (right - left);
    let rim = sorted(leveled.iter().filter(|p| (p.x - x).abs() > 0.85 * reach).map(|p| p.z));
    let z = percentile(&rim, 0.5);
    let radii = sorted(leveled.iter().map(|p| (p.x - x).hypot(p.z - z)));
    let radius = 1.05 * percentile(&radii, 0.999) + MARGIN;
    let heights = sorted(leveled.iter().map(|p| p.y));
    let ground = match &floor {
        Some(f) => floor_height(&leveled_from_camera, f, x, z),
        None => percentile(&heights, 0.001),
    };
    let shift = Translation3::new(-x, -ground, -z);
    let bottom = floor.as_ref().map(|f| f.margin);
    SubjectVolume { model_from_camera: shift * leveled_from_camera, radius, bottom, floor, image_up }
}

/// Height of the floor plane at (x, z), leveled frame (where it is level by construction).
pub(super) fn floor_height(leveled_from_camera: &Rigid, floor: &Floor, x: f64, z: f64) -> f64 {
    let n = leveled_from_camera.rotation * floor.normal;
    let on = leveled_from_camera * floor.point;
    on.y - (n.x * (x - on.x) + n.z * (z - on.z)) / n.y.max(0.1)
}

/// A frame with the camera's centre as origin, +Y = `up`, +Z towards the camera (backwards along its axis).
pub(super) fn level(up: Vector3<f64>) -> Rigid {
    let y = up.normalize();
    let back = Vector3::new(0.0, 0.0, -1.0);
    let z = (back - y * y.dot(&back)).try_normalize(1e-6).unwrap_or_else(Vector3::z);
    let x = y.cross(&z);
    let rows = Rotation3::from_basis_unchecked(&[x, y, z]).transpose();
    Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_rotation_matrix(&rows))
}

pub(super) fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all: Vec<f64> = values.collect();
    all.sort_unstable_by(f64::total_cmp);
    all
}

/// The value at share `q` of ascending values; 0 where there are none.
pub(super) fn percentile(ascending: &[f64], q: f64) -> f64 {
    let last = ascending.len().saturating_sub(1);
    ascending.get((last as f64 * q).round() as usize).copied().unwrap_or(0.0)
}
