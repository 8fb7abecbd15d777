//! The posed skeleton as contours see it: links between joints, the planes of cross-sections along them (paper 002 §2.1).

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use toile_character::{Joint, Pose, Skeleton, interpolation::rotation_between};

/// Joints of a skeleton in a pose.
#[derive(Debug, Clone)]
pub struct Bones {
    /// `posed_from_joint` of every joint.
    frames: Vec<Isometry3<f64>>,
}

/// An end of a link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A joint.
    Joint(Joint),
    /// A joint that moves with the bone before it.
    Socket(Joint),
    /// Between the hip joints; moves with the hips.
    Seat,
}

/// Links in a row, each from one place to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain(pub Vec<Place>);

/// Where the plane of a cross-section lies.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    /// O_i, on the link.
    pub origin: Point3<f64>,
    /// N_i, a unit vector along the links.
    pub normal: Vector3<f64>,
    /// How directions within the plane are turned from rest.
    pub turn: UnitQuaternion<f64>,
}

impl Bones {
    /// The joints of `skeleton` in `pose`.
    pub fn new(skeleton: &Skeleton, pose: &Pose) -> Self {
        Self { frames: pose.joint_frames(skeleton) }
    }

    /// Where a place is.
    pub fn at(&self, place: Place) -> Point3<f64> {
        let joint = |j: Joint| Point3::from(self.frames[j.index()].translation.vector);
        match place {
            Place::Joint(j) | Place::Socket(j) => joint(j),
            Place::Seat => nalgebra::center(&joint(Joint::LeftUpperLeg), &joint(Joint::RightUpperLeg)),
        }
    }

    /// How the bone that leaves a place is turned from rest.
    pub fn turn(&self, place: Place) -> UnitQuaternion<f64> {
        let joint = match place {
            Place::Joint(joint) => joint,
            Place::Socket(joint) => joint.parent().unwrap_or(joint),
            Place::Seat => Joint::Hips,
        };
        self.frames[joint.index()].rotation
    }

    /// `posed_from_joint` of a joint.
    pub fn frame(&self, joint: Joint) -> &Isometry3<f64> {
        &self.frames[joint.index()]
    }

    /// The unit direction of link `link` of a chain; upward where its ends coincide.
    pub fn direction(&self, chain: &Chain, link: usize) -> Vector3<f64> {
        let (a, b) = (self.at(chain.0[link]), self.at(chain.0[link + 1]));
        (b - a).try_normalize(1e-9).unwrap_or_else(Vector3::y)
    }

    /// The plane at the end `end` of a chain's links: the bisecting plane of the two links that meet there, and across the link
    /// at the ends of the chain. Links that run on, or straight back, have the upper link's direction as normal.
    fn end_plane(&self, chain: &Chain, end: usize) -> (Vector3<f64>, UnitQuaternion<f64>) {
        let last = chain.0.len() - 1;
        let turn = |place: usize| self.turn(chain.0[place]);
        if end == 0 {
            return (self.direction(chain, 0), turn(0));
        }
        let upper = self.direction(chain, end - 1);
        let half = rotation_between(&turn(end - 1), &turn(end), 0.5);
        if end == last {
            return (upper, half);
        }
        let bisecting = (upper + self.direction(chain, end)).try_normalize(1e-6);
        (bisecting.unwrap_or(upper), half)
    }

    /// The plane at `share` (0 to 1) of link `link`: its origin by interpolated length, its normal by interpolated direction between
    /// the planes at both ends of the link.
    pub fn plane(&self, chain: &Chain, link: usize, share: f64) -> Plane {
        let (a, b) = (self.at(chain.0[link]), self.at(chain.0[link + 1]));
        let ((normal_a, turn_a), (normal_b, turn_b)) = (self.end_plane(chain, link), self.end_plane(chain, link + 1));
        let normal = between_directions(&normal_a, &normal_b, share);
        Plane { origin: a + (b - a) * share, normal, turn: rotation_between(&turn_a, &turn_b, share) }
    }
}

/// The direction at `share` of the way from one direction to another, along the arc between them.
fn between_directions(a: &Vector3<f64>, b: &Vector3<f64>, share: f64) -> Vector3<f64> {
    match UnitQuaternion::rotation_between(a, b) {
        Some(turn) => turn.powf(share) * a,
        None => *a,
    }
}

impl Plane {
    /// The unit vector of the plane that comes nearest to `reference` (given at rest), and the one a quarter turn about the normal
    /// from it.
    pub fn axes(&self, reference: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let posed = self.turn * reference;
        let flat = posed - self.normal * self.normal.dot(&posed);
        let spare = || self.normal.cross(&Vector3::x()).try_normalize(1e-3).unwrap_or_else(Vector3::z);
        let first = flat.try_normalize(1e-6).unwrap_or_else(spare);
        (first, self.normal.cross(&first))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toile_character::BodyModel;

    fn arm() -> Chain {
        Chain([Joint::LeftUpperArm, Joint::LeftLowerArm, Joint::LeftHand].map(Place::Joint).to_vec())
    }

    #[test]
    fn the_plane_at_a_bent_elbow_bisects_it_and_those_between_are_interpolated_evenly() {
        let skeleton = BodyModel::load_default().unwrap().mean_skeleton;
        for degrees in [30.0f64, 90.0, 140.0] {
            let mut pose = Pose::identity();
            let bone = skeleton.position(Joint::LeftHand) - skeleton.position(Joint::LeftLowerArm);
            let axis = bone.cross(&Vector3::z()).normalize();
            *pose.rotation_mut(Joint::LeftLowerArm) = UnitQuaternion::from_scaled_axis(axis * degrees.to_radians());
            let bones = Bones::new(&skeleton, &pose);
            let (upper, lower) = (bones.direction(&arm(), 0), bones.direction(&arm(), 1));
            let elbow = bones.plane(&arm(), 0, 1.0);
            assert!((elbow.normal.angle(&upper) - elbow.normal.angle(&lower)).abs() < 1e-9);
            assert!((elbow.normal - bones.plane(&arm(), 1, 0.0).normal).norm() < 1e-9);
            assert!((bones.plane(&arm(), 0, 0.0).normal - upper).norm() < 1e-9, "an end link has its own direction");
            let quarter = bones.plane(&arm(), 0, 0.25);
            assert!((quarter.normal.angle(&upper) - 0.25 * elbow.normal.angle(&upper)).abs() < 1e-9);
            let length = (bones.at(arm().0[1]) - bones.at(arm().0[0])).norm();
            assert!(((quarter.origin - bones.at(arm().0[0])).norm() - 0.25 * length).abs() < 1e-12);
        }
    }

    #[test]
    fn parallel_links_have_the_upper_links_normal() {
        let mut skeleton = BodyModel::load_default().unwrap().mean_skeleton;
        let [a, b] = [Joint::LeftUpperArm, Joint::LeftLowerArm].map(|j| skeleton.position(j));
        for toward in [1.0, -1.0] {
            skeleton.rest[Joint::LeftHand.index()] = b + (b - a) * toward;
            let bones = Bones::new(&skeleton, &Pose::identity());
            let normal = bones.plane(&arm(), 0, 1.0).normal;
            assert!((normal - (b - a).normalize()).norm() < 1e-9, "{toward}");
        }
    }

    #[test]
    fn axes_of_a_plane_are_at_right_angles() {
        let plane = Plane { origin: Point3::origin(), normal: Vector3::y(), turn: UnitQuaternion::identity() };
        for reference in [Vector3::x(), Vector3::y(), Vector3::new(1.0, 5.0, 0.2)] {
            let (a, b) = plane.axes(&reference);
            assert!(a.dot(&plane.normal).abs() < 1e-12 && a.dot(&b).abs() < 1e-12);
            assert!((a.norm() - 1.0).abs() < 1e-12 && (b.norm() - 1.0).abs() < 1e-12);
        }
    }
}
