//! A dressed avatar for tests: a body of the model in a pose like a scan's, trousers and top lifted off it.

use nalgebra::{UnitQuaternion, Vector3};
use toile_avatar::{Avatar, AvatarLayer};
use toile_character::{BodyModel, Joint, JointNaming, Motion, Pose, SkinWeights};

/// The avatar: 3 layers, one motion of 9 poses called `wave`.
pub fn dressed() -> Avatar {
    let model = BodyModel::load_default().unwrap();
    let beta: Vec<f64> = (0..model.component_count()).map(|i| ((i * 7 % 5) as f64 - 2.0) * 0.3).collect();
    let body = model.skinned(&beta);
    let mut pose0 = Pose::identity();
    *pose0.rotation_mut(Joint::Hips) = UnitQuaternion::from_euler_angles(0.02, 0.3, 0.0);
    *pose0.rotation_mut(Joint::LeftUpperArm) = UnitQuaternion::from_euler_angles(0.1, 0.05, -0.12);
    *pose0.rotation_mut(Joint::RightUpperLeg) = UnitQuaternion::from_euler_angles(-0.03, 0.02, 0.05);
    pose0.translation = Vector3::new(0.03, -0.002, -0.05);
    let mut skin = body.posed_mesh(&pose0);
    skin.colors = (0..skin.positions.len()).map(|i| [(i % 256) as u8, (i / 256) as u8, 40]).collect();
    let mut layers = vec![layer("body", skin.clone(), body.weights.clone(), 0)];
    for (order, (name, low, high)) in [("01-trousers", 0.12, 1.0), ("02-top", 0.9, 1.42)].into_iter().enumerate() {
        let inside = |t: usize| skin.corners(t).iter().all(|p| p.y > low && p.y < high && p.x.abs() < 0.4);
        let (mut mesh, old) = skin.filter_triangles(inside);
        mesh.positions.iter_mut().zip(&mesh.normals).for_each(|(p, n)| *p += n * 0.01);
        let weights = SkinWeights {
            joints: old.iter().map(|&v| body.weights.joints[v as usize]).collect(),
            weights: old.iter().map(|&v| body.weights.weights[v as usize]).collect(),
        };
        let mut garment = layer(name, mesh, weights, order as u32 + 1);
        (garment.garment, garment.thickness) = (Some(name[3..].into()), Some(0.0015));
        layers.push(garment);
    }
    Avatar {
        name: "tester".into(),
        skeleton: body.skeleton,
        joint_names: JointNaming::Vrm,
        pose0,
        layers,
        motions: vec![wave()],
    }
}

fn layer(name: &str, mesh: toile_geometry::Mesh, weights: SkinWeights, order: u32) -> AvatarLayer {
    AvatarLayer { name: name.into(), mesh, weights, order, garment: None, thickness: None, texture: None }
}

/// Hips that rise, an arm that turns a full circle, a knee bent all the time.
fn wave() -> Motion {
    let poses = (0..9)
        .map(|i| {
            let t = f64::from(i);
            let mut pose = Pose::identity();
            pose.translation.y = 0.01 * t;
            // every other one by the opposite quaternion, which is the same rotation
            let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.785 * t);
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            *pose.rotation_mut(Joint::RightUpperArm) = UnitQuaternion::new_unchecked(turn.into_inner() * sign);
            *pose.rotation_mut(Joint::LeftLowerLeg) = UnitQuaternion::from_euler_angles(0.5, 0.0, 0.0);
            pose
        })
        .collect();
    Motion { name: "wave".into(), frame_time: 0.1, poses }
}
