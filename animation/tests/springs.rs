//! Spring bones of the mean person in a tube of cloth, at rest and in a stride.
#![allow(clippy::unwrap_used)] // all of it is test code

use std::f32::consts::TAU;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use toile_animation::springs::{RestedLayer, Swing, spring_bones};
use toile_character::{BodyModel, JOINT_COUNT, Joint, Pose, Skeleton, SkinWeights, SpringBones, skinning::skin};
use toile_geometry::Mesh;

/// The mean person in the T-pose, with a tube around hips and legs.
struct Worn {
    body: Mesh,
    skin: SkinWeights,
    tube: Mesh,
    weights: SkinWeights,
    skeleton: Skeleton,
    rest: Pose,
}

const AROUND: u32 = 90;

impl Worn {
    /// A tube from above the hips down to the height `low`, its radius growing by `flare` a metre.
    fn new(low: f32, flare: f32) -> Self {
        let model = BodyModel::load_default().unwrap();
        let body = model.skinned(&[]);
        let rest = model.t_pose(&[]);
        let joints = rest.joint_positions(&body.skeleton);
        let hips = joints[Joint::LeftUpperLeg.index()].cast::<f32>();
        let rows = 40;
        let at = |v: u32| {
            let angle = TAU * (v % AROUND) as f32 / AROUND as f32;
            let y = hips.y + 0.1 + (low - hips.y - 0.1) * (v / AROUND) as f32 / (rows - 1) as f32;
            let radius = 0.19 + flare * (hips.y - y).max(0.0);
            Point3::new(radius * angle.sin(), y, joints[0].z as f32 + radius * angle.cos())
        };
        let cell = |q: u32| (q, q / AROUND * AROUND + (q + 1) % AROUND);
        let cut = |(a, b): (u32, u32)| [[a, a + AROUND, b], [b, a + AROUND, b + AROUND]];
        let triangles = (0..AROUND * (rows - 1)).map(cell).flat_map(cut).collect();
        let tube = Mesh::new((0..AROUND * rows).map(at).collect(), triangles);
        let mut weights = SkinWeights::default();
        for p in &tube.positions {
            let legs = ((hips.y - p.y) / 0.1).clamp(0.0, 1.0);
            let left = (0.5 + p.x / 0.3).clamp(0.0, 1.0);
            let of = |joint: Joint, weight: f32| (joint.index() as u8, weight);
            weights.push(&[
                of(Joint::Hips, 1.0 - legs),
                of(Joint::LeftUpperLeg, legs * left),
                of(Joint::RightUpperLeg, legs * (1.0 - left)),
            ]);
        }
        let (body_mesh, skeleton) = (body.posed_mesh(&rest), body.skeleton);
        Self { body: body_mesh, skin: body.weights, tube, weights, skeleton, rest }
    }

    fn springs(&self, may_hang: bool) -> Option<SpringBones> {
        let layers = [
            RestedLayer { mesh: &self.body, weights: &self.skin, may_hang: false },
            RestedLayer { mesh: &self.tube, weights: &self.weights, may_hang },
        ];
        spring_bones(&self.rest.joint_positions(&self.skeleton), &layers)
    }
}

#[test]
fn only_what_hangs_around_both_legs_gets_chains() {
    assert!(Worn::new(0.5, 0.2).springs(true).is_some());
    assert!(Worn::new(0.5, 0.2).springs(false).is_none(), "trousers hang on each leg");
    assert!(Worn::new(0.85, 0.2).springs(true).is_none(), "the hem of a jumper");
}

#[test]
fn joints_lie_on_the_cloth_and_clear_of_the_capsules() {
    for flare in [0.0, 0.3] {
        let springs = Worn::new(0.5, flare).springs(true).unwrap();
        assert_eq!(springs.chains.len(), 12);
        let heights = |k: usize| springs.chains[k].joints.iter().map(|j| j.place.y).collect::<Vec<_>>();
        assert!((heights(0).last().unwrap() - 0.5).abs() < 1e-3 && (1..12).all(|k| heights(k) == heights(0)));
        for joint in springs.chains.iter().flat_map(|c| &c.joints[1..]) {
            let clear = springs.colliders.iter().map(|c| c.distance(&joint.place)).fold(f64::MAX, f64::min);
            assert!(clear >= joint.hit_radius - 1e-6, "{joint:?} is {clear} m from a capsule");
            let radius = joint.place.x.hypot(joint.place.z);
            assert!((0.15..0.36).contains(&radius), "{joint:?}");
        }
    }
}

#[test]
fn capsules_fill_the_thighs() {
    let worn = Worn::new(0.4, 0.2);
    let springs = worn.springs(true).unwrap();
    for side in [Joint::LeftUpperLeg, Joint::RightUpperLeg] {
        let capsules: Vec<_> = springs.colliders.iter().filter(|c| c.joint == side).collect();
        assert_eq!(capsules.len(), 3);
        let knee = worn.rest.joint_positions(&worn.skeleton)[side.index() + 1].y + 0.05;
        let joint = side.index() as u8;
        let skin = (0..worn.skin.len())
            .filter(|&v| worn.skin.joints[v][0] == joint)
            .map(|v| worn.body.positions[v].cast::<f64>())
            .filter(|p| p.y > knee && p.y < knee + 0.2);
        let off: Vec<f64> = skin.map(|p| capsules.iter().map(|c| c.distance(&p)).fold(f64::MAX, f64::min)).collect();
        // A capsule has one radius where a thigh tapers: its skin lies inside.
        let mean = off.iter().map(|d| d.abs()).sum::<f64>() / off.len() as f64;
        let out = off.iter().copied().fold(f64::MIN, f64::max);
        assert!(off.len() > 100 && mean < 0.02 && out < 0.005, "{mean} m on average, {out} m outside");
    }
}

#[test]
fn weights_are_few_and_change_gently() {
    let worn = Worn::new(0.5, 0.2);
    let springs = worn.springs(true).unwrap();
    let bound = springs.weights[1].as_ref().unwrap();
    assert!(springs.weights[0].is_none());
    let dense = |v: u32| {
        let mut row = vec![0.0f32; JOINT_COUNT + springs.joint_count()];
        bound.of(v as usize).for_each(|(j, w)| row[usize::from(j)] += w);
        row
    };
    let hips = worn.rest.joint_positions(&worn.skeleton)[Joint::LeftUpperLeg.index()].y as f32;
    let mut own = 0.0f32;
    for (v, p) in worn.tube.positions.iter().enumerate() {
        let row = dense(v as u32);
        assert!((row.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        let on_chains: f32 = row[JOINT_COUNT..].iter().sum();
        assert!(p.y < hips || (on_chains == 0.0 && bound.weights[v] == worn.weights.weights[v]));
        own = own.max(on_chains);
        let beside = (v as u32) / AROUND * AROUND + (v as u32 + 1) % AROUND;
        let change: f32 = row.iter().zip(dense(beside)).map(|(a, b)| (a - b).abs()).sum();
        // From chain to chain, over 7.5 vertices, all of the weight moves: by 0.27 a vertex, more where a fifth influence is left out.
        assert!(change < 0.5, "weights of {v} and its neighbour differ by {change}");
    }
    assert!((0.5..=1.0).contains(&own), "at most {own} on chains");
}

#[test]
fn a_leg_that_is_raised_stays_inside_and_the_hem_comes_to_rest() {
    let worn = Worn::new(0.5, 0.2);
    let springs = worn.springs(true).unwrap();
    let mut pose = worn.rest.clone();
    *pose.rotation_mut(Joint::LeftUpperLeg) =
        pose.rotation(Joint::LeftUpperLeg) * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -0.6);
    let raised = pose.transforms_from(&worn.rest, &worn.skeleton);
    let mut swing = Swing::new(&springs);
    let step = 1.0 / 60.0;
    let worn_at = |swing: &Swing<'_>, joints: &[Isometry3<f64>]| {
        let all: Vec<Isometry3<f64>> = joints.iter().chain(swing.moved()).copied().collect();
        skin(&worn.tube.positions, springs.weights[1].as_ref().unwrap(), &all)
    };
    (0..30).for_each(|k| {
        let between = worn.rest.interpolated(&pose, f64::from(k) / 29.0);
        swing.update(&between.transforms_from(&worn.rest, &worn.skeleton), step);
    });
    let tube = worn_at(&swing, &raised);
    let leg = skin(&worn.body.positions, &worn.skin, &raised);
    // In front of the raised thigh, at its middle line.
    let knee =
        raised[Joint::LeftUpperLeg.index()] * worn.rest.joint_positions(&worn.skeleton)[Joint::LeftLowerLeg.index()];
    let front = |points: &[Point3<f32>]| {
        let near = points
            .iter()
            .filter(|p| (f64::from(p.x) - knee.x).abs() < 0.03 && (f64::from(p.y) - knee.y - 0.1).abs() < 0.02);
        near.map(|p| p.z).fold(f32::MIN, f32::max)
    };
    assert!(front(&tube) > front(&leg) - 0.02, "the thigh at {}, the cloth at {}", front(&leg), front(&tube));
    let first = tube;
    (0..180).for_each(|_| swing.update(&worn.rest.transforms_from(&worn.rest, &worn.skeleton), step));
    let still = vec![Isometry3::identity(); JOINT_COUNT];
    let rested = worn_at(&swing, &still);
    let farthest =
        |a: &[Point3<f32>], b: &[Point3<f32>]| a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f32::max);
    assert!(farthest(&first, &rested) > 0.1, "the leg did not move the cloth");
    assert!(
        farthest(&rested, &worn.tube.positions) < 0.001,
        "{} m from the scan",
        farthest(&rested, &worn.tube.positions)
    );
}
