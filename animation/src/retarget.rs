//! A motion file carried onto the skeleton of one person.
//!
//! Limbs of the result point where the source's limbs point, in every frame and exactly unless a foot has to be lifted
//! out of the floor; twist comes from the source's joints; trunk and head turn as the source's do. The hips go the
//! source's way scaled by leg length, so that feet land instead of sliding, and the whole is set on the floor facing +Z.

mod calibration_pose;
mod constants;
mod endless;
mod flat_foot;
mod ground;
mod looping;
mod moments;
mod placement;
mod reference;
mod resample;
mod turns;

use serde::{Deserialize, Serialize};
use toile_character::{Joint, Motion, Pose, Skeleton, feet::lift_out_of_floor};

pub use endless::turn_of_loop;
pub use looping::close_loop;
pub use resample::resample;

use crate::{
    AnimationError, Bvh,
    blend::Room,
    bvh::FRAME_TIMES,
    skeleton::{Source, recognise},
};
use calibration_pose::starts_with_calibration;
use constants::Constants;
use reference::find_reference;

/// How a motion is carried over.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RetargetSettings {
    /// Maximum poses a second of the result; faster motions are resampled, slower ones kept. 1 to 1000 Hz, default 30.
    pub max_rate: f64,
    /// Turn the motion so that the person faces +Z in its first frame. Default true.
    pub face_front: bool,
    /// Stay in place: the travel over the ground is left out. Default false.
    pub in_place: bool,
    /// Cut and blend the motion so that its end leads into its start, in place. Default false.
    pub looped: bool,
    /// Turn finger joints where the source has them. Default true.
    pub fingers: bool,
    /// Lift feet that would dip below the floor, by bending the knee. Default true.
    pub lift_feet: bool,
    /// Hold arms as far from the body as the clothes between them need. Default true.
    pub room_for_clothes: bool,
}

impl Default for RetargetSettings {
    fn default() -> Self {
        Self {
            max_rate: 30.0,
            face_front: true,
            in_place: false,
            looped: false,
            fingers: true,
            lift_feet: true,
            room_for_clothes: true,
        }
    }
}

/// A motion on the target's skeleton and the decisions made on the way.
#[derive(Debug, Clone)]
pub struct Retargeted {
    /// The motion, poses relative to the target's rest.
    pub motion: Motion,
    /// Findings and decisions.
    pub report: RetargetReport,
}

/// Findings and decisions of a retargeting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    /// How far arms are held from the body to make room for clothes, where that was done.
    #[serde(default)]
    pub room: Room,
    /// Problems of the motion file that could be put right, a sentence each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
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
    let constants = find_reference(bvh, &source, target);
    let first = usize::from(starts_with_calibration(bvh));
    let metres_per_unit = placement::scale(bvh, &source, target)?;
    let mut poses = carried(bvh, &source, &constants, target, first, metres_per_unit, settings);
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
        up: constants.up.into(),
        zero_pose_used: constants.from_rest,
        first_frame_dropped: first == 1,
        joints: source.named(bvh),
        poses: motion.poses.len(),
        foot_below_floor: ground::depth_below_floor(target, &motion.poses),
        room: Room::default(),
        warnings: bvh.warnings.clone(),
    };
    Ok(Retargeted { motion, report })
}

/// The poses of all frames from `first` on, hips not yet on the floor.
fn carried(
    bvh: &Bvh,
    source: &Source,
    constants: &Constants,
    target: &Skeleton,
    first: usize,
    metres_per_unit: f64,
    settings: &RetargetSettings,
) -> Vec<Pose> {
    let subject_from_source = placement::subject_from_source(bvh, source, constants, first, settings.face_front);
    let pose = |frame: usize| {
        let world = bvh.joint_frames(frame);
        let rotations = turns::world_rotations(bvh, source, constants, &world, target, settings.fingers);
        let rotations: Vec<_> = rotations.iter().map(|r| subject_from_source * r).collect();
        let legs = subject_from_source * placement::mid_legs(source, &world).coords * metres_per_unit;
        placement::pose_of(target, &rotations, &legs)
    };
    (first..bvh.frames.len()).map(pose).collect()
}

fn check(bvh: &Bvh, target: &Skeleton, settings: &RetargetSettings) -> Result<(), AnimationError> {
    if !(1.0..=1000.0).contains(&settings.max_rate) {
        let (name, range) = ("max_rate", "1 to 1000 poses a second");
        return Err(AnimationError::Setting { name, value: settings.max_rate, range });
    }
    if bvh.frames.is_empty() || !FRAME_TIMES.contains(&bvh.frame_time) {
        let reason = format!("it has no frame, or a frame time of {:e} s out of range", bvh.frame_time);
        return Err(AnimationError::Motion(reason));
    }
    if target.rest.iter().any(|p| !p.coords.iter().all(|c| c.is_finite())) {
        return Err(AnimationError::Motion("the target skeleton has a joint whose position is not finite".into()));
    }
    Ok(())
}
