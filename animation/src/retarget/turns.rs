//! The target's joints turned as the source's are in one frame.

use nalgebra::{Isometry3, UnitQuaternion};
use toile_character::{Joint, Skeleton, interpolation::rotation_between, joint::JOINTS};
use toile_geometry::direction::swing;

use super::constants::{Constants, bone};
use crate::{Bvh, skeleton::Source};

/// World rotations of all target joints, in source coordinates.
pub(super) fn world_rotations(
    bvh: &Bvh,
    source: &Source,
    reference: &Constants,
    world: &[Isometry3<f64>],
    target: &Skeleton,
    fingers: bool,
) -> Vec<UnitQuaternion<f64>> {
    let mut turned: Vec<UnitQuaternion<f64>> = vec![UnitQuaternion::identity(); JOINTS.len()];
    let trunk = TrunkTurns::new(source, reference, world);
    for joint in JOINTS {
        let parent = joint.parent().map_or(trunk.spine[0], |p| turned[p.index()]);
        turned[joint.index()] = match (trunk.of(joint), source.limb(joint)) {
            (Some(rotation), _) => rotation,
            (None, Some(_)) if joint.is_finger() && !fingers => parent,
            (None, Some(s)) => {
                let rotation = world[s].rotation * reference.limbs[joint.index()];
                let tip = if points_exactly(joint) { source.tip(joint, bvh, world) } else { None };
                match (tip, bone(target, joint)) {
                    (Some(tip), Some(bone)) => {
                        swing(&(rotation * bone), &(tip - source.position(joint, world))) * rotation
                    }
                    _ => rotation,
                }
            }
            (None, None) => parent,
        };
    }
    turned
}

/// The joints whose bones point exactly where the source's do.
fn points_exactly(joint: Joint) -> bool {
    use Joint::*;
    matches!(
        joint,
        LeftUpperArm
            | LeftLowerArm
            | LeftUpperLeg
            | LeftLowerLeg
            | RightUpperArm
            | RightLowerArm
            | RightUpperLeg
            | RightLowerLeg
    )
}

/// Turns of the source's trunk, spread over the target's joints whatever their number.
struct TrunkTurns {
    spine: Vec<UnitQuaternion<f64>>,
    neck: Vec<UnitQuaternion<f64>>,
}

impl TrunkTurns {
    fn new(source: &Source, reference: &Constants, world: &[Isometry3<f64>]) -> Self {
        let turns = |joints: &[usize], constants: &[UnitQuaternion<f64>]| -> Vec<UnitQuaternion<f64>> {
            joints.iter().zip(constants).map(|(&j, c)| world[j].rotation * c).collect()
        };
        let mut spine = vec![world[source.pelvis].rotation * reference.pelvis];
        spine.extend(turns(&source.spine, &reference.spine));
        let mut neck = vec![spine[spine.len() - 1]];
        neck.extend(turns(&source.neck, &reference.neck));
        neck.extend(source.head.map(|h| world[h].rotation * reference.head));
        Self { spine, neck }
    }

    fn of(&self, joint: Joint) -> Option<UnitQuaternion<f64>> {
        Some(match joint {
            Joint::Hips => self.spine[0],
            Joint::Spine => along(&self.spine, 1.0 / 3.0),
            Joint::Chest => along(&self.spine, 2.0 / 3.0),
            Joint::UpperChest => along(&self.spine, 1.0),
            Joint::Neck => along(&self.neck, 0.5),
            Joint::Head => along(&self.neck, 1.0),
            _ => return None,
        })
    }
}

/// The turn at `share` (0 to 1) of the way along a chain of turns.
fn along(chain: &[UnitQuaternion<f64>], share: f64) -> UnitQuaternion<f64> {
    let at = share * (chain.len() - 1) as f64;
    let (low, high) = (at.floor() as usize, (at.ceil() as usize).min(chain.len() - 1));
    rotation_between(&chain[low], &chain[high], at - low as f64)
}
