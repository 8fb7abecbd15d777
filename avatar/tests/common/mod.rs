//! A dressed avatar for tests: a body of the model in a pose like a scan's, trousers and top lifted off it.

use nalgebra::{UnitQuaternion, Vector3};
use toile_avatar::{Avatar, AvatarLayer, LayerTexture, Picture};
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

/// A PNG of one pixel, as another program (zlib) packs it.
#[rustfmt::skip]
#[allow(dead_code)] // not all tests draw
pub const PIXEL: &[u8] = &[
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52,
    0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x08, 0x02, 0x00, 0x00, 0x00, 0x90, 0x77, 0x53,
    0xde, 0x00, 0x00, 0x00, 0x0c, 0x49, 0x44, 0x41, 0x54, 0x78, 0x9c, 0x63, 0x38, 0xd1, 0xe0, 0x00,
    0x00, 0x03, 0x9c, 0x01, 0x89, 0xb6, 0x1a, 0x9b, 0x05, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e,
    0x44, 0xae, 0x42, 0x60, 0x82,
];

/// The same avatar with textures, relief too: seen from the front and, in a chart beside, from the back; the vertices between both stand twice.
#[allow(dead_code)] // not all tests draw
pub fn textured() -> Avatar {
    let mut avatar = dressed();
    for layer in &mut avatar.layers {
        let mesh = &layer.mesh;
        let count = mesh.positions.len() as u32;
        let is_back = |t: usize| {
            let [a, b, c] = mesh.corners(t);
            (b - a).cross(&(c - a)).z < 0.0
        };
        let place = |v: u32, is_back: bool| {
            let p = mesh.positions[v as usize];
            let across = (p.x + 1.0) / 4.0;
            [if is_back { 1.0 - across } else { across }, 1.0 - p.y / 2.0]
        };
        let mut first: Vec<Option<bool>> = vec![None; mesh.positions.len()];
        let mut again = std::collections::BTreeMap::new();
        let (mut source, mut uv): (Vec<u32>, Vec<[f32; 2]>) = ((0..count).collect(), vec![[0.0; 2]; count as usize]);
        let mut triangles = Vec::new();
        for (t, corners) in mesh.triangles.iter().enumerate() {
            let side = is_back(t);
            triangles.push(corners.map(|v| {
                if *first[v as usize].get_or_insert(side) == side {
                    uv[v as usize] = place(v, side);
                    return v;
                }
                *again.entry(v).or_insert_with(|| {
                    source.push(v);
                    uv.push(place(v, side));
                    source.len() as u32 - 1
                })
            }));
        }
        let picture = || Picture::Png(PIXEL.to_vec());
        layer.texture = Some(LayerTexture { source, uv, triangles, base_color: picture(), normal: Some(picture()) });
    }
    avatar
}
