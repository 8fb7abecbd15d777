//! Where a subject is that stands still before several resting cameras. Nothing moves, so that what stands where all
//! cameras look, over the floor, is the subject.

use nalgebra::{Matrix3, Point3, Vector3};
use toile_geometry::{Rigid, camera::PinholeCamera};

use super::{
    background::Resting,
    cut::SubjectVolume,
    floor::Floor,
    upright::{ImageSide, find_up},
    volume::{MARGIN, SAMPLE, floor_height, largest_cluster, level, percentile, sorted},
};
use crate::{
    FusionError,
    frame::{is_measured, unproject},
};

/// What stands within this distance of the line through where the cameras look may be a person, metres: an arm's reach.
const REACH: f64 = 1.1;
/// And within this share of the distance of the nearest camera.
const REACH_SHARE: f64 = 0.75;
/// What the floor is looked for under, metres from that line.
const TRUNK: f64 = 0.5;
/// Cameras that look past the point they share by more than this do not look at one person, metres.
const PAST: f64 = 0.5;
/// A camera stands at least this far from the subject, metres.
const NEAREST: f64 = 0.4;
/// Lower than this over the floor the subject is not told from the floor while cameras are placed to a few centimetres,
/// metres.
const LOW: f64 = 0.15;
/// A camera tells where the subject is where it sees at least this many points of it, on every second row and column.
const FEWEST_POINTS: usize = 400;

/// A resting camera, and the depth that its frames agree on.
pub(crate) struct Eye {
    pub camera: PinholeCamera,
    pub seen: Resting,
    pub rig_from_camera: Rigid,
}

/// Finds the volume of the subject that all cameras look at; `model_from_camera` is that of the first one.
///
/// # Errors
/// [`FusionError::NobodyInIt`] where the cameras look past each other, or nobody stands where they look.
pub(crate) fn find_standing(eyes: &[Eye]) -> Result<SubjectVolume, FusionError> {
    let nobody = |reason: &str| FusionError::NobodyInIt { reason: reason.into() };
    let center = meeting_point(eyes).ok_or_else(|| nobody("the sensors of the rig do not look at one place"))?;
    let grounded = eyes.iter().find_map(|eye| Some((eye, ground_under(eye, &center)?)));
    let first_from_rig = eyes[0].rig_from_camera.inverse();
    let (up, floor) = match &grounded {
        Some((eye, (_, floor))) => {
            let floor = moved(floor, &(first_from_rig * eye.rig_from_camera));
            (floor.normal, Some(floor))
        }
        None => (ImageSide::Top.direction(), None),
    };
    let level_from_rig = level(up) * first_from_rig;
    let axis = level_from_rig * center;
    let ground = floor.as_ref().map(|f| floor_height(&level(up), f, axis.x, axis.z));
    let subject = subject_points(eyes, &level_from_rig, &axis, ground);
    if subject.len() < FEWEST_POINTS {
        return Err(nobody("nothing moves, and nobody stands where the sensors of the rig look"));
    }
    let middle = |values: &[f64]| 0.5 * (percentile(values, 0.01) + percentile(values, 0.99));
    let (x, z) = (middle(&sorted(subject.iter().map(|p| p.x))), middle(&sorted(subject.iter().map(|p| p.z))));
    let radii = sorted(subject.iter().map(|p| (p.x - x).hypot(p.z - z)));
    let lowest = percentile(&sorted(subject.iter().map(|p| p.y)), 0.001);
    let ground = floor.as_ref().map_or(lowest, |f| floor_height(&level(up), f, x, z));
    let image_up = grounded.filter(|(eye, _)| std::ptr::eq(*eye, &eyes[0])).map(|(_, (side, _))| side);
    Ok(SubjectVolume {
        model_from_camera: Rigid::translation(-x, -ground, -z) * level(up),
        radius: 1.02 * percentile(&radii, 0.999) + MARGIN,
        bottom: floor.as_ref().map(|f| f.margin),
        floor,
        image_up: image_up.unwrap_or_default(),
    })
}

/// The point nearest to where all cameras look, rig frame; of cameras that face each other the one midway. `None` where
/// they look past it.
fn meeting_point(eyes: &[Eye]) -> Option<Point3<f64>> {
    const MIDWAY: f64 = 1e-3;
    let mean = eyes.iter().map(|e| e.rig_from_camera.translation.vector).sum::<Vector3<f64>>() / eyes.len() as f64;
    let (mut a, mut b) = (Matrix3::identity() * MIDWAY, mean * MIDWAY);
    for eye in eyes {
        let ahead = eye.rig_from_camera.rotation * Vector3::z();
        let across = Matrix3::identity() - ahead * ahead.transpose();
        a += across;
        b += across * eye.rig_from_camera.translation.vector;
    }
    let center = Point3::from(a.cholesky()?.solve(&b));
    let looks_at = |eye: &Eye| {
        let p = eye.rig_from_camera.inverse() * center;
        p.z > NEAREST && p.x.hypot(p.y) < PAST
    };
    eyes.iter().all(looks_at).then_some(center)
}

/// The floor under what a camera sees around the point that all look at, and the side of its image that is up.
fn ground_under(eye: &Eye, center: &Point3<f64>) -> Option<(ImageSide, Floor)> {
    let center = eye.rig_from_camera.inverse() * center;
    [Vector3::y(), Vector3::x()].into_iter().find_map(|along: Vector3<f64>| {
        let near = |p: &Point3<f32>| {
            let off = p.cast::<f64>() - center;
            (off - along * off.dot(&along)).norm() < TRUNK
        };
        let trunk: Vec<Point3<f32>> = points(eye).filter(near).collect();
        let (side, floor) = find_up(&eye.camera, &eye.seen, &trunk);
        floor.map(|floor| (side, floor))
    })
}

/// What a camera sees on every second row and column, camera frame.
fn points(eye: &Eye) -> impl Iterator<Item = Point3<f32>> + '_ {
    let (w, h) = (eye.camera.width as usize, eye.camera.height as usize);
    let pixels = (0..h).step_by(SAMPLE).flat_map(move |y| (0..w).step_by(SAMPLE).map(move |x| (x, y)));
    pixels.filter_map(move |(x, y)| {
        let d = eye.seen.depth[y * w + x];
        is_measured(d).then(|| unproject(&eye.camera, x as f32, y as f32, d).into())
    })
}

/// The largest thing that stands around the axis, as all cameras see it, level frame.
fn subject_points(eyes: &[Eye], level_from_rig: &Rigid, axis: &Point3<f64>, ground: Option<f64>) -> Vec<Point3<f64>> {
    let distance = |eye: &Eye| {
        let at = level_from_rig * Point3::from(eye.rig_from_camera.translation.vector);
        (at.x - axis.x).hypot(at.z - axis.z)
    };
    let reach = (REACH_SHARE * eyes.iter().map(distance).fold(f64::INFINITY, f64::min)).min(REACH);
    let lowest = ground.map_or(f64::NEG_INFINITY, |g| g + LOW);
    let around = |p: &Point3<f64>| (p.x - axis.x).hypot(p.z - axis.z) < reach && p.y > lowest;
    let of = |eye: &Eye| {
        let level_from_camera = level_from_rig * eye.rig_from_camera;
        points(eye).map(|p| level_from_camera * p.cast::<f64>()).filter(around).collect::<Vec<_>>()
    };
    let all: Vec<Point3<f32>> = eyes.iter().flat_map(of).map(Point3::cast).collect();
    largest_cluster(&all).into_iter().map(Point3::cast).collect()
}

fn moved(floor: &Floor, motion: &Rigid) -> Floor {
    Floor { normal: motion * floor.normal, point: motion * floor.point, ..floor.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn eye(around: f64, past: f64) -> Eye {
        let turn = nalgebra::UnitQuaternion::from_scaled_axis(Vector3::y() * around);
        let looks_back = nalgebra::UnitQuaternion::from_scaled_axis(Vector3::x() * std::f64::consts::PI);
        let place = turn * Vector3::new(past, 1.0, 2.0);
        Eye {
            camera: PinholeCamera::ideal(4, 4, 4.0, 4.0, 1.5, 1.5),
            seen: Resting::default(),
            rig_from_camera: Rigid::from_parts(place.into(), turn * looks_back),
        }
    }

    #[test]
    fn cameras_meet_where_they_look_and_not_where_they_look_past() {
        let around = |n: usize| (0..n).map(|k| eye(k as f64 * std::f64::consts::TAU / n as f64, 0.02)).collect();
        for eyes in [around(4), around(3), around(2)] as [Vec<Eye>; 3] {
            let center = meeting_point(&eyes).expect("they look at one place");
            assert!((center - Point3::new(0.0, 1.0, 0.0)).norm() < 0.03, "{center}");
        }
        let mut aside: Vec<Eye> = around(4);
        aside[1] = eye(1.6, 2.5);
        assert!(meeting_point(&aside).is_none());
    }
}
