//! The surface in motion: closed at every level of detail, hardly crossing itself but in the creases of joints, near to the skinned body.

#![allow(clippy::unwrap_used)] // all of it is test code

use nalgebra::{Point3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use toile_animation::{Bvh, RetargetSettings, bvh, retarget, shipped_walk};
use toile_character::{BodyModel, Joint, Pose, Skeleton, SkinnedMesh};
use toile_geometry::{Mesh, bvh::Bvh as Tree, intersection::self_crossings, topology::Edges};
use toile_implicit::{Envelope, ImplicitBody, LEVELS, RealTime, fit};

/// Folds of skin around a joint, metres: at hip and shoulder half of a thigh's girth over the joint and as much below (ANSUR II: thigh girth
/// 0.62 m, men, a breadth of 0.2 m).
const CREASE: f64 = 0.2;

/// Triangles that may cross another away from creases, as a share of all: where legs pass each other closely, contours of one run into the
/// other's, and between the legs the folds go farther down than a crease.
const SHARE: f64 = 0.005;

/// A limb's own joints, at which it folds.
const CREASES: [Joint; 15] = [
    Joint::LeftUpperArm,
    Joint::RightUpperArm,
    Joint::LeftLowerArm,
    Joint::RightLowerArm,
    Joint::LeftUpperLeg,
    Joint::RightUpperLeg,
    Joint::LeftLowerLeg,
    Joint::RightLowerLeg,
    Joint::LeftHand,
    Joint::RightHand,
    Joint::LeftFoot,
    Joint::RightFoot,
    Joint::Hips,
    Joint::Neck,
    Joint::Head,
];

fn person(model: &BodyModel) -> ImplicitBody {
    let poses = [model.t_pose(&[])];
    fit::fit(model, &model.skinned(&[]), &[], "person", &poses, &fit::FitSettings::default()).unwrap().body
}

/// Every twelfth pose of the shipped walk.
fn walk(skeleton: &Skeleton) -> Vec<(String, Pose)> {
    named("walk", &shipped_walk().unwrap(), 12, skeleton)
}

/// All poses of the MakeHuman files, where they are at hand.
fn makehuman(skeleton: &Skeleton) -> Vec<(String, Pose)> {
    let Some(folder) = toile_outside::data("real/motion/makehuman_a") else { return Vec::new() };
    let of = |name| named(name, &bvh::read(&folder.join(format!("{name}.bvh"))).unwrap(), 1, skeleton);
    ["walk1", "dance1", "tpose"].into_iter().flat_map(of).collect()
}

fn named(name: &str, file: &Bvh, step: usize, skeleton: &Skeleton) -> Vec<(String, Pose)> {
    let moved = retarget(file, name, skeleton, &RetargetSettings::default()).unwrap().motion;
    moved.poses.into_iter().step_by(step).enumerate().map(|(k, pose)| (format!("{name} {k}"), pose)).collect()
}

/// The limb, or else the trunk, whose bone is nearest to a point.
fn limb(p: &Point3<f64>, at: &[Point3<f64>]) -> usize {
    use Joint::*;
    let limbs: [&[Joint]; 5] = [
        &[Hips, Spine, Chest, UpperChest, Neck, Head],
        &[LeftUpperArm, LeftLowerArm, LeftHand, LeftMiddleProximal],
        &[RightUpperArm, RightLowerArm, RightHand, RightMiddleProximal],
        &[LeftUpperLeg, LeftLowerLeg, LeftFoot, LeftToes],
        &[RightUpperLeg, RightLowerLeg, RightFoot, RightToes],
    ];
    let from_bone = |a: Point3<f64>, b: Point3<f64>| {
        let share = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        (p - (a + (b - a) * share)).norm()
    };
    let from = |joints: &[Joint]| {
        joints.windows(2).map(|j| from_bone(at[j[0].index()], at[j[1].index()])).fold(f64::MAX, f64::min)
    };
    (0..limbs.len()).min_by(|&a, &b| from(limbs[a]).total_cmp(&from(limbs[b]))).unwrap()
}

/// Crossing pairs of one limb, or of the trunk, farther from every crease than skin folds. Where a pose brings two limbs into each other
/// the skinned body crosses itself as well.
fn crossings_away_from_joints(mesh: &Mesh, at: &[Point3<f64>]) -> usize {
    let tree = Tree::new(&mesh.positions, &mesh.triangles);
    let is_away = |pair: &[u32; 2]| {
        let [a, b]: [Point3<f64>; 2] = pair.map(|t| mesh.positions[mesh.triangles[t as usize][0] as usize].cast());
        limb(&a, at) == limb(&b, at) && CREASES.iter().all(|j| (at[j.index()] - a).norm() > CREASE)
    };
    self_crossings(mesh, &tree).iter().filter(|pair| is_away(pair)).count()
}

#[test]
fn every_pose_is_closed_and_hardly_crosses_itself_away_from_creases() {
    let model = BodyModel::load_default().unwrap();
    let body = person(&model);
    let mut poses = walk(&body.skeleton);
    poses.extend(makehuman(&body.skeleton));
    let mut said = Vec::new();
    for (number, level) in LEVELS.into_iter().enumerate() {
        let envelope = Envelope::new(&model, &body, level).unwrap();
        let fast = RealTime::new(&model, &body, &Pose::identity(), level).unwrap();
        let is_closed = |triangles: &[[u32; 3]]| Edges::new(triangles).is_closed();
        assert!(is_closed(&envelope.triangles) && is_closed(fast.triangles()), "level {number}");
        let of = |(name, pose): &(String, Pose)| -> Vec<String> {
            let at = pose.joint_positions(&body.skeleton);
            let meshes = [("sampled", envelope.sample(&body, pose).mesh), ("deformed", fast.mesh(pose))];
            let counts = meshes.iter().map(|(way, mesh)| (way, crossings_away_from_joints(mesh, &at)));
            let most = SHARE * fast.triangles().len() as f64;
            let wrong = counts.filter(|c| c.1 as f64 > most);
            wrong.map(|(way, n)| format!("level {number}, {name}, {way}: {n} pairs")).collect()
        };
        said.extend(poses.par_iter().map(of).collect::<Vec<_>>().concat());
    }
    assert!(said.is_empty(), "{said:#?}");
}

/// Distances of the skin from the skinned body in the same pose, millimetres: mean over poses.
fn distance(envelope: &Envelope, body: &ImplicitBody, person: &SkinnedMesh, poses: &[(String, Pose)]) -> f64 {
    let of = |(_, pose): &(String, Pose)| {
        let sampled = envelope.sample(body, pose).mesh;
        let posed = person.posed(pose);
        let tree = Tree::new(&posed, &person.mesh.triangles);
        let skin = &sampled.positions[..envelope.skin_count()];
        let sum: f64 = skin.iter().filter_map(|p| tree.closest(p, 1.0)).map(|c| f64::from(c.distance)).sum();
        1e3 * sum / skin.len() as f64
    };
    poses.par_iter().map(of).collect::<Vec<f64>>().iter().sum::<f64>() / poses.len() as f64
}

/// The bar of the work order: the skin stays within 8 mm of the skinned body on average.
#[test]
fn the_walk_keeps_near_to_the_skinned_body() {
    let model = BodyModel::load_default().unwrap();
    let (body, person) = (person(&model), model.skinned(&[]));
    let envelope = Envelope::new(&model, &body, LEVELS[1]).unwrap();
    let mean = distance(&envelope, &body, &person, &walk(&body.skeleton));
    eprintln!("walk: {mean:.2} mm from the skinned body");
    assert!(mean < 8.0, "{mean} mm");
}

/// The bar of the work order: a forearm bent by 120° leaves the volume within 3 % of the arm's, and linear skinning loses more.
#[test]
fn a_bent_elbow_keeps_its_volume_better_than_skinning() {
    let model = BodyModel::load_default().unwrap();
    let (body, person) = (person(&model), model.skinned(&[]));
    let at = |j: Joint| person.skeleton.position(j);
    let mut bent = Pose::identity();
    for (elbow, hand) in [(Joint::LeftLowerArm, Joint::LeftHand), (Joint::RightLowerArm, Joint::RightHand)] {
        let axis = (at(hand) - at(elbow)).cross(&Vector3::z()).normalize();
        *bent.rotation_mut(elbow) = UnitQuaternion::from_scaled_axis(axis * 120f64.to_radians());
    }
    // between the middles of the two links: the part that an elbow is in, as a tube of the upper arm's girth at the elbow
    let reach = 0.5
        * ((at(Joint::LeftUpperArm) - at(Joint::LeftLowerArm)).norm()
            + (at(Joint::LeftHand) - at(Joint::LeftLowerArm)).norm());
    let both_elbows = 2.0 * 2.0 * reach * std::f64::consts::PI * 0.045 * 0.045;
    let envelope = Envelope::new(&model, &body, LEVELS[0]).unwrap();
    let sampled = |pose: &Pose| envelope.sample(&body, pose).mesh.signed_volume();
    let skinned = |pose: &Pose| Mesh::new(person.posed(pose), model.triangles.clone()).signed_volume();
    let change = |volume: &dyn Fn(&Pose) -> f64| 100.0 * (volume(&bent) - volume(&Pose::identity())) / both_elbows;
    let (ours, linear) = (change(&sampled), change(&skinned));
    eprintln!("elbow at 120°: {ours:+.2} % by primitives, {linear:+.2} % by linear skinning");
    assert!(ours.abs() < 3.0 && linear.abs() > ours.abs(), "{ours} % {linear} %");
}
