//! Limbs laid where they agree best with what the rest of the body leaves unexplained.
//!
//! A limb may be unseen in part, but it is never inside the body: skin deep inside the scan costs more than skin where
//! no scan is.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use toile_character::{Joint, Pose, Skeleton};

use super::{
    Search,
    directions::{LIMBS, Limb},
    trunk::is_trunk,
};
use crate::{
    fit::arms::unexplained,
    solve::{Articulated, State},
    surface::Samples,
};

/// Cost elsewhere, as a share of the cost where a limb is, below which it is moved.
const BETTER: f32 = 0.9;
/// Scale of the robust cost, metres.
const KERNEL: f32 = 0.05;
/// Cost of skin without scan of its own side near it, and of skin deep inside; 1 is that of skin at the kernel's end.
const UNSEEN: f32 = 0.6;
const BURIED: f32 = 1.5;
/// Depth from which on skin is deep inside, metres: more than the grid of depths errs, less than a wrist's half.
const DEEP: f32 = 0.025;
/// Number of places that are judged by the whole skin: those whose bones lie best.
const JUDGED: usize = 260;
/// Largest number of unexplained points that a limb is judged by.
const JUDGED_BY: usize = 160;

/// A place of a limb: rotations of its first two joints.
type Turns = [UnitQuaternion<f64>; 2];
/// Vertices of a limb: position, normal, area.
type Skin = [(Point3<f32>, Vector3<f32>, f32)];

impl Search<'_> {
    /// The state with all limbs laid anew, legs first: each against what trunk and the limbs laid before leave over.
    pub(super) fn laid(&self, trunk: &State) -> State {
        let body = self.problem.body;
        let mut placed: Vec<usize> = (0..body.len()).filter(|&v| is_trunk(body.main_joint(v))).collect();
        let mut state = trunk.clone();
        for limb in &LIMBS {
            let own: Vec<usize> = (0..body.len()).filter(|&v| belongs(limb, body.main_joint(v))).collect();
            let left = self.left_over(&state, &placed);
            if let Some(better) = self.better(&state, limb, &own, &left, f32::INFINITY) {
                state = better;
            }
            placed.extend(own);
        }
        state
    }

    /// The state with limbs moved that find a better place; `None` where none does.
    pub(super) fn moved(&self, state: &State) -> Option<State> {
        let body = self.problem.body;
        let mut best = state.clone();
        let mut is_moved = false;
        for limb in &LIMBS {
            let (own, others): (Vec<usize>, Vec<usize>) =
                (0..body.len()).partition(|&v| belongs(limb, body.main_joint(v)));
            let left = self.left_over(&best, &others);
            let Some(here) = self.cost(&left, &body.pose_of(&best, &own), f32::INFINITY) else { continue };
            if let Some(state) = self.better(&best, limb, &own, &left, BETTER * here) {
                (best, is_moved) = (state, true);
            }
        }
        is_moved.then_some(best)
    }

    /// Scan without any of the body's vertices `of` near it.
    fn left_over(&self, state: &State, of: &[usize]) -> Samples {
        unexplained(self.problem.reverse, &self.problem.body.pose(state), of).unwrap_or_default()
    }

    /// The limb's best place, if its cost is below `limit`.
    fn better(&self, state: &State, limb: &Limb, own: &[usize], left: &Samples, limit: f32) -> Option<State> {
        let body = self.problem.body;
        let (mut lowest, mut best) = (limit, None);
        for turns in self.likely(body, state, limb) {
            let mut next = state.clone();
            set(&mut next.pose, limb, turns);
            if let Some(there) = self.cost(left, &body.pose_of(&next, own), lowest) {
                (lowest, best) = (there, Some(next));
            }
        }
        best
    }

    /// The places whose bones lie farthest inside the scan, best first.
    fn likely(&self, body: &Articulated, state: &State, limb: &Limb) -> Vec<Turns> {
        let skeleton = body.skeleton_at(&state.beta);
        let frames = state.pose.joint_frames(&skeleton);
        let Some(parent) = limb.root.parent().map(|p| frames[p.index()]) else { return Vec::new() };
        let rated = |turns: Turns| {
            let points = bones(&skeleton, limb, &parent, &turns);
            // the middle of a bone lies as deep as the limb is thick; deeper is not better
            (points.iter().map(|p| self.depths.at(p).min(DEEP)).sum::<f32>(), turns)
        };
        let mut all: Vec<(f32, Turns)> = limb.rotations(&skeleton).into_iter().map(rated).collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        all.into_iter().take(JUDGED).map(|a| a.1).collect()
    }

    /// Robust disagreement of a limb's skin with the scan plus that of the unexplained scan with the limb, square metres;
    /// `None` where it is not below `limit`.
    fn cost(&self, left: &Samples, skin: &Skin, limit: f32) -> Option<f32> {
        let robust = |squared: f32| squared / (squared + KERNEL * KERNEL);
        let scan = self.problem.scan;
        let mut sum = 0.0;
        for (p, n, area) in skin {
            let near =
                || scan.nearest(p, n, 2.0 * KERNEL, 0.2).map(|q| (p - scan.samples.points[q as usize]).norm_squared());
            sum +=
                area * if self.depths.at(p) > DEEP { BURIED } else { near().map_or(UNSEEN, |s| robust(s).min(UNSEEN)) };
            if sum >= limit {
                return None;
            }
        }
        let stride = left.points.len().div_ceil(JUDGED_BY).max(1);
        for (q, w) in left.points.iter().zip(&left.weights).step_by(stride) {
            let nearest = skin.iter().map(|(p, ..)| (p - q).norm_squared()).fold(1.0, f32::min);
            sum += stride as f32 * w * robust(nearest);
            if sum >= limit {
                return None;
            }
        }
        Some(sum)
    }
}

/// Points along the bones of a limb at `turns`: middle of the first, middle joint, middle of the second, end.
fn bones(skeleton: &Skeleton, limb: &Limb, parent: &Isometry3<f64>, turns: &Turns) -> [Point3<f32>; 4] {
    let root = parent * Translation3::from(skeleton.offset(limb.root)) * turns[0];
    let first = skeleton.offset(limb.middle);
    let middle = root * Translation3::from(first) * turns[1];
    let second = skeleton.offset(limb.end);
    let at = |frame: &Isometry3<f64>, along: Vector3<f64>| (frame * Point3::from(along)).cast::<f32>();
    [at(&root, first * 0.6), at(&root, first), at(&middle, second * 0.5), at(&middle, second)]
}

fn set(pose: &mut Pose, limb: &Limb, [root, middle]: Turns) {
    *pose.rotation_mut(limb.root) = root;
    *pose.rotation_mut(limb.middle) = middle;
    *pose.rotation_mut(limb.end) = UnitQuaternion::identity();
}

/// Whether a joint hangs on the limb.
fn belongs(limb: &Limb, joint: Joint) -> bool {
    std::iter::successors(Some(joint), |j| j.parent()).any(|j| j == limb.root)
}
