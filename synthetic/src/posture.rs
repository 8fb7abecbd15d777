//! How a person stands on the disk in each take.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use toile_character::{Joint, Pose, Region, joint::JOINTS};

use crate::{person::Person, random::Random, settings::SyntheticSettings};

/// Largest step on the disk between takes, metres along x and z.
const STEP_M: f64 = 0.012;
/// Largest turn on the disk between takes, degrees.
const STEP_DEGREES: f64 = 3.0;
/// Fingers move by this share of the joints' random turns.
const FINGER_SHARE: f64 = 0.5;

/// The pose of take `take`: about the A-pose with relaxed elbows and knees, soles on the disk (y = 0), feet level.
///
/// The habit of the person is the same in all takes; each joint then differs by up to the settings' jitter, and after
/// take 0 the person has stepped off the disk and on again.
pub fn pose_of_take(person: &Person, settings: &SyntheticSettings, take: usize) -> Pose {
    let mut pose = Pose::identity();
    let mut habit = Random::new(settings.seed, "habit");
    relax_arms(&mut pose, &mut habit);
    turn_all(&mut pose, &mut habit, 1.2);
    let mut jitter = Random::new(settings.seed, &format!("take {take} pose"));
    turn_all(&mut pose, &mut jitter, settings.joint_jitter_degrees);
    let feet = [jitter.range(-3.0, 5.0), jitter.range(-3.0, 5.0)];
    stand(&mut pose, person, feet.map(f64::to_radians));
    let step = if take == 0 { Isometry3::identity() } else { re_step(&mut jitter) };
    pose.moved(&step, &person.body.skeleton)
}

fn turn(degrees: f64, axis: Vector3<f64>) -> UnitQuaternion<f64> {
    axis.try_normalize(1e-9)
        .map_or_else(UnitQuaternion::identity, |a| UnitQuaternion::from_scaled_axis(a * degrees.to_radians()))
}

/// Elbows bent a little to the front, as arms hang.
fn relax_arms(pose: &mut Pose, random: &mut Random) {
    for (side, upper, lower) in
        [(1.0, Joint::LeftUpperArm, Joint::LeftLowerArm), (-1.0, Joint::RightUpperArm, Joint::RightLowerArm)]
    {
        let along = Vector3::new(side, -1.0, 0.0);
        *pose.rotation_mut(lower) = turn(random.range(7.0, 13.0), along.cross(&Vector3::z()));
        *pose.rotation_mut(upper) = turn(random.range(-3.0, 3.0), Vector3::z());
    }
}

fn turn_all(pose: &mut Pose, random: &mut Random, degrees: f64) {
    for joint in JOINTS {
        let axis = Vector3::new(random.normal(2.0), random.normal(2.0), random.normal(2.0));
        let share = if joint.is_finger() { FINGER_SHARE } else { 1.0 };
        let angle = random.range(0.0, degrees) * share;
        *pose.rotation_mut(joint) = turn(angle, axis) * pose.rotation(joint);
    }
}

/// Bends the knee of the longer leg until both soles are level, then stands the body on y = 0. Feet are level, turned by
/// `yaw` outwards.
fn stand(pose: &mut Pose, person: &Person, yaw: [f64; 2]) {
    const FIRST_BEND: f64 = 0.03;
    let legs = [
        [Joint::LeftUpperLeg, Joint::LeftLowerLeg, Joint::LeftFoot],
        [Joint::RightUpperLeg, Joint::RightLowerLeg, Joint::RightFoot],
    ];
    let straight = legs.map(|[hip, knee, _]| [pose.rotation(hip), pose.rotation(knee)]);
    let mut bend = [FIRST_BEND; 2];
    for _ in 0..6 {
        for side in 0..2 {
            let [hip, knee, foot] = legs[side];
            *pose.rotation_mut(hip) = UnitQuaternion::from_scaled_axis(Vector3::x() * -bend[side]) * straight[side][0];
            *pose.rotation_mut(knee) =
                UnitQuaternion::from_scaled_axis(Vector3::x() * (2.0 * bend[side])) * straight[side][1];
            let out = if side == 0 { yaw[0] } else { -yaw[1] };
            level_foot(pose, person, foot, out);
        }
        let soles = [Region::LeftFoot, Region::RightFoot].map(|foot| lowest(pose, person, foot));
        let (longer, by) = if soles[0] < soles[1] { (0, soles[1] - soles[0]) } else { (1, soles[0] - soles[1]) };
        let length = leg_length(person);
        bend[longer] = (bend[longer].cos() - by / length).clamp(0.5, 1.0).acos();
    }
    pose.translation.y -= lowest(pose, person, Region::LeftFoot).min(lowest(pose, person, Region::RightFoot));
}

fn leg_length(person: &Person) -> f64 {
    let at = |j: Joint| person.body.skeleton.position(j);
    (at(Joint::LeftUpperLeg) - at(Joint::LeftFoot)).norm().max(0.1)
}

fn level_foot(pose: &mut Pose, person: &Person, foot: Joint, yaw: f64) {
    let frames = pose.joint_frames(&person.body.skeleton);
    if let Some(parent) = foot.parent() {
        let level = UnitQuaternion::from_scaled_axis(Vector3::y() * yaw);
        *pose.rotation_mut(foot) = frames[parent.index()].rotation.inverse() * level;
    }
}

/// Height of the lowest vertex of a foot.
fn lowest(pose: &Pose, person: &Person, foot: Region) -> f64 {
    let posed = person.body.posed(pose);
    let of_foot = posed.iter().zip(&person.regions).filter(|(_, r)| **r == foot);
    f64::from(of_foot.map(|(p, _)| p.y).fold(f32::INFINITY, f32::min))
}

fn re_step(random: &mut Random) -> Isometry3<f64> {
    let step = Vector3::new(random.range(-STEP_M, STEP_M), 0.0, random.range(-STEP_M, STEP_M));
    let yaw = random.range(-STEP_DEGREES, STEP_DEGREES).to_radians();
    Isometry3::from_parts(Translation3::from(step), UnitQuaternion::from_scaled_axis(Vector3::y() * yaw))
}
