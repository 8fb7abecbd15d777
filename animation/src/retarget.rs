//! A motion file carried onto the skeleton of one person.
//!
//! Limbs of the result point where the source's limbs point, in every frame and exactly unless a foot has to be lifted
//! out of the floor; twist comes from the source's joints; trunk and head turn as the source's do. The hips go the source's way scaled by leg length, so
//! that feet land instead of sliding, and the whole is set on the floor facing +Z.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use toile_character::{
    Joint, Motion, Pose, Skeleton, feet::lift_out_of_floor, interpolation::rotation_between, joint::JOINTS,
};
use toile_geometry::direction::{align, swing, unit_or};

use crate::{
    AnimationError,
    bvh::Bvh,
    ground,
    looping::close_loop,
    reference::{Reference, bone, find_reference},
    resample::resample,
    source::{Source, recognise},
};

/// How a motion is carried over.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RetargetSettings {
    /// Most poses a second of the result; faster motions are resampled, slower ones kept. 1 to 1000 Hz, default 30.
    pub max_rate: f64,
    /// Turn the motion so that the person faces +Z in its first frame. Default true.
    pub face_front: bool,
    /// Stay in place: the travel over the ground is left out. Default false.
    pub in_place: bool,
    /// Cut and blend the motion so that its end goes over into its start, in place. Default false.
    pub looped: bool,
    /// Turn finger joints where the source has them. Default true.
    pub fingers: bool,
    /// Lift feet that would dip below the floor, by bending the knee. Default true.
    pub lift_feet: bool,
}

impl Default for RetargetSettings {
    fn default() -> Self {
        Self { max_rate: 30.0, face_front: true, in_place: false, looped: false, fingers: true, lift_feet: true }
    }
}

/// A motion on the target's skeleton and what was decided on the way.
#[derive(Debug, Clone)]
pub struct Retargeted {
    /// The motion, poses relative to the target's rest.
    pub motion: Motion,
    /// What was found and decided.
    pub report: RetargetReport,
}

/// What a retargeting found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RetargetReport {
    /// Target metres per unit of the file.
    pub metres_per_unit: f64,
    /// Coordinate axis that is up in the file.
    pub up: [f64; 3],
    /// True where the file's zero pose is that of a standing person and was used to compare the skeletons.
    pub zero_pose_used: bool,
    /// True where the first frame was a calibration pose and was left out.
    pub first_frame_dropped: bool,
    /// Joints of the target with the file's joints that move them.
    pub joints: Vec<(Joint, String)>,
    /// Poses in the result.
    pub poses: usize,
    /// Depth of the lower foot's sole below the floor, 98th percentile over the poses, metres.
    pub foot_below_floor: f64,
}

/// Carries `bvh` onto the person whose rest is `target`; the result is called `name`.
///
/// # Errors
/// [`AnimationError::UnknownSkeleton`] where the joints are not a person's, [`AnimationError::Motion`] where one of
/// the skeletons has no legs to measure, [`AnimationError::Setting`] for a setting out of range.
pub fn retarget(
    bvh: &Bvh,
    name: &str,
    target: &Skeleton,
    settings: &RetargetSettings,
) -> Result<Retargeted, AnimationError> {
    check(bvh, target, settings)?;
    let source = recognise(bvh)?;
    let reference = find_reference(bvh, &source, target);
    let first = usize::from(starts_with_calibration(bvh));
    let metres_per_unit = scale(bvh, &source, target)?;
    let subject_from_source = subject_from_source(bvh, &source, &reference, first, settings.face_front);
    let mut poses: Vec<Pose> = (first..bvh.frames.len())
        .map(|frame| {
            let world = bvh.joint_frames(frame);
            let rotations = world_rotations(bvh, &source, &reference, &world, target, settings.fingers);
            let rotations: Vec<_> = rotations.iter().map(|r| subject_from_source * r).collect();
            let legs = subject_from_source * mid_legs(&source, &world).coords * metres_per_unit;
            pose_of(target, &rotations, &legs)
        })
        .collect();
    ground::place(target, &mut poses);
    if settings.lift_feet {
        lift_out_of_floor(target, &mut poses);
    }
    if settings.in_place || settings.looped {
        ground::keep_in_place(target, &mut poses, bvh.frame_time);
    }
    let mut motion = resample(&Motion { name: name.into(), frame_time: bvh.frame_time, poses }, settings.max_rate);
    if settings.looped {
        motion = close_loop(&motion);
    }
    let report = RetargetReport {
        metres_per_unit,
        up: reference.up.into(),
        zero_pose_used: reference.from_rest,
        first_frame_dropped: first == 1,
        joints: source.named(bvh),
        poses: motion.poses.len(),
        foot_below_floor: ground::depth_below_floor(target, &motion.poses),
    };
    Ok(Retargeted { motion, report })
}

fn check(bvh: &Bvh, target: &Skeleton, settings: &RetargetSettings) -> Result<(), AnimationError> {
    if !(1.0..=1000.0).contains(&settings.max_rate) {
        let (name, range) = ("max_rate", "1 to 1000 poses a second");
        return Err(AnimationError::Setting { name, value: settings.max_rate, range });
    }
    if bvh.frames.is_empty() || !(bvh.frame_time > 0.0 && bvh.frame_time.is_finite()) {
        return Err(AnimationError::Motion("it has no frame, or no positive frame time".into()));
    }
    if target.rest.iter().any(|p| !p.coords.iter().all(|c| c.is_finite())) {
        return Err(AnimationError::Motion("the target skeleton has a joint that is nowhere (not finite)".into()));
    }
    Ok(())
}

/// Target metres per file unit, by the length of the legs: files are in metres, centimetres, inches and units of
/// their own, and nothing in them says which.
fn scale(bvh: &Bvh, source: &Source, target: &Skeleton) -> Result<f64, AnimationError> {
    use Joint::*;
    let world = bvh.joint_frames(0);
    let (mut from, mut to) = (0.0, 0.0);
    for (upper, lower, foot) in [(LeftUpperLeg, LeftLowerLeg, LeftFoot), (RightUpperLeg, RightLowerLeg, RightFoot)] {
        let (hip, knee) = (source.position(upper, &world), source.position(lower, &world));
        from += (knee - hip).norm() + (source.ankle(lower, bvh, &world) - knee).norm();
        to += target.offset(lower).norm() + target.offset(foot).norm();
    }
    if from < 1e-9 || to < 1e-9 {
        return Err(AnimationError::Motion("the legs of the file's skeleton, or of the target, have no length".into()));
    }
    Ok(to / from)
}

/// The source's axes turned to +Y up and, if wished, so that the hips look along +Z in frame `first`.
fn subject_from_source(
    bvh: &Bvh,
    source: &Source,
    reference: &Reference,
    first: usize,
    face_front: bool,
) -> UnitQuaternion<f64> {
    let hips = bvh.joint_frames(first)[source.pelvis].rotation * reference.pelvis;
    let facing = if face_front { hips * Vector3::z() } else { reference.up.yzx() };
    let level = facing - reference.up * reference.up.dot(&facing);
    // Someone who lies on the back or the belly faces nowhere: then the way the head points is as good.
    let front = unit_or(&level, &(hips * Vector3::y()));
    align([&reference.up, &front], [&Vector3::y(), &Vector3::z()])
}

/// World rotations of all target joints, in source coordinates.
fn world_rotations(
    bvh: &Bvh,
    source: &Source,
    reference: &Reference,
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
    fn new(source: &Source, reference: &Reference, world: &[Isometry3<f64>]) -> Self {
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

fn mid_legs(source: &Source, world: &[Isometry3<f64>]) -> Point3<f64> {
    nalgebra::center(&source.position(Joint::LeftUpperLeg, world), &source.position(Joint::RightUpperLeg, world))
}

/// The pose with these world rotations whose upper legs start about the point `legs`.
fn pose_of(target: &Skeleton, rotations: &[UnitQuaternion<f64>], legs: &Vector3<f64>) -> Pose {
    let mut pose = Pose::identity();
    for joint in JOINTS {
        let parent = joint.parent().map_or_else(UnitQuaternion::identity, |p| rotations[p.index()]);
        *pose.rotation_mut(joint) = parent.inverse() * rotations[joint.index()];
    }
    let hips = target.position(Joint::Hips);
    let middle = nalgebra::center(&target.position(Joint::LeftUpperLeg), &target.position(Joint::RightUpperLeg));
    pose.translation = legs - rotations[0] * (middle - hips) - hips.coords;
    pose
}

/// True where the first frame is a pose for calibration that the motion jumps out of: nearly zero rotations, then
/// a step many times as large as the motion's own.
fn starts_with_calibration(bvh: &Bvh) -> bool {
    const NEARLY_ZERO: f64 = 8.0; // degrees, a channel
    const JUMP: f64 = 5.0; // times the median step
    if bvh.frames.len() < 4 {
        return false;
    }
    let rotations: Vec<bool> = bvh
        .joints
        .iter()
        .flat_map(|j| j.channels.iter().map(|c| matches!(c, crate::bvh::Channel::Rotation(_))))
        .collect();
    let still = bvh.frames[0].iter().zip(&rotations).all(|(v, rotation)| !rotation || v.abs() < NEARLY_ZERO);
    let step = |i: usize| {
        let (a, b) = (bvh.joint_frames(i), bvh.joint_frames(i + 1));
        a.iter().zip(&b).map(|(a, b)| a.rotation.angle_to(&b.rotation)).fold(0.0, f64::max)
    };
    let mut steps: Vec<f64> = (1..bvh.frames.len().min(60) - 1).map(step).collect();
    steps.sort_by(f64::total_cmp);
    still && step(0) > JUMP * steps[steps.len() / 2].max(1e-3)
}
