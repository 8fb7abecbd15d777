//! Tracking by colour where the shape does not tell: a column or a ball may turn without its surface moving.
//!
//! The frame's grey values are compared with those of a few earlier frames at the pixels that its points fall on
//! there, coarse to fine, together with the distances to the model. Each term is weighed by its own robust spread, so
//! that colour decides only what distances leave open (after Kerl, Sturm and Cremers 2013, "Dense visual SLAM for RGB-D
//! cameras", with earlier frames in place of one key frame).

use nalgebra::{Matrix3, Point3, Vector3};
use toile_capture::{RgbImage, Sensor};
use toile_geometry::{
    Rigid,
    camera::PinholeCamera,
    statistics::{median, sigma_about_zero},
};

use crate::{
    normals::dot,
    track::{
        Normal, Sample, Tracked, accumulate, assess, centroid, conditioning, drop_open_directions, robust_spread,
        signed_distance, step,
    },
    tsdf::Tsdf,
};

/// Grey images, each half of the one before, finest first.
const LEVELS: usize = 3;
/// Steps on each level.
const STEPS: usize = 8;
/// A step below this (metres at the subject's radius) has converged.
const CONVERGED: f64 = 2e-5;
/// Least robust spread of grey values, and of distances (metres): below, quantisation speaks.
const LEAST_SPREAD: (f64, f64) = (2.0, 5e-4);
/// Least cosine between a point's normal and the ray on which an earlier frame sees it.
const FACING: f32 = 0.4;
/// Fewer points than this say nothing.
const LEAST_POINTS: usize = 100;

/// A colour image as grey values, with its camera.
pub(crate) struct Picture {
    camera: PinholeCamera,
    color_from_depth: Rigid,
    levels: Vec<Grey>,
}

/// Grey values of one size.
struct Grey {
    width: usize,
    height: usize,
    /// Columns and rows of this size over those of the camera.
    scale: [f32; 2],
    values: Vec<f32>,
}

/// A frame whose pose is known.
pub(crate) struct Seen<'a> {
    pub picture: &'a Picture,
    pub scan_from_camera: Rigid,
}

/// How well colours agree at a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Held {
    pub tracked: Tracked,
    /// Robust spread of the differences of grey values.
    pub spread: f64,
}

impl Picture {
    /// Of the same size as the depth image or a little larger, and smaller ones.
    pub(crate) fn new(image: &RgbImage, sensor: &Sensor) -> Self {
        let camera = sensor.color.unwrap_or(sensor.depth);
        let mut grey = Grey::new(image, &camera);
        while grey.width >= 2 * sensor.depth.width as usize {
            grey = grey.halved();
        }
        let mut levels = vec![grey];
        while levels.len() < LEVELS {
            levels.push(levels[levels.len() - 1].halved());
        }
        Self { camera, color_from_depth: sensor.color_from_depth, levels }
    }

    /// Grey value and its gradient along the point (depth camera's frame) on a level.
    fn look_up(&self, level: usize, p: &Point3<f32>) -> Option<(f32, Vector3<f32>)> {
        let q = self.color_from_depth * p.cast::<f64>();
        let grey = &self.levels[level];
        let pixel = self.camera.project(&q)?;
        let [u, v] = [(pixel.x as f32 + 0.5) * grey.scale[0] - 0.5, (pixel.y as f32 + 0.5) * grey.scale[1] - 0.5];
        let (value, [du, dv]) = grey.at(u, v)?;
        let (x, y, z) = (q.x as f32, q.y as f32, q.z as f32);
        let (du, dv) = (du * grey.scale[0] * self.camera.fx as f32 / z, dv * grey.scale[1] * self.camera.fy as f32 / z);
        let along = Vector3::new(du, dv, -(du * x + dv * y) / z);
        Some((value, self.color_from_depth.rotation.inverse().cast::<f32>() * along))
    }
}

impl Grey {
    fn new(image: &RgbImage, camera: &PinholeCamera) -> Self {
        let values = image.pixels.iter().map(|p| p.iter().map(|c| f32::from(*c)).sum::<f32>() / 3.0).collect();
        let (width, height) = (image.width as usize, image.height as usize);
        let scale = [width as f32 / camera.width as f32, height as f32 / camera.height as f32];
        Self { width, height, scale, values }
    }

    fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let mean = |i: usize| {
            let at = i / width.max(1) * 2 * self.width + i % width.max(1) * 2;
            [at, at + 1, at + self.width, at + self.width + 1].iter().map(|&k| self.values[k]).sum::<f32>() / 4.0
        };
        Self { width, height, scale: self.scale.map(|s| s / 2.0), values: (0..width * height).map(mean).collect() }
    }

    /// Bilinear value and central differences; `None` near the border.
    fn at(&self, u: f32, v: f32) -> Option<(f32, [f32; 2])> {
        let inside = u >= 1.0 && v >= 1.0 && u + 2.0 < self.width as f32 && v + 2.0 < self.height as f32;
        let value = |u: f32, v: f32| {
            let (x, y) = (u as usize, v as usize);
            let (a, b) = (u - x as f32, v - y as f32);
            let row = |y: usize| self.values[y * self.width + x] * (1.0 - a) + self.values[y * self.width + x + 1] * a;
            row(y) * (1.0 - b) + row(y + 1) * b
        };
        let slope = |du: f32, dv: f32| (value(u + du, v + dv) - value(u - du, v - dv)) / 2.0;
        inside.then(|| (value(u, v), [slope(0.5, 0.0) * 2.0, slope(0.0, 0.5) * 2.0]))
    }
}

/// Registers samples to the model and the colours of `picture` to those of earlier frames, from a start. `None` where
/// too few points are seen by both.
pub(crate) fn hold(tsdf: &Tsdf, points: &[Sample], picture: &Picture, earlier: &[Seen], start: &Rigid) -> Option<Held> {
    let mut pose = *start;
    let mut held = None;
    for level in (0..LEVELS).rev() {
        for _ in 0..STEPS {
            let center = centroid(points, &pose);
            let (system, spread) = joint_system(tsdf, points, (picture, earlier, level), &pose, &center)?;
            let (motion, size) = step(&system, &center, 1e-6);
            pose = motion * pose;
            held = Some((conditioning(&system), spread, size < CONVERGED));
            if size < CONVERGED {
                break;
            }
        }
    }
    let (conditioning, spread, converged) = held?;
    let at = Tracked { conditioning, converged, by_color: true, ..Tracked::at(&pose) };
    Some(Held { tracked: assess(tsdf, points, at), spread })
}

/// Normal equations of distances and grey values, each over the square of its spread; the spread of the latter.
fn joint_system(
    tsdf: &Tsdf,
    points: &[Sample],
    (picture, earlier, level): (&Picture, &[Seen], usize),
    pose: &Rigid,
    center: &Point3<f64>,
) -> Option<(Normal, f64)> {
    let distance = robust_spread(tsdf, points, pose)?.max(LEAST_SPREAD.1);
    let cut = (4.7 * distance).min(0.9 * f64::from(tsdf.truncation()));
    let geometry = accumulate(points, pose, center, |q, n, _| {
        let (r, normal) = signed_distance(tsdf, q, n)?;
        let k = (1.0 - (r / cut) * (r / cut)).max(0.0);
        Some((r, normal, k * k / (distance * distance)))
    });
    let (mut system, mut widest, mut count) = (geometry, 0.0f64, 0);
    drop_open_directions(&mut system);
    for seen in earlier {
        let against = Against::new(picture, seen, level);
        let mut all: Vec<f64> = points.iter().filter_map(|s| against.difference(s, pose)).map(|d| d.0).collect();
        if all.len() < LEAST_POINTS {
            continue;
        }
        let offset = median(&mut all).unwrap_or(0.0);
        let mut sizes: Vec<f64> = all.iter().map(|d| (d - offset).abs()).collect();
        let spread = sigma_about_zero(&mut sizes).unwrap_or(0.0).max(LEAST_SPREAD.0);
        let cut = 4.7 * spread;
        let share = 1.0 / earlier.len() as f64;
        let colors = accumulate(points, pose, center, |_, _, s| {
            let (d, gradient) = against.difference(s, pose)?;
            let r = d - offset;
            let k = (1.0 - (r / cut) * (r / cut)).max(0.0);
            Some((r, gradient, share * k * k / (spread * spread)))
        });
        system = system.plus(&colors);
        widest = widest.max(spread);
        count += 1;
    }
    (count > 0).then_some((system, widest))
}

/// A frame beside an earlier one, on one level.
struct Against<'a> {
    picture: &'a Picture,
    seen: &'a Seen<'a>,
    level: usize,
    camera_from_scan: Rigid,
    scan_turn: Matrix3<f32>,
}

impl<'a> Against<'a> {
    fn new(picture: &'a Picture, seen: &'a Seen, level: usize) -> Self {
        let scan_turn = seen.scan_from_camera.rotation.to_rotation_matrix().into_inner().cast();
        Self { picture, seen, level, camera_from_scan: seen.scan_from_camera.inverse(), scan_turn }
    }

    /// The earlier frame's grey value less this one's, and its gradient along the point in the scan's frame.
    fn difference(&self, s: &Sample, pose: &Rigid) -> Option<(f64, [f32; 3])> {
        let there_from_here = self.camera_from_scan * pose;
        let p = (there_from_here * s.point.cast::<f64>()).cast::<f32>();
        let normal = there_from_here.rotation.cast::<f32>() * Vector3::from(s.normal);
        if p.z < 0.1 || -dot(normal.into(), p.coords.into()) < FACING * p.coords.norm() {
            return None;
        }
        let (here, _) = self.picture.look_up(self.level, &s.point)?;
        let (there, gradient) = self.seen.picture.look_up(self.level, &p)?;
        Some((f64::from(there - here), (self.scan_turn * gradient).into()))
    }
}
