//! Room for clothes between the arms and the trunk.
//!
//! Somebody in a jumper and a coat cannot let the arms hang as somebody in a shirt does: the cloth between them has a thickness.
//! A motion knows nothing of that, and its arms would push five layers into each other. Here each upper arm is held as much
//! further from the body as the clothes that are worn need, pressed to what cloth between arm and trunk is pressed to; the
//! same keeps an arm out of a trunk that is wider than that of the person who was recorded.

mod arm;
mod trunk;

use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use toile_character::{Joint, Motion, Pose, Skeleton, SkinWeights};
use toile_geometry::{Mesh, topology::VertexNeighbors};

use self::{arm::Arm, trunk::Trunk};
use super::{
    anchors::Closeness,
    loft::{Loft, THINNEST},
};

/// Overlap that is left, metres: skin and flesh give way by as much without being noticed.
const LEFT_OVER: f64 = 0.002;
/// Farthest that an arm is turned, radians: 40°.
const FARTHEST: f64 = 0.7;
/// Angles that are tried, and halvings of the step that is found: 0.1°.
const TRIES: usize = 14;
const HALVINGS: usize = 5;
/// An arm begins to move this long before it has to, and goes back as slowly, seconds: half the swing of an arm that walks.
const AHEAD: f64 = 0.25;
/// Share of the air in cloth that stays between arm and trunk: half, assumed.
const AIR: f32 = 0.5;
/// Joint angles in which the ends of a motion that goes round may differ, radians.
const SAME: f64 = 0.02;

/// How far the arms had to be held from the body.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Room {
    /// Largest turn of the left and the right upper arm, radians.
    pub largest: [f64; 2],
    /// Poses in which an arm was turned.
    pub poses: usize,
}

/// A body and what it wears, as far as its arms need room.
pub struct Clothed<'a> {
    skeleton: &'a Skeleton,
    pose0: &'a Pose,
    arms: [Arm; 2],
    trunk: Trunk,
}

impl<'a> Clothed<'a> {
    /// The `layers` (the first is the body, the others garments from inside to outside), which are in `pose0` of `skeleton`.
    /// `None` where there is no body.
    pub fn new(skeleton: &'a Skeleton, pose0: &'a Pose, layers: &[&Mesh], weights: &SkinWeights) -> Option<Self> {
        let body = layers.first().filter(|b| !b.is_empty())?;
        let n = body.positions.len();
        let neighbours = VertexNeighbors::new(n, &body.triangles);
        let loft = Loft::new(&layers[1..], &Closeness::new(body), &neighbours, n);
        let pressed: Vec<f32> = (0..n).map(|v| pressed(loft.tops[v], loft.count(v))).collect();
        let trunk = Trunk::new(body, weights, &pressed);
        let frames = pose0.joint_frames(skeleton);
        let sides = [Joint::LeftUpperArm, Joint::RightUpperArm];
        let arms = sides.map(|upper| Arm::new(upper, skeleton, &frames, body, weights, &pressed));
        let mut clothed = Self { skeleton, pose0, arms, trunk };
        clothed.allow_what_was_scanned();
        Some(clothed)
    }

    /// Holds the arms of a motion as far from the body as the clothes between them need.
    pub fn make_room(&self, motion: &mut Motion) -> Room {
        let needed: Vec<[f64; 2]> = motion.poses.par_iter().map(|pose| self.turns(pose)).collect();
        let ahead = (AHEAD / motion.frame_time).round() as usize;
        let around = motion.poses.len() > 2 && goes_round(&motion.poses);
        let sides = [0, 1].map(|side| {
            let turns: Vec<f64> = needed.iter().map(|n| n[side]).collect();
            ahead_of_time(&turns, ahead, around)
        });
        for (k, pose) in motion.poses.iter_mut().enumerate() {
            for (arm, turns) in self.arms.iter().zip(&sides) {
                if turns[k] > 0.0 {
                    self.turn(pose, arm, turns[k]);
                }
            }
        }
        Room {
            largest: [0, 1].map(|side| sides[side].iter().copied().fold(0.0, f64::max)),
            poses: (0..motion.poses.len()).filter(|&k| sides.iter().any(|turns| turns[k] > 0.0)).count(),
        }
    }

    /// The person was scanned as they were: what overlaps then is no lack of room.
    fn allow_what_was_scanned(&mut self) {
        let skin = self.trunk.posed(&self.pose0.transforms_from(self.pose0, self.skeleton));
        let frames = self.pose0.joint_frames(self.skeleton);
        for arm in &mut self.arms {
            let stations = arm.stations(&frames);
            arm.allow(&stations.iter().map(|(p, _)| skin.height(p)).collect::<Vec<_>>());
        }
    }

    /// How far each arm has to be turned in a pose, radians.
    fn turns(&self, pose: &Pose) -> [f64; 2] {
        let frames = pose.joint_frames(self.skeleton);
        let skin = self.trunk.posed(&pose.transforms_from(self.pose0, self.skeleton));
        [0, 1].map(|side| {
            let arm = &self.arms[side];
            let (stations, axis) = (arm.stations(&frames), self.axis(pose, arm));
            let shoulder = frames[arm.upper.index()].translation.vector;
            let overlap = |angle: f64| {
                let turn = UnitQuaternion::from_axis_angle(&axis, angle);
                let lack = |(p, needed): &(Point3<f64>, f64)| needed - skin.height(&(turn * (p - shoulder) + shoulder));
                stations.iter().map(lack).fold(f64::NEG_INFINITY, f64::max)
            };
            least(overlap)
        })
    }

    /// The axis about which an arm is turned away from the body: across the arm and the way to its side.
    fn axis(&self, pose: &Pose, arm: &Arm) -> Unit<Vector3<f64>> {
        let frames = pose.joint_frames(self.skeleton);
        let at = |joint: Joint| frames[joint.index()].translation.vector;
        let side = at(arm.upper) - at(arm.upper.mirrored());
        let along = at(arm.hand) - at(arm.upper);
        // An arm that points to its side is clear of the body anyway.
        Unit::try_new(along.cross(&side), 1e-6).unwrap_or_else(Vector3::z_axis)
    }

    /// Turns an upper arm away from the body.
    fn turn(&self, pose: &mut Pose, arm: &Arm, angle: f64) {
        let turn = UnitQuaternion::from_axis_angle(&self.axis(pose, arm), angle);
        let frames = pose.joint_frames(self.skeleton);
        let parent = arm.upper.parent().map_or(UnitQuaternion::identity(), |p| frames[p.index()].rotation);
        let local = pose.rotation_mut(arm.upper);
        *local = parent.inverse() * turn * parent * *local;
    }
}

/// What is left of clothes between arm and trunk, metres, where `count` layers lie up to a height of `top`.
fn pressed(top: f32, count: f32) -> f32 {
    let cloth = (THINNEST * count).min(top);
    cloth + AIR * (top - cloth).max(0.0)
}

/// The least angle at which hardly anything overlaps, or at which least does, radians.
fn least(overlap: impl Fn(f64) -> f64) -> f64 {
    if overlap(0.0) <= LEFT_OVER {
        return 0.0;
    }
    let step = FARTHEST / TRIES as f64;
    let (mut best, mut fewest) = (0.0, overlap(0.0));
    for k in 1..=TRIES {
        let angle = k as f64 * step;
        let left = overlap(angle);
        if left <= LEFT_OVER {
            let (mut low, mut high) = (angle - step, angle);
            for _ in 0..HALVINGS {
                let middle = f64::midpoint(low, high);
                if overlap(middle) <= LEFT_OVER { high = middle } else { low = middle }
            }
            return high;
        }
        if left < fewest - LEFT_OVER / 2.0 {
            (best, fewest) = (angle, left);
        }
    }
    best
}

/// Angles that are nowhere below `needed`, and rise and fall over `ahead` poses on either side.
fn ahead_of_time(needed: &[f64], ahead: usize, around: bool) -> Vec<f64> {
    let n = needed.len() as isize;
    // The last pose of a motion that goes round is its first.
    let at = |k: isize| -> usize {
        let k = if around { k.rem_euclid(n - 1) } else { k.clamp(0, n - 1) };
        k as usize
    };
    let reach = ahead as isize;
    let window = |k: isize| (k - reach..=k + reach).map(at);
    let highest: Vec<f64> = (0..n).map(|k| window(k).map(|i| needed[i]).fold(0.0, f64::max)).collect();
    let weight = |i: isize| 1.0 + (std::f64::consts::PI * i as f64 / (reach + 1) as f64).cos();
    let total: f64 = (-reach..=reach).map(weight).sum();
    (0..n).map(|k| (-reach..=reach).map(|i| weight(i) * highest[at(k + i)]).sum::<f64>() / total).collect()
}

/// True where the last pose is the first again, but for where the person is.
fn goes_round(poses: &[Pose]) -> bool {
    let (Some(first), Some(last)) = (poses.first(), poses.last()) else { return false };
    first.rotations.iter().zip(&last.rotations).skip(1).all(|(a, b)| a.angle_to(b) < SAME)
}
