//! The soles of a body's own surface, kept out of the floor.
//!
//! Joints know where ankle and ball are, not how thick the skin under them is: a heel that rolls, or toes that bend, dip
//! below the floor by a centimetre although the joints are above it. Here the body's own vertices say how deep a foot is.

use std::{collections::BTreeSet, f32::consts::TAU};

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use crate::{
    Joint, Pose, SkinnedMesh,
    feet::{Leg, raise_ankle},
};

/// Farthest that a foot tilts on the floor, radians.
const TILT: f32 = 1.3;
/// Directions that are tried: rings of tilts, and headings on each ring.
const RINGS: u32 = 5;
const AROUND: u32 = 16;
/// Farthest that toes are bent up, radians.
const BEND: f64 = 1.0;
/// Halvings of the angle by which toes are bent: a thousandth of a radian.
const HALVINGS: usize = 10;
/// Feet are lifted until no more than this is below the floor, metres, or as often as [`ROUNDS`].
const LEFT_OVER: f64 = 1e-4;
const ROUNDS: usize = 3;

/// The soles of one body.
pub struct Soles<'a> {
    body: &'a SkinnedMesh,
    feet: [Foot; 2],
}

/// Vertices of one foot that may touch the floor.
struct Foot {
    leg: Leg,
    /// Carried by the foot.
    sole: Vec<usize>,
    /// Carried by the toes.
    toes: Vec<usize>,
}

impl<'a> Soles<'a> {
    /// The soles of a body at rest, which stands on y = 0.
    pub fn new(body: &'a SkinnedMesh) -> Self {
        let feet = [Leg::LEFT, Leg::RIGHT].map(|leg| Foot {
            leg,
            sole: lowest_vertices(body, leg.foot),
            toes: lowest_vertices(body, leg.toes),
        });
        Self { body, feet }
    }

    /// Height of the lowest point of both soles above the floor, metres; negative below it.
    pub fn height(&self, pose: &Pose) -> f64 {
        let transforms = pose.skinning_transforms(&self.body.skeleton);
        let all = self.feet.iter().flat_map(|f| [&f.sole, &f.toes]);
        all.map(|vertices| self.lowest(vertices, &transforms)).fold(f64::INFINITY, f64::min)
    }

    /// Lifts every foot that is below the floor: the knee bends until the sole is out, toes that would still be in the floor
    /// bend up. Feet above the floor and the rest of the pose are left alone.
    pub fn lift(&self, poses: &mut [Pose]) {
        for pose in poses {
            for foot in &self.feet {
                self.lift_foot(foot, pose);
            }
        }
    }

    fn lift_foot(&self, foot: &Foot, pose: &mut Pose) {
        let height =
            |vertices: &[usize], pose: &Pose| self.lowest(vertices, &pose.skinning_transforms(&self.body.skeleton));
        for round in 0..ROUNDS {
            // toes that bend take the ball's skin with them, so that the sole is looked at again
            let depth = match round {
                0 => -height(&foot.sole, pose),
                _ => -height(&foot.sole, pose).min(height(&foot.toes, pose)),
            };
            if depth > 0.0 {
                raise_ankle(&self.body.skeleton, pose, foot.leg, depth);
            }
            if height(&foot.toes, pose) < 0.0 && round == 0 {
                self.bend_toes(foot, pose, |pose| height(&foot.toes, pose));
            }
            if height(&foot.sole, pose).min(height(&foot.toes, pose)) > -LEFT_OVER {
                break;
            }
        }
    }

    /// Bends the toes up by the smallest angle that takes them out of the floor.
    fn bend_toes(&self, foot: &Foot, pose: &mut Pose, height: impl Fn(&Pose) -> f64) {
        let skeleton = &self.body.skeleton;
        let along = skeleton.position(foot.leg.toes) - skeleton.position(foot.leg.foot);
        let Some(axis) = Unit::try_new(along.cross(&Vector3::y()), 1e-9) else { return };
        let bent = |pose: &Pose, angle: f64| {
            let mut bent = pose.clone();
            *bent.rotation_mut(foot.leg.toes) *= UnitQuaternion::from_axis_angle(&axis, angle);
            bent
        };
        let (mut low, mut high) = (0.0, BEND);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if height(&bent(pose, middle)) < 0.0 { low = middle } else { high = middle }
        }
        *pose = bent(pose, high);
    }

    fn lowest(&self, vertices: &[usize], posed_from_rest: &[Isometry3<f64>]) -> f64 {
        let height = |&v: &usize| {
            let rest: Point3<f64> = self.body.mesh.positions[v].cast();
            let of = |(joint, weight): (u8, f32)| f64::from(weight) * (posed_from_rest[usize::from(joint)] * rest).y;
            self.body.weights.of(v).map(of).sum::<f64>()
        };
        vertices.iter().map(height).fold(f64::INFINITY, f64::min)
    }
}

/// The vertices that `joint` carries and that come to lie lowest when the foot tilts any way, up to [`TILT`].
fn lowest_vertices(body: &SkinnedMesh, joint: Joint) -> Vec<usize> {
    let is_carried = |v: &usize| usize::from(body.weights.joints[*v][0]) == joint.index();
    let carried: Vec<usize> = (0..body.mesh.positions.len()).filter(is_carried).collect();
    let rings = (1..=RINGS).flat_map(|ring| (0..AROUND).map(move |k| (ring, k)));
    let down = rings.map(|(ring, k)| {
        let (tilt, heading) = (TILT * ring as f32 / RINGS as f32, TAU * k as f32 / AROUND as f32);
        Vector3::new(tilt.sin() * heading.cos(), -tilt.cos(), tilt.sin() * heading.sin())
    });
    let along = |v: usize, down: &Vector3<f32>| body.mesh.positions[v].coords.dot(down);
    let lowest = std::iter::once(-Vector3::y())
        .chain(down)
        .filter_map(|down| carried.iter().copied().max_by(|&a, &b| along(a, &down).total_cmp(&along(b, &down))));
    lowest.collect::<BTreeSet<usize>>().into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BodyModel;

    #[test]
    fn rolled_and_sunken_feet_come_out_of_the_floor_and_others_stay() {
        let body = BodyModel::load_default().unwrap().skinned(&[]);
        let soles = Soles::new(&body);
        assert!(soles.height(&Pose::identity()).abs() < 0.002, "a body at rest stands on the floor");
        for (pitch, toes, sunk) in [(0.5, 0.0, 0.02), (-0.4, 0.0, 0.03), (0.2, 0.6, 0.0), (0.0, 0.0, 0.015)] {
            let mut pose = Pose::identity();
            pose.translation.y = -sunk;
            *pose.rotation_mut(Joint::LeftFoot) = UnitQuaternion::from_euler_angles(pitch, 0.0, 0.0);
            *pose.rotation_mut(Joint::LeftToes) = UnitQuaternion::from_euler_angles(toes, 0.0, 0.0);
            let mut poses = [pose.clone()];
            assert!(soles.height(&pose) < -0.01);
            soles.lift(&mut poses);
            let height = soles.height(&poses[0]);
            assert!(height > -0.001, "{height} m after pitch {pitch}, toes {toes}, {sunk} m sunk");
            assert_eq!(poses[0].rotation(Joint::LeftUpperArm), pose.rotation(Joint::LeftUpperArm));
        }
        let mut above = Pose::identity();
        above.translation.y = 0.1;
        let mut poses = [above.clone()];
        soles.lift(&mut poses);
        assert_eq!(poses[0], above);
    }
}
