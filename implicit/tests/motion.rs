//! The surface in motion: closed at every level of detail, and crossing itself nowhere but in the creases of joints.

use nalgebra::Point3;
use toile_animation::{RetargetSettings, bvh, retarget, shipped_walk};
use toile_character::{BodyModel, Joint, Pose, Skeleton};
use toile_geometry::{Mesh, bvh::Bvh as Tree, intersection::self_crossings, topology::Edges};
use toile_implicit::{Envelope, ImplicitBody, LEVELS, RealTime, fit};

/// Folds of skin around a joint, metres: half a thigh's breadth at hip, shoulder and elbow (ANSUR II: thigh girth 0.62 m, men).
const CREASE: f64 = 0.14;

fn person(model: &BodyModel) -> ImplicitBody {
    let poses = [model.t_pose(&[])];
    fit::fit(model, &model.skinned(&[]), &[], "person", &poses, &fit::FitSettings::default()).unwrap().body
}

/// Every fifth pose of the shipped walk, and all of the MakeHuman files where they are at hand.
fn poses(skeleton: &Skeleton) -> Vec<(String, Pose)> {
    let settings = RetargetSettings::default();
    let mut files = vec![("walk".to_string(), shipped_walk().unwrap(), 12)];
    if let Some(folder) = toile_outside::data("real/motion/makehuman_a") {
        for name in ["walk1", "dance1", "tpose"] {
            files.push((name.into(), bvh::read(&folder.join(format!("{name}.bvh"))).unwrap(), 1));
        }
    }
    let mut out = Vec::new();
    for (name, file, step) in files {
        let moved = retarget(&file, &name, skeleton, &settings).unwrap().motion;
        out.extend(moved.poses.into_iter().step_by(step).enumerate().map(|(k, pose)| (format!("{name} {k}"), pose)));
    }
    out
}

/// Crossing pairs farther from every joint than a crease.
fn crossings_away_from_joints(mesh: &Mesh, joints: &[Point3<f64>]) -> usize {
    let tree = Tree::new(&mesh.positions, &mesh.triangles);
    let is_away = |pair: &[u32; 2]| {
        let corner: Point3<f64> = mesh.positions[mesh.triangles[pair[0] as usize][0] as usize].cast();
        joints.iter().all(|j| (j - corner).norm() > CREASE)
    };
    self_crossings(mesh, &tree).iter().filter(|pair| is_away(pair)).count()
}

#[test]
fn every_pose_is_closed_and_crosses_itself_in_creases_alone() {
    let model = BodyModel::load_default().unwrap();
    let body = person(&model);
    let creases = [
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
        Joint::Neck,
    ];
    let mut said = Vec::new();
    for (number, level) in LEVELS.into_iter().enumerate() {
        let envelope = Envelope::new(&model, &body, level).unwrap();
        let fast = RealTime::new(&model, &body, &Pose::identity(), level).unwrap();
        assert!(
            Edges::new(&envelope.triangles).is_closed() && Edges::new(fast.triangles()).is_closed(),
            "level {number}"
        );
        for (name, pose) in poses(&body.skeleton) {
            let at = pose.joint_positions(&body.skeleton);
            let joints: Vec<Point3<f64>> = creases.iter().map(|j| at[j.index()]).collect();
            let rest = [
                ("sampled", envelope.sample(&body, &Pose::identity()).mesh),
                ("deformed", fast.mesh(&Pose::identity())),
            ];
            let there = [("sampled", envelope.sample(&body, &pose).mesh), ("deformed", fast.mesh(&pose))];
            for ((way, mesh), (_, still)) in there.iter().zip(&rest) {
                let (count, own) =
                    (crossings_away_from_joints(mesh, &joints), crossings_away_from_joints(still, &body.skeleton.rest));
                if count > own {
                    said.push(format!("level {number}, {name}, {way}: {count} pairs, {own} at rest"));
                }
            }
        }
    }
    assert!(said.is_empty(), "{said:#?}");
}
