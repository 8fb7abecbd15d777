//! The level plane that the subject stands on: the disk, else the floor.

use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};
use toile_geometry::camera::PinholeCamera;

use crate::{
    normals::normals_from_depth,
    view::{is_measured, unproject},
};

/// Largest angle between the floor's normal and the image's upward direction, as a cosine (40°).
const UPWARD: f32 = 0.77;
/// Largest angle between a pixel's normal and its plane's, as a cosine (25°).
const ALIGNED: f64 = 0.906;
/// Distance from a plane within which a pixel belongs to it, metres.
const BAND: f64 = 0.012;
/// Least share of the upward background pixels that make a floor.
const LEAST_SHARE: f64 = 0.15;
/// Least upward background pixels (every second row and column) to look for a floor at all.
const LEAST_PIXELS: usize = 150;
/// A disk rises at most this far over the floor, metres.
const HIGHEST_DISK: f64 = 0.6;

/// The plane the subject stands on, camera frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Floor {
    /// Unit normal, upward.
    pub normal: Vector3<f64>,
    /// A point of it.
    pub point: Point3<f64>,
    /// Height above the plane below which points are taken for the plane itself, metres.
    pub margin: f64,
    /// How far the disk rises over the floor around it, metres; 0 where the subject stands on the floor itself.
    pub disk_height: f64,
}

struct Upward {
    point: Point3<f64>,
    normal: Vector3<f64>,
}

/// Looks for the plane under the moving `subject` (camera frame) in the background depth; `None` where there is no
/// level patch below it.
pub fn find_floor(camera: &PinholeCamera, background: &[f32], subject: &[Point3<f32>]) -> Option<Floor> {
    let pixels = upward_pixels(camera, background);
    if pixels.len() < LEAST_PIXELS {
        return None;
    }
    let (normal, point, share) = best_plane(&pixels)?;
    let height = |p: &Point3<f64>| (p - point).dot(&normal);
    let below = subject.iter().filter(|p| height(&p.cast()) < -0.05).count();
    if share < LEAST_SHARE || below * 10 > subject.len() {
        return None;
    }
    Some(disk_on(&pixels, subject, normal, point))
}

fn upward_pixels(camera: &PinholeCamera, background: &[f32]) -> Vec<Upward> {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let normals = normals_from_depth(camera, background);
    let mut pixels = Vec::new();
    for y in (0..h).step_by(2) {
        for x in (0..w).step_by(2) {
            let i = y * w + x;
            if is_measured(background[i]) && -normals[i][1] > UPWARD {
                let p = unproject(camera, x as f32, y as f32, background[i]);
                pixels.push(Upward { point: Point3::from(p).cast(), normal: Vector3::from(normals[i]).cast() });
            }
        }
    }
    pixels
}

/// The plane with most members among those through single pixels, refined by least squares, and its members' share.
fn best_plane(pixels: &[Upward]) -> Option<(Vector3<f64>, Point3<f64>, f64)> {
    let step = (pixels.len() / 97).max(1);
    let candidates = pixels.iter().step_by(step);
    let best = candidates.max_by_key(|c| members(pixels, &smoothed_normal(pixels, c), &c.point, 3).len())?;
    let (mut normal, mut point) = (smoothed_normal(pixels, best), best.point);
    for _ in 0..5 {
        let group = members(pixels, &normal, &point, 1);
        (normal, point) = fit_plane(&group.iter().map(|u| u.point).collect::<Vec<_>>())?;
    }
    let share = members(pixels, &normal, &point, 1).len() as f64 / pixels.len() as f64;
    Some((normal, point, share))
}

/// A pixel's normal averaged with the aligned ones of nearby pixels.
fn smoothed_normal(pixels: &[Upward], center: &Upward) -> Vector3<f64> {
    let near =
        pixels.iter().filter(|u| (u.point - center.point).norm() < 0.15 && u.normal.dot(&center.normal) > ALIGNED);
    near.map(|u| u.normal).sum::<Vector3<f64>>().try_normalize(1e-9).unwrap_or(center.normal)
}

fn members<'a>(pixels: &'a [Upward], normal: &Vector3<f64>, point: &Point3<f64>, step: usize) -> Vec<&'a Upward> {
    let belongs = |u: &&Upward| (u.point - point).dot(normal).abs() < BAND && u.normal.dot(normal) > ALIGNED;
    pixels.iter().step_by(step).filter(belongs).collect()
}

/// Least-squares plane, normal towards −Y of the camera (up); `None` of fewer than ten points.
fn fit_plane(points: &[Point3<f64>]) -> Option<(Vector3<f64>, Point3<f64>)> {
    if points.len() < 10 {
        return None;
    }
    let mean = points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len() as f64;
    let scatter: Matrix3<f64> = points.iter().map(|p| (p.coords - mean) * (p.coords - mean).transpose()).sum();
    let eigen = SymmetricEigen::new(scatter);
    let k = eigen.eigenvalues.imin();
    let n: Vector3<f64> = eigen.eigenvectors.column(k).into();
    Some((if n.y > 0.0 { -n } else { n }, Point3::from(mean)))
}

/// The highest well-filled level parallel to the floor within the subject's reach: the disk, or the floor itself.
fn disk_on(pixels: &[Upward], subject: &[Point3<f32>], normal: Vector3<f64>, point: Point3<f64>) -> Floor {
    let bin = 0.01;
    let bins = (HIGHEST_DISK / bin) as usize;
    let center = subject.iter().map(|p| p.coords.cast::<f64>()).sum::<Vector3<f64>>() / subject.len().max(1) as f64;
    let across = |v: Vector3<f64>| (v - normal * v.dot(&normal)).norm();
    let mut histogram = vec![0usize; bins];
    let mut total = 0;
    for u in pixels.iter().filter(|u| u.normal.dot(&normal) > ALIGNED && across(u.point.coords - center) < 0.9) {
        let h = (u.point - point).dot(&normal) + 2.0 * BAND;
        if h >= 0.0 && ((h / bin) as usize) < bins {
            histogram[(h / bin) as usize] += 1;
            total += 1;
        }
    }
    let level = (0..bins.saturating_sub(1))
        .filter(|&k| (histogram[k] + histogram[k + 1]) * 6 > total && total > 30)
        .max()
        .map_or(0.0, |k| (k as f64 + 1.0) * bin - 2.0 * BAND);
    let start = if level > 2.0 * BAND { point + normal * level } else { point };
    let near: Vec<Point3<f64>> = pixels
        .iter()
        .filter(|u| (u.point - start).dot(&normal).abs() < BAND && u.normal.dot(&normal) > ALIGNED)
        .filter(|u| level <= 2.0 * BAND || across(u.point.coords - center) < 0.9)
        .map(|u| u.point)
        .collect();
    let (n, on) = fit_plane(&near).unwrap_or((normal, start));
    let mut offsets: Vec<f64> = near.iter().map(|p| (p - on).dot(&n).abs()).collect();
    offsets.sort_unstable_by(f64::total_cmp);
    let sigma = 1.4826 * offsets.get(offsets.len() / 2).copied().unwrap_or(0.003);
    Floor {
        normal: n,
        point: on,
        margin: (5.0 * sigma).clamp(0.005, 0.02),
        disk_height: if level > 2.0 * BAND { (on - point).dot(&normal) } else { 0.0 },
    }
}
