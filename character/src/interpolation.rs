//! Poses between poses.

use nalgebra::UnitQuaternion;

use crate::{Motion, Pose};

/// The rotation at `share` (0 to 1) of the shorter way from `a` to `b`. Opposite quaternions have no shorter way: then
/// the nearer end is returned.
pub fn rotation_between(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>, share: f64) -> UnitQuaternion<f64> {
    a.try_slerp(b, share, 1e-9).unwrap_or(if share < 0.5 { *a } else { *b })
}

impl Pose {
    /// The pose at `share` (0 to 1) of the way to `other`: translation on a line, rotations by [`rotation_between`].
    pub fn interpolated(&self, other: &Self, share: f64) -> Self {
        let rotations = self.rotations.iter().zip(&other.rotations);
        Self {
            translation: self.translation.lerp(&other.translation, share),
            rotations: rotations.map(|(a, b)| rotation_between(a, b, share)).collect(),
        }
    }
}

impl Motion {
    /// The pose at `time` seconds after the first, interpolated between its neighbours and clamped to the motion's ends;
    /// `None` for a motion without poses.
    pub fn pose_at(&self, time: f64) -> Option<Pose> {
        let last = self.poses.len().checked_sub(1)?;
        let at = (time / self.frame_time).clamp(0.0, last as f64);
        let low = (at.floor() as usize).min(last);
        Some(self.poses[low].interpolated(&self.poses[(low + 1).min(last)], at - low as f64))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::Joint;

    fn bent(angle: f64) -> Pose {
        let mut pose = Pose::identity();
        *pose.rotation_mut(Joint::LeftLowerArm) = UnitQuaternion::new(Vector3::y() * angle);
        pose.translation.x = angle;
        pose
    }

    #[test]
    fn a_motion_runs_evenly_from_pose_to_pose_and_stops_at_its_ends() {
        let motion = Motion { name: "bend".into(), frame_time: 0.5, poses: vec![bent(0.0), bent(1.0), bent(2.0)] };
        for (time, angle) in [(-1.0, 0.0), (0.0, 0.0), (0.25, 0.5), (0.6, 1.2), (1.0, 2.0), (9.0, 2.0)] {
            let pose = motion.pose_at(time).unwrap();
            assert!((pose.rotation(Joint::LeftLowerArm).angle() - angle).abs() < 1e-12, "{time}");
            assert!((pose.translation.x - angle).abs() < 1e-12, "{time}");
        }
        assert_eq!(Motion { name: "empty".into(), frame_time: 0.5, poses: Vec::new() }.pose_at(0.0), None);
    }

    #[test]
    fn opposite_rotations_go_to_the_nearer_end() {
        let (a, b) = (UnitQuaternion::identity(), UnitQuaternion::new(Vector3::x() * std::f64::consts::PI));
        for share in [0.2, 0.8] {
            let between = rotation_between(&a, &b, share);
            assert!(between.angle_to(&a).is_finite(), "{between}");
        }
        let turned = rotation_between(&a, &UnitQuaternion::new(Vector3::x() * 3.0), 0.5);
        assert!((turned.angle() - 1.5).abs() < 1e-12);
    }
}
