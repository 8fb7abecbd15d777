//! Whether a motion goes round.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use toile_character::{Joint, Motion, Skeleton};

/// Joint angles in which the ends of a motion that goes round may differ, radians: a degree.
const SAME: f64 = 0.02;
/// Heights of the hips in which they may differ, metres.
const SAME_HEIGHT: f64 = 0.01;

/// `last_from_first` of a motion whose last pose is its first again, but for where on the floor the person is and which way they
/// face: a walk of whole steps. `None` for a motion that ends otherwise, or that stands still.
pub fn turn_of_loop(motion: &Motion, skeleton: &Skeleton) -> Option<Isometry3<f64>> {
    let [first, .., last] = &motion.poses[..] else { return None };
    let same = |(a, b): (&UnitQuaternion<f64>, &UnitQuaternion<f64>)| a.angle_to(b) < SAME;
    if !first.rotations.iter().zip(&last.rotations).skip(1).all(same) {
        return None;
    }
    let turn = last.rotation(Joint::Hips) * first.rotation(Joint::Hips).inverse();
    let front = turn * Vector3::z();
    let heading = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), front.x.atan2(front.z));
    let up = last.translation.y - first.translation.y;
    if heading.angle_to(&turn) > SAME || up.abs() > SAME_HEIGHT {
        return None;
    }
    let moves = motion.poses.iter().any(|p| !p.rotations.iter().zip(&first.rotations).all(same));
    let hips = skeleton.position(Joint::Hips).coords;
    let way = hips + last.translation - heading * (hips + first.translation);
    moves.then(|| Isometry3::from_parts(Translation3::new(way.x, 0.0, way.z), heading))
}

#[cfg(test)]
mod tests {
    use toile_character::{BodyModel, Pose};

    use super::*;

    #[test]
    fn a_round_is_found_wherever_it_ends_and_nothing_else_is() {
        let skeleton = BodyModel::load_default().unwrap().mean_skeleton;
        let around = Isometry3::new(Vector3::new(0.4, 0.0, 1.2), Vector3::new(0.0, 0.7, 0.0));
        let mut poses = vec![Pose::identity(); 9];
        for (k, pose) in poses.iter_mut().enumerate() {
            let angle = 0.3 * (std::f64::consts::TAU * k as f64 / 8.0).sin();
            *pose.rotation_mut(Joint::LeftUpperLeg) = UnitQuaternion::from_euler_angles(angle, 0.0, 0.0);
        }
        let last = poses[8].moved(&around, &skeleton);
        let motion = |poses: &[Pose]| Motion { name: "m".into(), frame_time: 0.1, poses: poses.to_vec() };
        let found = turn_of_loop(&motion(&[&poses[..8], &[last]].concat()), &skeleton).unwrap();
        assert!((found.to_homogeneous() - around.to_homogeneous()).norm() < 1e-9, "{found}");
        assert_eq!(turn_of_loop(&motion(&poses[..7]), &skeleton), None, "it ends amid a step");
        assert_eq!(turn_of_loop(&motion(&vec![Pose::identity(); 5]), &skeleton), None, "it stands still");
        assert_eq!(turn_of_loop(&motion(&poses[..1]), &skeleton), None, "a single pose");
    }
}
