//! A clothed arm as balls along its bones.

use nalgebra::{Isometry3, Point3};
use toile_character::{Joint, Skeleton, SkinWeights, joint::JOINTS};
use toile_geometry::{
    Mesh,
    statistics::{Rank, quantile_by},
};

/// Places along a bone at which its thickness is measured.
const ALONG: [f64; 4] = [0.25, 0.5, 0.75, 1.0];
/// Vertices that tell the thickness at a place lie within this share of the bone's length of it.
const SLICE: f64 = 0.2;
/// Share of the upper arm that is the shoulder: it never leaves the trunk.
const SHOULDER: f64 = 0.4;
/// A limb that is flat turns its flat side to the trunk.
const FLAT: f64 = 0.25;

/// A clothed arm.
pub(super) struct Arm {
    pub upper: Joint,
    pub hand: Joint,
    balls: Vec<Ball>,
}

/// A ball inside the arm.
struct Ball {
    /// The joint that carries it.
    joint: Joint,
    /// Its centre in the joint's frame, metres.
    centre: Point3<f64>,
    /// Distance from its centre that the trunk's clothes have to keep, metres.
    needed: f64,
}

impl Arm {
    /// The arm from the joint `upper` down, of a `body` that is where the joints are at `frames`, with `pressed` metres of clothes over
    /// each of its vertices.
    pub fn new(
        upper: Joint,
        skeleton: &Skeleton,
        frames: &[Isometry3<f64>],
        body: &Mesh,
        weights: &SkinWeights,
        pressed: &[f32],
    ) -> Self {
        let (lower, hand, finger) = match upper {
            Joint::LeftUpperArm => (Joint::LeftLowerArm, Joint::LeftHand, Joint::LeftMiddleIntermediate),
            _ => (Joint::RightLowerArm, Joint::RightHand, Joint::RightMiddleIntermediate),
        };
        let mut balls = Vec::new();
        for (joint, end) in [(upper, lower), (lower, hand), (hand, finger)] {
            let bone = skeleton.position(end) - skeleton.position(joint);
            let joint_from_world = frames[joint.index()].inverse();
            let carried = |v: &usize| carried_by(weights.joints[*v][0], joint);
            let of_bone: Vec<(Point3<f64>, f64)> = (0..body.positions.len())
                .filter(carried)
                .map(|v| (joint_from_world * body.positions[v].cast::<f64>(), f64::from(pressed[v])))
                .collect();
            for share in ALONG.into_iter().filter(|&share| joint != upper || share > SHOULDER) {
                let near = |p: &Point3<f64>| (p.coords.dot(&bone) / bone.norm_squared() - share).abs() < SLICE;
                let across = |p: &Point3<f64>| (p.coords - bone * (p.coords.dot(&bone) / bone.norm_squared())).norm();
                let mut thickness: Vec<f64> =
                    of_bone.iter().filter(|(p, _)| near(p)).map(|(p, cloth)| across(p) + cloth).collect();
                if let Some(needed) = quantile_by(&mut thickness, FLAT, Rank::Nearest) {
                    balls.push(Ball { joint, centre: Point3::from(bone * share), needed });
                }
            }
        }
        Self { upper, hand, balls }
    }

    /// Centres of the balls where the joints are at `frames`, with what each needs, metres.
    pub fn stations(&self, frames: &[Isometry3<f64>]) -> Vec<(Point3<f64>, f64)> {
        self.balls.iter().map(|b| (frames[b.joint.index()] * b.centre, b.needed)).collect()
    }

    /// Asks of no ball for more than the height over the trunk that it has now, metres.
    pub fn allow(&mut self, heights: &[f64]) {
        self.balls.iter_mut().zip(heights).for_each(|(ball, height)| ball.needed = ball.needed.min(*height));
    }
}

/// True where the joint of index `moves` is `joint`, or a finger of it where that is a hand.
fn carried_by(moves: u8, joint: Joint) -> bool {
    let Some(&moves) = JOINTS.get(usize::from(moves)) else { return false };
    let mut up = Some(moves);
    while up.is_some_and(Joint::is_finger) {
        up = up.and_then(Joint::parent);
    }
    up == Some(joint)
}
