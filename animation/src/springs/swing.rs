//! Spring bones played as the format's reference does (VRM Consortium, VRMC_springBone-1.0, "spring bone algorithm").

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use toile_character::{Joint, SpringBones, SpringChain, SpringCollider};

/// Chains in motion: give it pose after pose.
#[derive(Debug, Clone)]
pub struct Swing<'a> {
    bones: &'a SpringBones,
    /// Ends of all bones, chain after chain, now and one update before, metres.
    tails: Vec<[Point3<f64>; 2]>,
    /// `posed_from_rest` of all chains' joints.
    moved: Vec<Isometry3<f64>>,
}

impl<'a> Swing<'a> {
    /// The chains at rest.
    pub fn new(bones: &'a SpringBones) -> Self {
        let tails = bones.chains.iter().flat_map(|c| c.joints.windows(2)).map(|pair| [pair[1].place; 2]).collect();
        Self { bones, tails, moved: vec![Isometry3::identity(); bones.joint_count()] }
    }

    /// `posed_from_rest` of all chains' joints after the last update; an end has that of the bone before it.
    pub fn moved(&self) -> &[Isometry3<f64>] {
        &self.moved
    }

    /// Starts at rest on `joints` (`posed_from_rest` of the skeleton's), as players do when a motion begins, and stays there for so many `updates` of
    /// so many `seconds`.
    pub fn settle(&mut self, joints: &[Isometry3<f64>], updates: usize, seconds: f64) {
        let rest = self.bones.chains.iter().flat_map(|c| c.joints.windows(2)).map(|pair| pair[1].place);
        let hips = joints[Joint::Hips.index()];
        self.tails.iter_mut().zip(rest).for_each(|(tail, place)| *tail = [hips * place; 2]);
        (0..updates).for_each(|_| self.update(joints, seconds));
    }

    /// Moves on by `seconds`. `joints` are `posed_from_rest` of the skeleton's joints.
    pub fn update(&mut self, joints: &[Isometry3<f64>], seconds: f64) {
        let capsules: Vec<SpringCollider> = self.bones.colliders.iter().map(|c| placed(c, joints)).collect();
        let (mut first_tail, mut first_joint) = (0, 0);
        for chain in &self.bones.chains {
            let bones = chain.joints.len() - 1;
            let tails = &mut self.tails[first_tail..first_tail + bones];
            let moved = &mut self.moved[first_joint..=first_joint + bones];
            let hips = joints[Joint::Hips.index()];
            swing(chain, &capsules, self.bones.drag, (hips, seconds), tails, moved);
            (first_tail, first_joint) = (first_tail + bones, first_joint + bones + 1);
        }
    }
}

fn placed(capsule: &SpringCollider, joints: &[Isometry3<f64>]) -> SpringCollider {
    SpringCollider { ends: capsule.ends.map(|p| joints[capsule.joint.index()] * p), ..*capsule }
}

/// One update of a chain, from its root to its end.
fn swing(
    chain: &SpringChain,
    capsules: &[SpringCollider],
    drag: f64,
    (hips, seconds): (Isometry3<f64>, f64),
    tails: &mut [[Point3<f64>; 2]],
    moved: &mut [Isometry3<f64>],
) {
    let mut parent = hips;
    for (k, [now, before]) in tails.iter_mut().enumerate() {
        let (joint, rest_tail) = (&chain.joints[k], chain.joints[k + 1].place);
        let (head, rest) = (parent * joint.place, parent * (rest_tail - joint.place));
        let length = rest.norm();
        let pulled = *now + (*now - *before) * (1.0 - drag) + rest / length.max(1e-9) * (joint.stiffness * seconds);
        let mut tail = at_length(&head, &pulled, length);
        for capsule in capsules {
            let lacks = joint.hit_radius - capsule.distance(&tail);
            if lacks > 0.0 {
                tail = at_length(&head, &(tail + away(capsule, &tail) * lacks), length);
            }
        }
        (*before, *now) = (*now, tail);
        let turn = UnitQuaternion::rotation_between(&rest, &(tail - head)).unwrap_or_default();
        parent = Translation3::from(head.coords) * turn * Translation3::from(-head.coords) * parent;
        moved[k] = parent;
    }
    if let Some(end) = moved.last_mut() {
        *end = parent;
    }
}

/// The place at `length` from `head` towards `tail`.
fn at_length(head: &Point3<f64>, tail: &Point3<f64>, length: f64) -> Point3<f64> {
    (tail - head).try_normalize(1e-12).map_or(*tail, |direction| head + direction * length)
}

/// The direction from a capsule's axis to `p`.
fn away(capsule: &SpringCollider, p: &Point3<f64>) -> Vector3<f64> {
    let [a, b] = capsule.ends;
    let axis = b - a;
    let along = (p - a).dot(&axis) / axis.norm_squared().max(1e-12);
    (p - (a + axis * along.clamp(0.0, 1.0))).try_normalize(1e-12).unwrap_or_else(Vector3::zeros)
}
