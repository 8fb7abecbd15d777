//! How well the feet of a motion stand, measured on the body's own surface.
//!
//! Nothing here is shared with what makes feet stand: a foot of the file stands where its joints are slow and low, the
//! person's foot is the skin that foot and toes carry, and what is measured is where that skin is.

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};
use toile_character::{Joint, Pose, Skeleton, SkinnedMesh, limits::joint_limits};
use toile_geometry::statistics::{Rank, quantile_by};

use crate::{
    AnimationError, Bvh, Retargeted,
    skeleton::{Source, recognise},
};

/// A foot of the file stands where one of its joints (ankle, tip) is low and all that are low are slow: below this, metres a second
/// of the person, a fifth of a stroll,
const SLOW: f64 = 0.2;
/// and within the first of these heights over the lowest place where it is slow, metres. A joint within the second must be slow
/// too: feet that turn about heel or ball move.
const LOW: f64 = 0.04;
const RATHER_LOW: f64 = 0.08;
/// A sole this near to the floor stands on it, metres.
const STANDS: f64 = 0.015;
/// Skin of a foot this near to its lowest point touches the floor, metres.
const TOUCHES: f64 = 0.005;
/// Skin on the floor slides from here on, metres a step.
const SLIDES: f64 = 0.005;
/// A joint is beyond its limit from here on, radians.
const BEYOND: f64 = 0.09;

/// Figures of a motion's feet. Lengths in metres.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct FootFigures {
    /// Steps from one pose to the next in which a foot stands in the file and on the person.
    pub standing: usize,
    /// How far the skin that touches the floor moves along it in such a step: mean,
    pub slide_mean: f64,
    /// of 95 in 100 at most,
    pub slide_p95: f64,
    /// and at most.
    pub slide_most: f64,
    /// Such steps in which it moves by more than 5 mm.
    pub sliding: usize,
    /// How deep the body's lowest vertex is below the floor in the worst pose; negative above it.
    pub deepest: f64,
    /// Steps in which a foot stands in the file, and the person's is above the floor by more than 15 mm.
    pub floating: usize,
    /// Poses in which a joint is more than 5° beyond its limit.
    pub beyond_limits: usize,
    /// Acceleration of knees and ankles that 99 of 100 stay below, metres a second squared.
    pub acceleration_p99: f64,
    /// Angle by which the joint that turns most turns in the first step, over the median of all steps.
    pub first_step: f64,
}

/// Measures `moved`, which was carried over from `bvh`, on the body that it was carried onto.
///
/// # Errors
/// [`AnimationError::UnknownSkeleton`] where the joints of `bvh` are not a person's.
pub fn foot_figures(bvh: &Bvh, moved: &Retargeted, body: &SkinnedMesh) -> Result<FootFigures, AnimationError> {
    let source = recognise(bvh)?;
    let poses = &moved.motion.poses;
    let mut figures = FootFigures {
        deepest: f64::NEG_INFINITY,
        beyond_limits: beyond_limits(&body.skeleton, poses),
        acceleration_p99: acceleration(&body.skeleton, poses, moved.motion.frame_time),
        first_step: first_step(poses),
        ..FootFigures::default()
    };
    let skins: Vec<Vec<Point3<f32>>> = poses.iter().map(|pose| body.posed(pose)).collect();
    for skin in &skins {
        let low = skin.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
        figures.deepest = figures.deepest.max(-f64::from(low));
    }
    let mut slides = Vec::new();
    for (foot, toes) in [(Joint::LeftFoot, Joint::LeftToes), (Joint::RightFoot, Joint::RightToes)] {
        let carried = |v: &usize| [foot, toes].iter().any(|j| usize::from(body.weights.joints[*v][0]) == j.index());
        let vertices: Vec<usize> = (0..body.mesh.positions.len()).filter(carried).collect();
        for (step, _) in stands(bvh, &source, moved, foot).into_iter().enumerate().filter(|(_, stands)| *stands) {
            match slide(&vertices, &skins[step], &skins[step + 1]) {
                Some(slid) => slides.push(slid),
                None => figures.floating += 1,
            }
        }
    }
    figures.standing = slides.len();
    figures.sliding = slides.iter().filter(|slide| **slide > SLIDES).count();
    figures.slide_mean = slides.iter().sum::<f64>() / slides.len().max(1) as f64;
    figures.slide_p95 = quantile_by(&mut slides, 0.95, Rank::Count).unwrap_or(0.0);
    figures.slide_most = slides.iter().copied().fold(0.0, f64::max);
    Ok(figures)
}

/// Where the file's foot stands, from each pose of `moved` to the next.
fn stands(bvh: &Bvh, source: &Source, moved: &Retargeted, foot: Joint) -> Vec<bool> {
    let (count, report) = (moved.motion.poses.len(), &moved.report);
    let first = report.frames_dropped;
    let worlds: Vec<_> = (first..bvh.frames.len()).map(|frame| bvh.joint_frames(frame)).collect();
    let up = Vector3::from(report.up);
    let shin = if foot == Joint::LeftFoot { Joint::LeftLowerLeg } else { Joint::RightLowerLeg };
    let at = |index: usize| -> Vec<Point3<f64>> {
        let world = &worlds[index];
        [Some(source.ankle(shin, bvh, world)), source.tip(foot, bvh, world)].into_iter().flatten().collect()
    };
    let between = |pose: usize| -> Vec<Point3<f64>> {
        let frame = pose as f64 * moved.motion.frame_time / bvh.frame_time;
        let low = (frame.floor() as usize).min(worlds.len() - 1);
        let (a, b) = (at(low), at((low + 1).min(worlds.len() - 1)));
        a.iter().zip(&b).map(|(a, b)| (a + (b - a) * (frame - low as f64)) * report.metres_per_unit).collect()
    };
    let places: Vec<Vec<Point3<f64>>> = (0..count).map(between).collect();
    let slow = |step: usize, k: usize| (places[step + 1][k] - places[step][k]).norm() / moved.motion.frame_time < SLOW;
    let joints = places.first().map_or(0, Vec::len);
    let height = |step: usize, k: usize| places[step][k].coords.dot(&up);
    let floor = |k: usize| {
        let mut heights: Vec<f64> =
            (0..count.saturating_sub(1)).filter(|&s| slow(s, k)).map(|step| height(step, k)).collect();
        quantile_by(&mut heights, 0.02, Rank::Count).unwrap_or(f64::NEG_INFINITY)
    };
    let floors: Vec<f64> = (0..joints).map(floor).collect();
    let below = |step: usize, k: usize, most: f64| height(step, k) < floors[k] + most;
    let stands = |step: usize| {
        (0..joints).any(|k| below(step, k, LOW)) && (0..joints).all(|k| slow(step, k) || !below(step, k, RATHER_LOW))
    };
    (0..count.saturating_sub(1)).map(stands).collect()
}

/// How far the skin that touches the floor moves along it; `None` where the foot is above the floor before or after.
fn slide(vertices: &[usize], before: &[Point3<f32>], after: &[Point3<f32>]) -> Option<f64> {
    let lowest = |skin: &[Point3<f32>]| vertices.iter().map(|&v| f64::from(skin[v].y)).fold(f64::INFINITY, f64::min);
    let (low, next) = (lowest(before), lowest(after));
    if low.max(next) > STANDS {
        return None;
    }
    let touches = |v: &usize| f64::from(before[*v].y) < low + TOUCHES && f64::from(after[*v].y) < next + TOUCHES;
    let mut touching: Vec<usize> = vertices.iter().copied().filter(touches).collect();
    if touching.is_empty() {
        touching = vertices.iter().copied().filter(|&v| f64::from(before[v].y) < low + TOUCHES).collect();
    }
    let moved = |v: &usize| f64::from((after[*v].x - before[*v].x).hypot(after[*v].z - before[*v].z));
    Some(touching.iter().map(moved).sum::<f64>() / touching.len().max(1) as f64)
}

fn beyond_limits(skeleton: &Skeleton, poses: &[Pose]) -> usize {
    let limits = joint_limits(skeleton);
    poses.iter().filter(|p| limits.iter().any(|l| l.beyond(&p.rotation(l.joint)).abs() > BEYOND)).count()
}

fn acceleration(skeleton: &Skeleton, poses: &[Pose], step: f64) -> f64 {
    const JOINTS: [Joint; 4] = [Joint::LeftLowerLeg, Joint::RightLowerLeg, Joint::LeftFoot, Joint::RightFoot];
    let placed: Vec<Vec<Point3<f64>>> = poses.iter().map(|pose| pose.joint_positions(skeleton)).collect();
    let of = |three: &[Vec<Point3<f64>>], joint: Joint| {
        let [a, b, c] = [0, 1, 2].map(|k: usize| three[k][joint.index()].coords);
        (a - 2.0 * b + c).norm() / (step * step)
    };
    let mut all: Vec<f64> = placed.windows(3).flat_map(|three| JOINTS.map(|joint| of(three, joint))).collect();
    quantile_by(&mut all, 0.99, Rank::Count).unwrap_or(0.0)
}

fn first_step(poses: &[Pose]) -> f64 {
    let turn = |pair: &[Pose]| {
        pair[0].rotations.iter().zip(&pair[1].rotations).map(|(a, b)| a.angle_to(b)).fold(0.0, f64::max)
    };
    let mut steps: Vec<f64> = poses.windows(2).map(turn).collect();
    let Some(&first) = steps.first() else { return 0.0 };
    first / quantile_by(&mut steps, 0.5, Rank::Count).unwrap_or(0.0).max(1e-3)
}
