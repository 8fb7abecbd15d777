//! The level plane that the subject stands on: the disk, else the floor.

use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};
use toile_geometry::camera::PinholeCamera;

use super::{background::Resting, bend::bend_of};
use crate::frame::{surface_elements, unproject};

/// Largest angle between the floor's normal and the direction that is up in the image, as a cosine (40°).
const UPWARD: f32 = 0.77;
/// Largest angle between a pixel's normal and its plane's, as a cosine (25°).
const ALIGNED: f64 = 0.906;
/// Distance from a plane within which a pixel belongs to it, metres.
const BAND: f64 = 0.012;
/// Smallest share of the upward background pixels that makes a floor.
const MIN_SHARE: f64 = 0.15;
/// A floor is looked for where there are at least this many upward background pixels (on every second row and column).
const MIN_PIXELS: usize = 150;
/// Smallest spread (standard deviation) of a floor's pixels along its narrower direction, metres.
const MIN_SPREAD: f64 = 0.12;
/// A disk rises at most this far over the floor, metres.
const HIGHEST_DISK: f64 = 0.6;

/// The disk is looked for within this distance of where the subject stands, metres.
const DISK_REACH: f64 = 0.7;
/// A level has more than this many pixels.
const MIN_LEVEL_PIXELS: usize = 40;

/// Standard deviations of a single frame's height by which a pixel must rise over the level not to be one of its own: one of
/// its own in 30 000 does.
const NOISE_MARGIN: f64 = 4.0;
/// The share of a level's pixels whose noise the margin covers: dark patches are noisier than the rest.
const NOISE_SHARE: f64 = 0.9;
/// The margin lies within these, metres: the pile of a carpet, and less than the height of a sole that is closed flat.
const MIN_MARGIN: f64 = 0.005;
const MAX_MARGIN: f64 = 0.02;

/// The plane the subject stands on, camera frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Floor {
    /// Unit normal, upward.
    pub normal: Vector3<f64>,
    /// A point of it.
    pub point: Point3<f64>,
    /// Height above the plane below which points are taken for the plane itself, metres.
    pub margin: f64,
    /// How far a lens that the calibration does not have would bend the floor as it is seen, root mean square, metres.
    pub bend: f64,
}

struct LevelPixel {
    point: Point3<f64>,
    normal: Vector3<f64>,
    /// Standard deviation of a single frame's depth, metres.
    noise: f64,
}

impl LevelPixel {
    /// Standard deviation of a single frame's height over a plane through the pixel: noise lies along the ray.
    fn height_noise(&self, normal: &Vector3<f64>) -> f64 {
        self.noise * self.point.coords.dot(normal).abs() / self.point.z.max(1e-6)
    }
}

/// Looks for the plane under the moving `subject` (camera frame) in the background depth, where `up` (camera frame) is
/// roughly upward; `None` where there is no level patch below it.
pub(crate) fn find_floor(
    camera: &PinholeCamera,
    resting: &Resting,
    subject: &[Point3<f32>],
    up: &Vector3<f64>,
) -> Option<Floor> {
    let pixels = upward_pixels(camera, resting, &up.cast());
    if pixels.len() < MIN_PIXELS {
        return None;
    }
    let (normal, point, share) = best_plane(&pixels)?;
    let height = |p: &Point3<f64>| (p - point).dot(&normal);
    let below = subject.iter().filter(|p| height(&p.cast()) < -0.05).count();
    if share < MIN_SHARE || below * 10 > subject.len() || spread(&pixels, &normal, &point) < MIN_SPREAD {
        return None;
    }
    let bend = bend_of(&members(&pixels, &normal, &point, 1).iter().map(|u| u.point).collect::<Vec<_>>());
    Some(Floor { bend, ..disk_on(&pixels, subject, normal, point) })
}

fn upward_pixels(camera: &PinholeCamera, resting: &Resting, up: &Vector3<f32>) -> Vec<LevelPixel> {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let elements = surface_elements(camera, &resting.depth, 3);
    let mut pixels = Vec::new();
    for y in (0..h).step_by(2) {
        for x in (0..w).step_by(2) {
            let element = elements[y * w + x];
            let [rx, ry, _] = unproject(camera, x as f32, y as f32, 1.0);
            let normal = Vector3::from(element.normal(rx, ry));
            if element.is_some() && normal.dot(up) > UPWARD {
                let point = Point3::new(rx, ry, 1.0) * element.depth();
                let noise = f64::from(resting.noise[y * w + x]);
                pixels.push(LevelPixel { point: point.cast(), normal: normal.cast(), noise });
            }
        }
    }
    pixels
}

/// The plane with the largest number of members among those through single pixels, refined by least squares, and its
/// members' share.
fn best_plane(pixels: &[LevelPixel]) -> Option<(Vector3<f64>, Point3<f64>, f64)> {
    let step = (pixels.len() / 97).max(1);
    let candidates = pixels.iter().step_by(step);
    let best = candidates.max_by_key(|c| members(pixels, &smoothed_normal(pixels, c), &c.point, 3).len())?;
    let (mut normal, mut point) = (smoothed_normal(pixels, best), best.point);
    for _ in 0..5 {
        let group = members(pixels, &normal, &point, 1);
        (normal, point) = fit_plane(&group.iter().map(|u| u.point).collect::<Vec<_>>(), &normal)?;
    }
    let share = members(pixels, &normal, &point, 1).len() as f64 / pixels.len() as f64;
    Some((normal, point, share))
}

/// A pixel's normal averaged with the aligned ones of nearby pixels.
fn smoothed_normal(pixels: &[LevelPixel], center: &LevelPixel) -> Vector3<f64> {
    let near =
        pixels.iter().filter(|u| (u.point - center.point).norm() < 0.15 && u.normal.dot(&center.normal) > ALIGNED);
    near.map(|u| u.normal).sum::<Vector3<f64>>().try_normalize(1e-9).unwrap_or(center.normal)
}

fn members<'a>(
    pixels: &'a [LevelPixel],
    normal: &Vector3<f64>,
    point: &Point3<f64>,
    step: usize,
) -> Vec<&'a LevelPixel> {
    let belongs = |u: &&LevelPixel| (u.point - point).dot(normal).abs() < BAND && u.normal.dot(normal) > ALIGNED;
    pixels.iter().step_by(step).filter(belongs).collect()
}

/// Standard deviation of a plane's members along its narrower direction.
fn spread(pixels: &[LevelPixel], normal: &Vector3<f64>, point: &Point3<f64>) -> f64 {
    let group = members(pixels, normal, point, 1);
    let mean = group.iter().map(|u| u.point.coords).sum::<Vector3<f64>>() / group.len().max(1) as f64;
    let scatter: Matrix3<f64> =
        group.iter().map(|u| (u.point.coords - mean) * (u.point.coords - mean).transpose()).sum();
    let mut values: Vec<f64> = SymmetricEigen::new(scatter).eigenvalues.iter().copied().collect();
    values.sort_unstable_by(f64::total_cmp);
    (values[1].max(0.0) / group.len().max(1) as f64).sqrt()
}

/// Least-squares plane with its normal on the side of `up`; `None` where there are fewer than ten points.
fn fit_plane(points: &[Point3<f64>], up: &Vector3<f64>) -> Option<(Vector3<f64>, Point3<f64>)> {
    if points.len() < 10 {
        return None;
    }
    let mean = points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len() as f64;
    let scatter: Matrix3<f64> = points.iter().map(|p| (p.coords - mean) * (p.coords - mean).transpose()).sum();
    let eigen = SymmetricEigen::new(scatter);
    let k = eigen.eigenvalues.imin();
    let n: Vector3<f64> = eigen.eigenvectors.column(k).into();
    Some((if n.dot(up) < 0.0 { -n } else { n }, Point3::from(mean)))
}

/// The highest well-filled level parallel to the floor within the subject's reach: the disk, or the floor itself.
fn disk_on(pixels: &[LevelPixel], subject: &[Point3<f32>], normal: Vector3<f64>, point: Point3<f64>) -> Floor {
    let center = footing(subject, &normal, &point);
    let across = |v: Vector3<f64>| (v - normal * v.dot(&normal)).norm();
    let near: Vec<&LevelPixel> =
        pixels.iter().filter(|u| u.normal.dot(&normal) > ALIGNED && across(u.point - center) < DISK_REACH).collect();
    let heights: Vec<f64> = near.iter().map(|u| (u.point - point).dot(&normal)).collect();
    let (mut n, mut on) = (normal, point + normal * highest_level(&heights));
    let mut level: Vec<&LevelPixel> = Vec::new();
    for band in [BAND, 0.5 * BAND, 0.5 * BAND] {
        level = near.iter().copied().filter(|u| (u.point - on).dot(&n).abs() < band).collect();
        let points: Vec<Point3<f64>> = level.iter().map(|u| u.point).collect();
        (n, on) = fit_plane(&points, &n).unwrap_or((n, on));
    }
    Floor { normal: n, point: on, margin: margin(&level, &n, &on), bend: 0.0 }
}

/// Height over a level above which a single frame's pixels are not the level's own: unevenness and noise together.
fn margin(level: &[&LevelPixel], normal: &Vector3<f64>, point: &Point3<f64>) -> f64 {
    let offsets = level.iter().map(|u| (u.point - point).dot(normal).abs()).collect();
    let uneven = 1.4826 * quantile(offsets, 0.5).unwrap_or(0.003);
    let noise = level.iter().map(|u| u.height_noise(normal)).collect();
    let noisy = quantile(noise, NOISE_SHARE).unwrap_or(0.0);
    (NOISE_MARGIN * uneven.hypot(noisy)).clamp(MIN_MARGIN, MAX_MARGIN)
}

/// The value below which a share of the values lies; `None` where there are no values.
fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get((values.len() as f64 * share) as usize).copied()
}

/// Where the subject stands: the mean of its low points, or of all where none is low.
fn footing(subject: &[Point3<f32>], normal: &Vector3<f64>, point: &Point3<f64>) -> Point3<f64> {
    let all: Vec<Point3<f64>> = subject.iter().map(|p| p.cast()).collect();
    let low: Vec<Point3<f64>> = all.iter().copied().filter(|p| (p - point).dot(normal) < 0.4).collect();
    let chosen = if low.len() > 50 { &low } else { &all };
    Point3::from(chosen.iter().map(|p| p.coords).sum::<Vector3<f64>>() / chosen.len().max(1) as f64)
}

/// The highest height at which a level holds a fair share of the given ones.
fn highest_level(heights: &[f64]) -> f64 {
    let bin = 0.004;
    let mut histogram = vec![0usize; ((HIGHEST_DISK + BAND) / bin) as usize];
    for h in heights.iter().map(|h| (h + BAND) / bin).filter(|h| *h >= 0.0) {
        if let Some(count) = histogram.get_mut(h as usize) {
            *count += 1;
        }
    }
    let total: usize = histogram.iter().sum();
    let filled = |w: &[usize]| w.iter().sum::<usize>() > MIN_LEVEL_PIXELS.max(total / 12);
    let level = histogram.windows(3).rposition(filled);
    level.map_or(0.0, |k| (k as f64 + 1.5) * bin - BAND)
}
