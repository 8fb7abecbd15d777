//! How far the hips go up or down, so that both legs reach where their feet stand.

use nalgebra::{Point3, Vector3};
use toile_character::{
    Joint, Pose,
    soles::{Sole, Soles},
};

use super::{
    smooth::{averaged, envelope},
    stances::Stances,
};

/// Seconds to either side over which the hips follow the feet.
const FOLLOWS: f64 = 0.15;
/// Seconds to either side in which they go down for a leg that is too short.
const REACHES: f64 = 0.12;
/// A leg is made no straighter than the first share of its length for a foot, unless the file has it straighter, up to the second:
/// the last hundredth of a leg's reach turns the knee by 16°, and the knee would pop.
const STRAIGHT: (f64, f64) = (0.99, 0.9995);

/// Displacement of the hips in every pose, metres up.
pub(super) fn shift(
    soles: &Soles,
    poses: &[Pose],
    stances: &[Stances; 2],
    offsets: &[Vec<Vector3<f64>>; 2],
    frame_time: f64,
) -> Vec<f64> {
    let poses_in = |seconds: f64| (seconds / frame_time).round().max(1.0) as usize;
    let masks = stances.each_ref().map(|s| s.mask(poses.len()));
    let followed = follow(&masks, offsets);
    let follows = poses_in(FOLLOWS);
    let followed = averaged(&averaged(&followed, follows), follows);
    let short = |pose: usize| {
        let at = poses[pose].joint_positions(soles.skeleton());
        let of = |foot: usize| {
            let short = || missing(soles, &soles.feet()[foot], &at, &offsets[foot][pose], followed[pose]);
            if masks[foot][pose] { short() } else { 0.0 }
        };
        of(0).max(of(1))
    };
    let short: Vec<f64> = (0..poses.len()).map(short).collect();
    followed.iter().zip(envelope(&short, poses_in(REACHES))).map(|(up, down)| up - down).collect()
}

/// The mean height that standing feet are moved by, between stances on a line.
fn follow(masks: &[Vec<bool>; 2], offsets: &[Vec<Vector3<f64>>; 2]) -> Vec<f64> {
    let count = masks[0].len();
    let mean = |pose: usize| {
        let standing: Vec<f64> = (0..2).filter(|&f| masks[f][pose]).map(|f| offsets[f][pose].y).collect();
        (!standing.is_empty()).then(|| standing.iter().sum::<f64>() / standing.len() as f64)
    };
    let known: Vec<(usize, f64)> = (0..count).filter_map(|pose| Some((pose, mean(pose)?))).collect();
    let Some((&first, &last)) = known.first().zip(known.last()) else { return vec![0.0; count] };
    let mut out = vec![first.1; count];
    out[last.0..].fill(last.1);
    for pair in known.windows(2) {
        let ((from, low), (to, high)) = (pair[0], pair[1]);
        for (k, value) in out[from..to].iter_mut().enumerate() {
            *value = low + (high - low) * k as f64 / (to - from) as f64;
        }
    }
    out
}

/// How far from the hip an ankle may be set, metres, on a leg of this length that the file has `distance` long.
pub(super) fn reach(length: f64, distance: f64) -> f64 {
    distance.clamp(STRAIGHT.0 * length, STRAIGHT.1 * length)
}

/// How far the hips must go down so that the leg of `sole` reaches its foot, when they are `up` already.
fn missing(soles: &Soles, sole: &Sole, at: &[Point3<f64>], offset: &Vector3<f64>, up: f64) -> f64 {
    let of = |joint: Joint| at[joint.index()];
    let (hip, ankle) = (of(sole.leg.upper), of(sole.leg.foot));
    let length = sole.leg.length(soles.skeleton());
    let limit = reach(length, (ankle - hip).norm());
    let way = ankle + offset - (hip + Vector3::y() * up);
    let level = way.x.hypot(way.z);
    if way.norm() <= limit || level >= limit {
        return 0.0;
    }
    (-way.y - (limit * limit - level * level).sqrt()).max(0.0)
}
