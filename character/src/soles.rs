//! The soles of a person: the points of both feet that may touch the floor.
//!
//! Joints know where ankle and ball are, not how thick the skin under them is: a heel that rolls, or toes that bend, dip
//! below the floor by a centimetre although the joints are above it. Where there is a body its own vertices say how deep a
//! foot is; a bare skeleton has a heel, a ball and a tip of the toes on the floor that it stands on at rest.

use std::{collections::BTreeSet, f32::consts::TAU};

use nalgebra::{Isometry3, Point3, Translation3, Vector3};

use crate::{Joint, Pose, Skeleton, SkinnedMesh, feet::Leg};

/// Farthest that a foot tilts on the floor, radians.
const TILT: f32 = 1.3;
/// Directions that are tried: rings of tilts, and headings on each ring.
const RINGS: u32 = 5;
const AROUND: u32 = 16;
/// Farthest that toes are bent up, radians.
const BEND: f64 = 1.0;
/// A bend must take toes higher by this much, metres a radian: a third of what it takes their tips.
const WORTH: f64 = 0.02;
/// Times that the range of the angle loses a third: down to a thousandth of a radian.
const NARROWINGS: usize = 18;
/// Length of a bare skeleton's toes by that of the foot from ankle to ball.
const TOES_BY_FOOT: f64 = 0.5;
/// Its heel behind the ankle by the same length.
const HEEL_BY_FOOT: f64 = 0.35;

/// The soles of one person.
#[derive(Debug, Clone)]
pub struct Soles {
    skeleton: Skeleton,
    /// Left and right.
    feet: [Sole; 2],
}

/// The points of one foot that may touch the floor.
#[derive(Debug, Clone)]
pub struct Sole {
    /// The leg that it is of.
    pub leg: Leg,
    /// Carried by the foot.
    foot: Vec<SolePoint>,
    /// Carried by the toes.
    toes: Vec<SolePoint>,
}

#[derive(Debug, Clone)]
struct SolePoint {
    rest: Point3<f64>,
    weights: Vec<(usize, f64)>,
}

impl Soles {
    /// The soles of a body at rest, which stands on y = 0.
    pub fn of_body(body: &SkinnedMesh) -> Self {
        let feet = [Leg::LEFT, Leg::RIGHT].map(|leg| Sole {
            leg,
            foot: lowest_vertices(body, leg.foot),
            toes: lowest_vertices(body, leg.toes),
        });
        Self { skeleton: body.skeleton.clone(), feet }
    }

    /// The soles of a skeleton that stands on y = 0 at rest.
    pub fn of_skeleton(skeleton: &Skeleton) -> Self {
        let feet = [Leg::LEFT, Leg::RIGHT].map(|leg| {
            let (ankle, ball) = (skeleton.position(leg.foot), skeleton.position(leg.toes));
            let bone = ball - ankle;
            let on_floor = |p: Point3<f64>, joint: Joint| SolePoint {
                rest: Point3::new(p.x, 0.0, p.z),
                weights: vec![(joint.index(), 1.0)],
            };
            Sole {
                leg,
                foot: vec![on_floor(ankle - bone * HEEL_BY_FOOT, leg.foot), on_floor(ball, leg.foot)],
                toes: vec![on_floor(ball + bone * TOES_BY_FOOT, leg.toes)],
            }
        });
        Self { skeleton: skeleton.clone(), feet }
    }

    /// The skeleton that they are on.
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// The left and the right one.
    pub fn feet(&self) -> &[Sole; 2] {
        &self.feet
    }

    /// Height of the lowest point of both soles above the floor, metres; negative below it.
    pub fn height(&self, pose: &Pose) -> f64 {
        self.feet.iter().map(|sole| self.height_of(sole, pose)).fold(f64::INFINITY, f64::min)
    }

    /// Height of the lowest point of `sole` with its toes, metres.
    pub fn height_of(&self, sole: &Sole, pose: &Pose) -> f64 {
        lowest(&self.points(sole, pose))
    }

    /// Height of the lowest point of `sole` that the foot carries, metres.
    pub fn height_without_toes(&self, sole: &Sole, pose: &Pose) -> f64 {
        lowest(&placed(&sole.foot, &pose.skinning_transforms(&self.skeleton)))
    }

    /// Bends the toes of `sole` up so far that it rolls over its ball, as the floor would bend them. Gives the height of its
    /// lowest point then, metres: that of toes which would have to bend further than toes can.
    pub fn roll(&self, sole: &Sole, pose: &mut Pose) -> f64 {
        let height = self.height_without_toes(sole, pose);
        self.bend_toes(sole, pose, height);
        self.height_of(sole, pose)
    }

    /// The points of `sole` in `pose`, always in the same order.
    pub fn points(&self, sole: &Sole, pose: &Pose) -> Vec<Point3<f64>> {
        let transforms = pose.skinning_transforms(&self.skeleton);
        let mut points = placed(&sole.foot, &transforms);
        points.extend(placed(&sole.toes, &transforms));
        points
    }

    /// Bends the toes of `sole` up by the smallest angle that takes them to `height`, metres, at most a radian; less where bending
    /// hardly takes them higher, because the skin behind the ball goes down when the tips go up.
    pub fn bend_toes(&self, sole: &Sole, pose: &mut Pose, height: f64) {
        let toes = sole.leg.toes;
        let mut transforms = pose.skinning_transforms(&self.skeleton);
        let straight = pose.joint_frames(&self.skeleton)[toes.index()];
        let to_rest = Translation3::from(-self.skeleton.position(toes).coords);
        let mut height_at = |angle: f64| {
            transforms[toes.index()] = straight * sole.leg.toe_turn(&self.skeleton, angle) * to_rest;
            lowest(&placed(&sole.toes, &transforms))
        };
        if height_at(0.0) >= height {
            return;
        }
        // the height that counts, less what a bend must gain, rises and then falls: its top does not jump
        let mut gain = |angle: f64| height_at(angle).min(height) - WORTH * angle;
        let (mut low, mut high) = (0.0, BEND);
        for _ in 0..NARROWINGS {
            let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if gain(a) < gain(b) { low = a } else { high = b }
        }
        *pose.rotation_mut(toes) *= sole.leg.toe_turn(&self.skeleton, 0.5 * (low + high));
    }
}

fn lowest(points: &[Point3<f64>]) -> f64 {
    points.iter().map(|p| p.y).fold(f64::INFINITY, f64::min)
}

fn placed(points: &[SolePoint], posed_from_rest: &[Isometry3<f64>]) -> Vec<Point3<f64>> {
    let place = |p: &SolePoint| {
        let of = |&(joint, weight): &(usize, f64)| (posed_from_rest[joint] * p.rest).coords * weight;
        Point3::from(p.weights.iter().map(of).sum::<Vector3<f64>>())
    };
    points.iter().map(place).collect()
}

/// The vertices that `joint` carries and that come to lie lowest when the foot tilts any way, up to [`TILT`].
fn lowest_vertices(body: &SkinnedMesh, joint: Joint) -> Vec<SolePoint> {
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
    let vertices: BTreeSet<usize> = lowest.collect();
    let point = |v: usize| SolePoint {
        rest: body.mesh.positions[v].cast(),
        weights: body.weights.of(v).map(|(j, w)| (usize::from(j), f64::from(w))).collect(),
    };
    vertices.into_iter().map(point).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::BodyModel;

    #[test]
    fn a_body_at_rest_stands_on_its_soles_and_a_skeleton_too() {
        let model = BodyModel::load_default().unwrap();
        let body = model.skinned(&[]);
        for soles in [Soles::of_body(&body), Soles::of_skeleton(&body.skeleton)] {
            assert!(soles.height(&Pose::identity()).abs() < 0.002);
            let mut sunken = Pose::identity();
            sunken.translation.y = -0.04;
            assert!((soles.height(&sunken) + 0.04).abs() < 0.002);
        }
    }

    #[test]
    fn toes_bend_until_the_foot_rolls_over_its_ball_and_never_jump() {
        let body = BodyModel::load_default().unwrap().skinned(&[]);
        let soles = Soles::of_body(&body);
        let sole = &soles.feet()[0];
        let mut last: Option<f64> = None;
        for step in 0..=90 {
            let pitch = -0.3 + 0.01 * f64::from(step);
            let mut pose = Pose::identity();
            *pose.rotation_mut(Joint::LeftFoot) = UnitQuaternion::from_euler_angles(pitch, 0.0, 0.0);
            let height = soles.roll(sole, &mut pose);
            assert!(soles.height_without_toes(sole, &pose) - height < 0.002, "toes below the ball at {pitch}");
            let bend = pose.rotation(Joint::LeftToes).angle();
            assert!(last.is_none_or(|last| (bend - last).abs() < 0.06), "{last:?} to {bend} at {pitch}");
            last = Some(bend);
        }
        assert!(last.is_some_and(|bend| (0.3..1.0).contains(&bend)), "{last:?}");
    }
}
