//! Finds arms again that a coarse fit laid onto the trunk.
//!
//! Closest points draw an arm that starts too far from its own surface to the nearest other one. Where a part of the scan
//! has no part of the body near it, each arm in turn is tried in the directions that it can point in, elbow straight
//! or bent, and takes the direction that agrees best with what the rest of the body leaves unexplained.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use toile_character::Joint;

use super::problem::BodyProblem;
use crate::{
    solve::{Articulated, Posed, State},
    surface::{Cloud, Samples},
};

/// Scan farther than this from the body is unexplained, metres: more than a coarse fit is off, less than an arm's thickness.
const NEAR: f32 = 0.06;
/// Share of the scan's area that may be unexplained before arms are searched for: a fifth of an arm.
const UNEXPLAINED: f32 = 0.012;
/// Scale of the robust cost of an arm, metres.
const KERNEL: f32 = 0.05;
/// Cost elsewhere, as a share of the cost where the arm is, below which the arm is moved.
const BETTER: f32 = 0.85;
/// Largest number of unexplained points that an arm is judged by.
const JUDGED_BY: usize = 200;
/// Directions tried: outward from the body by elevation and swing to the front, degrees.
const ELEVATIONS: [f64; 7] = [-80.0, -55.0, -30.0, -5.0, 20.0, 45.0, 70.0];
const SWINGS: [f64; 4] = [-30.0, 5.0, 40.0, 75.0];
/// Turns of the upper arm about itself and bends of the elbow tried together, degrees.
const ELBOWS: [(f64, f64); 6] = [(0.0, 10.0), (-60.0, 60.0), (0.0, 60.0), (60.0, 60.0), (0.0, 110.0), (60.0, 110.0)];

/// The state with misplaced arms moved; `None` where the body explains the scan or no other direction fits better.
pub(crate) fn found_arms(problem: &BodyProblem, state: &State) -> Option<State> {
    let posed = problem.body.pose(state);
    let everywhere: Vec<usize> = (0..problem.body.len()).collect();
    let left = unexplained(problem.reverse, &posed, &everywhere)?;
    let area = |s: &Samples| s.weights.iter().sum::<f32>();
    if area(&left) < UNEXPLAINED * area(problem.reverse) {
        return None;
    }
    let mut best = state.clone();
    let mut moved = false;
    for arm in ARMS {
        if let Some(better) = arm.placed(problem, &best) {
            (best, moved) = (better, true);
        }
    }
    moved.then_some(best)
}

/// Scan samples with none of the body's vertices `of` near them on the same side; `None` where all are explained.
pub(super) fn unexplained(scan: &Samples, posed: &Posed, of: &[usize]) -> Option<Samples> {
    let points = of.iter().map(|&v| posed.points[v]).collect();
    let normals = of.iter().map(|&v| posed.normals[v]).collect();
    let body = Cloud::new(Samples { points, normals, ..Samples::default() })?;
    let far = |k: &usize| body.nearest(&scan.points[*k], &scan.normals[*k], NEAR, 0.3).is_none();
    let left: Vec<usize> = (0..scan.points.len()).filter(far).collect();
    (!left.is_empty()).then(|| Samples {
        points: left.iter().map(|&k| scan.points[k]).collect(),
        normals: left.iter().map(|&k| scan.normals[k]).collect(),
        areas: left.iter().map(|&k| scan.areas[k]).collect(),
        weights: left.iter().map(|&k| scan.weights[k]).collect(),
        colors: Vec::new(),
    })
}

struct Arm {
    shoulder: Joint,
    elbow: Joint,
    wrist: Joint,
    /// +1 on the left.
    side: f64,
}

const ARMS: [Arm; 2] = [
    Arm { shoulder: Joint::LeftUpperArm, elbow: Joint::LeftLowerArm, wrist: Joint::LeftHand, side: 1.0 },
    Arm { shoulder: Joint::RightUpperArm, elbow: Joint::RightLowerArm, wrist: Joint::RightHand, side: -1.0 },
];

impl Arm {
    fn placed(&self, problem: &BodyProblem, state: &State) -> Option<State> {
        let body = problem.body;
        let (own, others): (Vec<usize>, Vec<usize>) = (0..body.len()).partition(|&v| self.holds(body.main_joint(v)));
        let left = unexplained(problem.reverse, &body.pose(state), &others)?;
        let here = cost(problem, &left, &body.pose_of(state, &own), f32::INFINITY)?;
        let (mut lowest, mut best) = (BETTER * here, None);
        for candidate in self.candidates(body, state) {
            if let Some(there) = cost(problem, &left, &body.pose_of(&candidate, &own), lowest) {
                (lowest, best) = (there, Some(candidate));
            }
        }
        best
    }

    fn holds(&self, joint: Joint) -> bool {
        let mut at = Some(joint);
        while let Some(j) = at {
            if j == self.shoulder {
                return true;
            }
            at = j.parent();
        }
        false
    }

    fn candidates(&self, body: &Articulated, state: &State) -> Vec<State> {
        let skeleton = body.skeleton_at(&state.beta);
        let upper = (skeleton.position(self.elbow) - skeleton.position(self.shoulder)).normalize();
        let lower = (skeleton.position(self.wrist) - skeleton.position(self.elbow)).normalize();
        let hinge = lower.cross(&Vector3::z());
        let mut out = Vec::new();
        for elevation in ELEVATIONS.map(f64::to_radians) {
            for swing in SWINGS.map(f64::to_radians) {
                let out_by = elevation.cos();
                let direction = Vector3::new(self.side * out_by * swing.cos(), elevation.sin(), out_by * swing.sin());
                let raise = UnitQuaternion::rotation_between(&upper, &direction).unwrap_or_default();
                for (twist, bend) in ELBOWS.map(|(t, b)| (f64::to_radians(self.side * t), f64::to_radians(b))) {
                    let mut next = state.clone();
                    *next.pose.rotation_mut(self.shoulder) = raise * UnitQuaternion::from_scaled_axis(upper * twist);
                    *next.pose.rotation_mut(self.elbow) = hinge
                        .try_normalize(1e-9)
                        .map_or_else(UnitQuaternion::identity, |h| UnitQuaternion::from_scaled_axis(h * bend));
                    *next.pose.rotation_mut(self.wrist) = UnitQuaternion::identity();
                    out.push(next);
                }
            }
        }
        out
    }
}

/// Robust disagreement of the arm with the scan plus that of the unexplained scan with the arm, square metres; `None`
/// where it is not below `limit`.
fn cost(problem: &BodyProblem, left: &Samples, arm: &[(Point3<f32>, Vector3<f32>, f32)], limit: f32) -> Option<f32> {
    let robust = |squared: f32| squared / (squared + KERNEL * KERNEL);
    let mut sum = 0.0;
    for (p, n, area) in arm {
        let hit = problem.scan.nearest(p, n, 2.0 * KERNEL, 0.2);
        sum += area * hit.map_or(1.0, |q| robust((p - problem.scan.samples.points[q as usize]).norm_squared()));
        if sum >= limit {
            return None;
        }
    }
    let stride = left.points.len().div_ceil(JUDGED_BY).max(1);
    for (q, w) in left.points.iter().zip(&left.weights).step_by(stride) {
        let nearest = arm.iter().map(|(p, ..)| (p - q).norm_squared()).fold(1.0, f32::min);
        sum += stride as f32 * w * robust(nearest);
        if sum >= limit {
            return None;
        }
    }
    Some(sum)
}
