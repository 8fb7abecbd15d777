//! Where the contours' own rays leave the body: what the primitives have to reproduce.

use nalgebra::{Isometry3, Point3, Vector3};
use toile_character::{Joint, Pose, SkinnedMesh};

use crate::{body::ImplicitBody, envelope::Envelope, group::Group, target::Target};

/// A point where the field has a known value, or a known side of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// Which pose it is of: 0 is the rest.
    pub pose: usize,
    /// The group whose primitives are seen there.
    pub group: Group,
    /// Metres, in the frame of the pose.
    pub point: Point3<f64>,
    /// Along the ray, outward.
    pub direction: Vector3<f64>,
    /// From the link to the skin, metres.
    pub depth: f64,
    /// How far rays look there, metres.
    pub reach: f64,
    /// The joint that moves the skin there.
    pub joint: Joint,
    /// What is known.
    pub kind: Known,
    /// How much it counts.
    pub weight: f64,
}

/// What is known of the field at a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Known {
    /// It is at the threshold: the skin.
    Skin,
    /// It is at most this: outside.
    AtMost(f64),
    /// It is at least this: inside.
    AtLeast(f64),
}

/// All samples, and where the joints are in each pose.
pub(super) struct Samples {
    pub samples: Vec<Sample>,
    /// `posed_from_rest` of every joint's bone, by pose.
    pub bones: Vec<Vec<Isometry3<f64>>>,
    /// Number of samples on the skin at rest, which come first.
    pub at_rest: usize,
}

/// How far outside of the skin (metres) the field must have fallen to which value, so that rays find their last crossing at the
/// skin: a metaball of 10 cm falls by 0.1 in 12 mm.
const OUTSIDE: [(f64, f64); 9] = [
    (0.012, 0.46),
    (0.025, 0.42),
    (0.045, 0.4),
    (0.07, 0.4),
    (0.1, 0.4),
    (0.14, 0.4),
    (0.19, 0.4),
    (0.25, 0.4),
    (0.32, 0.4),
];
/// How deep inside it must have risen.
const INSIDE: (f64, f64) = (-0.01, 0.53);
/// Samples beside the skin count less: they are bounds.
const BESIDE: f64 = 0.5;
/// In poses other than the first, every third point is looked at: the surface is the same, only moved.
const OTHER_POSES: usize = 3;

impl Samples {
    /// On `body` at rest and in `poses`.
    pub fn new(envelope: &Envelope, implicit: &ImplicitBody, body: &SkinnedMesh, poses: &[Pose]) -> Self {
        let all: Vec<Pose> = std::iter::once(Pose::identity()).chain(poses.iter().cloned()).collect();
        let mut out = Self { samples: Vec::new(), bones: Vec::new(), at_rest: 0 };
        let mut beside = Vec::new();
        for (k, pose) in all.iter().enumerate() {
            out.bones.push(pose.skinning_transforms(&body.skeleton));
            let target = Target::new(body, pose);
            let contours = envelope.contours(implicit, pose, &target);
            let step = if k == 0 { 1 } else { OTHER_POSES };
            for n in (0..envelope.plan.count).step_by(step) {
                let ray = contours.rays[n];
                let Some((depth, triangle)) = target.exit(&ray) else { continue };
                let joint = target.joints[triangle as usize];
                let sample = Sample {
                    pose: k,
                    group: ray.group,
                    point: ray.at(depth),
                    direction: ray.direction,
                    depth,
                    reach: ray.reach,
                    joint,
                    kind: Known::Skin,
                    weight: if k == 0 { 1.0 } else { (OTHER_POSES as f64).sqrt() / all.len() as f64 },
                };
                out.samples.push(sample);
                if k == 0 {
                    beside.extend(bounds(&sample));
                }
            }
            if k == 0 {
                out.at_rest = out.samples.len();
            }
        }
        out.samples.extend(beside);
        out
    }

    /// The samples on the skin at rest.
    pub fn rest(&self) -> &[Sample] {
        &self.samples[..self.at_rest]
    }
}

fn bounds(skin: &Sample) -> Vec<Sample> {
    let at = |offset: f64, kind| Sample {
        point: skin.point + skin.direction * offset,
        kind,
        weight: BESIDE * skin.weight,
        ..*skin
    };
    let outside = OUTSIDE.iter().filter(|(offset, _)| skin.depth + offset < skin.reach);
    let mut out: Vec<Sample> = outside.map(|&(offset, value)| at(offset, Known::AtMost(value))).collect();
    out.push(at(INSIDE.0, Known::AtLeast(INSIDE.1)));
    out
}
