//! Where the subject is: the cylinder about the axis of the turn, above the disk or floor.
//!
//! The camera rests and the subject turns, so what moves is the subject. Depth images spread over the take give the
//! farthest stable depth of each pixel (the background); pixels well before it are moving points. Their largest
//! cluster stands on the highest level patch of background near it: the disk, the floor, or nothing at all.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::{
    FusionError,
    floor::{Floor, find_floor},
    lanes::{Kernel, LANES, Lanes, dispatch, group, put_group},
    view::{is_measured, unproject},
};

/// Most frames that are looked at.
pub const SURVEY_FRAMES: usize = 40;
/// A pixel moves where it is this much nearer than its background: metres, and share of the depth.
const MOVING: (f32, f32) = (0.06, 0.03);
/// Share of the frames that must agree on a pixel's background for it to rest.
const RESTING: f32 = 0.4;
/// A pixel measured in at most this share of the frames sees nothing but what passes.
const PASSING: f32 = 0.25;
/// Rounds in which a pixel's window of resting depths is centred.
const CENTERING: usize = 3;
/// Edge of the cells that moving points are clustered in, metres.
const CELL: f32 = 0.10;
/// Least moving pixels a frame, as a share of the image, that count as somebody.
const LEAST_MOVING: f32 = 0.001;
/// Room left around what moved, metres.
const MARGIN: f64 = 0.06;

/// The part of space that is fused, in a first scan frame: +Y up, +Z towards the camera at the first frame, origin
/// on the axis of the turn at the floor's (or lowest moving point's) height.
#[derive(Debug, Clone, PartialEq)]
pub struct SubjectVolume {
    /// The resting camera in the first scan frame.
    pub scan_from_camera: Rigid,
    /// Radius of the cylinder, metres.
    pub radius: f64,
    /// Points below this height are floor or disk; `None` where no floor is in view.
    pub bottom: Option<f64>,
    /// The floor plane, camera frame.
    pub floor: Option<Floor>,
}

/// Finds the subject's volume in depth images (metres, edges already dropped) spread over a take.
///
/// # Errors
/// [`FusionError::NobodyInIt`] where nothing of a person's size moves.
pub fn find_volume(camera: &PinholeCamera, depths: &[Vec<f32>]) -> Result<SubjectVolume, FusionError> {
    let background = Background::new(depths);
    let moving = moving_points(camera, depths, &background);
    let least = (LEAST_MOVING * background.far.len() as f32) as usize * depths.len();
    let nobody = |reason: String| FusionError::NobodyInIt { reason };
    if moving.len() * SAMPLE * SAMPLE < least {
        return Err(nobody(format!("only {} of the looked-at pixels ever move", moving.len() * SAMPLE * SAMPLE)));
    }
    let subject = largest_cluster(&moving);
    if subject.len() * SAMPLE * SAMPLE < least {
        return Err(nobody("what moves is scattered, no single subject".into()));
    }
    let floor = find_floor(camera, &background.resting, &subject);
    let up = floor.as_ref().map_or_else(|| Vector3::new(0.0, -1.0, 0.0), |f| f.normal);
    Ok(cylinder(&subject, up, floor))
}

/// Pixels of the survey are taken every so many rows and columns.
const SAMPLE: usize = 2;

/// The resting surface of each pixel over the frames of a survey.
#[derive(Debug, Clone, Default)]
pub(crate) struct Resting {
    /// Median depth, metres; 0 where nothing rests.
    pub depth: Vec<f32>,
    /// Standard deviation of a single frame's depth, metres; 0 where nothing rests.
    pub noise: Vec<f32>,
}

/// What rests behind the subject.
struct Background {
    /// The farthest depth of each pixel that a second frame confirms; 0 where there is none.
    far: Vec<f32>,
    /// Where many frames agree on that depth: what it is.
    resting: Resting,
    /// True where few frames measure anything: what is seen there passes by.
    open: Vec<bool>,
}

impl Background {
    fn new(depths: &[Vec<f32>]) -> Self {
        let count = depths.first().map_or(0, Vec::len);
        let (mut far, mut resting, mut open) = (Vec::new(), Resting::default(), Vec::new());
        let mut values = Vec::with_capacity(depths.len());
        for i in 0..count {
            values.clear();
            values.extend(depths.iter().map(|d| d[i]).filter(|&d| is_measured(d)));
            values.sort_unstable_by(f32::total_cmp);
            let confirmed = values.windows(2).rev().find(|w| w[1] - w[0] < 0.02 * w[1]).map_or(0.0, |w| w[0]);
            let near = confirmed - 0.015f32.max(0.012 * confirmed);
            let agreeing = &values[values.partition_point(|&d| d < near)..];
            let rests = agreeing.len() as f32 >= RESTING * depths.len() as f32;
            let (depth, noise) = if rests { median_and_deviation(&values, agreeing) } else { (0.0, 0.0) };
            resting.depth.push(depth);
            resting.noise.push(noise);
            far.push(confirmed);
            open.push(values.len() as f32 <= PASSING * depths.len() as f32);
        }
        Self { far, resting, open }
    }
}

/// Median of the depths of a resting surface and their standard deviation about it, from all of a pixel's depths
/// (ascending) and the farthest ones that agree. The farthest depths alone lie behind the surface by twice the noise, so
/// the window is moved until it reaches as far before the median as behind it.
fn median_and_deviation(ascending: &[f32], farthest: &[f32]) -> (f32, f32) {
    let mut window = farthest;
    for _ in 0..CENTERING {
        let (median, last) = (window[window.len() / 2], window[window.len() - 1]);
        let end = ascending.partition_point(|&d| d <= last);
        window = &ascending[ascending.partition_point(|&d| d < 2.0 * median - last)..end];
    }
    let median = window[window.len() / 2];
    let squares: f32 = window.iter().map(|d| (d - median) * (d - median)).sum();
    (median, (squares / window.len() as f32).sqrt())
}

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
fn largest_cluster(points: &[Point3<f32>]) -> Vec<Point3<f32>> {
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
fn cylinder(subject: &[Point3<f32>], up: Vector3<f64>, floor: Option<Floor>) -> SubjectVolume {
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
    SubjectVolume { scan_from_camera: shift * leveled_from_camera, radius, bottom, floor }
}

/// Height of the floor plane at (x, z), leveled frame (where it is level by construction).
fn floor_height(leveled_from_camera: &Rigid, floor: &Floor, x: f64, z: f64) -> f64 {
    let n = leveled_from_camera.rotation * floor.normal;
    let on = leveled_from_camera * floor.point;
    on.y - (n.x * (x - on.x) + n.z * (z - on.z)) / n.y.max(0.1)
}

/// A frame with the camera's centre as origin, +Y = `up`, +Z towards the camera (backwards along its axis).
fn level(up: Vector3<f64>) -> Rigid {
    let y = up.normalize();
    let back = Vector3::new(0.0, 0.0, -1.0);
    let z = (back - y * y.dot(&back)).try_normalize(1e-6).unwrap_or_else(Vector3::z);
    let x = y.cross(&z);
    let rows = Rotation3::from_basis_unchecked(&[x, y, z]).transpose();
    Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_rotation_matrix(&rows))
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all: Vec<f64> = values.collect();
    all.sort_unstable_by(f64::total_cmp);
    all
}

/// The value at share `q` of ascending values; 0 of none.
fn percentile(ascending: &[f64], q: f64) -> f64 {
    let last = ascending.len().saturating_sub(1);
    ascending.get((last as f64 * q).round() as usize).copied().unwrap_or(0.0)
}

impl SubjectVolume {
    /// Depth with everything outside the volume taken away.
    pub fn cut(&self, camera: &PinholeCamera, depth: &[f32]) -> Vec<f32> {
        dispatch(Cut { volume: self, camera, depth })
    }
}

struct Cut<'a> {
    volume: &'a SubjectVolume,
    camera: &'a PinholeCamera,
    depth: &'a [f32],
}

impl Kernel for Cut<'_> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> Vec<f32> {
        let (camera, width) = (self.camera, self.camera.width as usize);
        let rotation = self.volume.scan_from_camera.rotation.to_rotation_matrix();
        let turn: [[f32; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)] as f32));
        let shift: [f32; 3] = self.volume.scan_from_camera.translation.vector.cast::<f32>().into();
        let bottom = l.splat(self.volume.bottom.map_or(f32::NEG_INFINITY, |b| b as f32));
        let reach = l.splat((self.volume.radius * self.volume.radius) as f32);
        let rays: Vec<f32> = (0..width).map(|u| unproject(camera, u as f32, 0.0, 1.0)[0]).collect();
        let mut cut = vec![0.0; self.depth.len()];
        for (v, (row, out)) in self.depth.chunks(width.max(1)).zip(cut.chunks_mut(width.max(1))).enumerate() {
            let y = unproject(camera, 0.0, v as f32, 1.0)[1];
            for x in (0..width).step_by(LANES) {
                let d = l.load(&group(row, x));
                if !l.any(l.gt(d, l.splat(0.0))) {
                    continue;
                }
                let ray = l.load(&group(&rays, x));
                let px = coordinate(l, turn[0], shift[0], ray, y, d);
                let py = coordinate(l, turn[1], shift[1], ray, y, d);
                let pz = coordinate(l, turn[2], shift[2], ray, y, d);
                let within = l.gt(reach, l.add(l.mul(px, px), l.mul(pz, pz)));
                put_group(out, x, l.store(l.keep(l.and(within, l.gt(py, bottom)), d)));
            }
        }
        cut
    }
}

/// One coordinate of the points at depths along rays, from its row of a transform.
#[inline(always)]
fn coordinate<L: Lanes>(l: L, turn: [f32; 3], shift: f32, ray: L::F, y: f32, depth: L::F) -> L::F {
    let across = l.add(l.mul(ray, l.splat(turn[0])), l.splat(turn[1] * y + turn[2]));
    l.add(l.mul(across, depth), l.splat(shift))
}
