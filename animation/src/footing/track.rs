//! The way of one sole through a motion: its height, and how the skin that is lowest moves.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_character::{
    Pose,
    soles::{Sole, Soles},
};

/// Skin within about this height over the lowest touches the floor, metres: the pad of the heel gives by several millimetres under the
/// weight of somebody who stands.
const PAD: f64 = 0.005;
/// Less than this from pose to pose is no motion, metres.
const STILL: f64 = 2e-4;

/// One sole over all poses.
pub(super) struct Track {
    /// Height of the lowest point of the sole in each pose, metres.
    pub heights: Vec<f64>,
    /// How the skin that touches, or would touch, moves from each pose to the next, metres.
    pub steps: Vec<Vector3<f64>>,
}

impl Track {
    /// Follows `sole`, its toes bent up as the floor under its lowest point bends them.
    pub fn of(soles: &Soles, sole: &Sole, poses: &[Pose]) -> Self {
        let placed = |pose: &Pose| {
            let mut bent = pose.clone();
            let height = soles.roll(sole, &mut bent);
            (height, soles.points(sole, &bent))
        };
        let placed: Vec<(f64, Vec<Point3<f64>>)> = poses.par_iter().map(placed).collect();
        let steps = placed.windows(2).map(|pair| patch_step(&pair[0].1, &pair[1].1)).collect();
        Self { heights: placed.into_iter().map(|(height, _)| height).collect(), steps }
    }
}

/// Displacement of the points that are lowest before and after, mostly of those that move least: on a foot that turns about its
/// heel or ball that is what it stands on.
fn patch_step(before: &[Point3<f64>], after: &[Point3<f64>]) -> Vector3<f64> {
    let lowest = |points: &[Point3<f64>]| points.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    let (low, next) = (lowest(before), lowest(after));
    let moves: Vec<(Vector3<f64>, f64)> =
        before.iter().zip(after).map(|(a, b)| (b - a, (-0.5 * ((a.y - low) + (b.y - next)) / PAD).exp())).collect();
    let heaviest = moves.iter().map(|m| m.1).fold(0.0, f64::max);
    let touching = || moves.iter().filter(|m| m.1 > 0.1 * heaviest);
    let stillest = touching().map(|m| m.0.norm()).fold(f64::INFINITY, f64::min) + STILL;
    let (mut sum, mut weights) = (Vector3::zeros(), 0.0);
    for (step, weight) in touching() {
        let weight = weight / heaviest / (stillest * stillest + step.norm_squared());
        sum += step * weight;
        weights += weight;
    }
    if weights > 0.0 { sum / weights } else { Vector3::zeros() }
}
