//! Layers of a dressed avatar read back from its GLB file: what is needed to put a garment of it on somebody else.
//!
//! Source: glTF 2.0, §3.7.3 (skins). Inverse bind matrices say where the joints are and how they are turned where the layers lie; the
//! skeleton at rest and the pose follow from that, since joints at rest have the axes of the scene in files that [`crate::write_glb`] writes.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix4, Point3, Rotation3, Translation3, UnitQuaternion};
use toile_character::{JOINT_COUNT, Joint, JointNaming, Pose, Skeleton, SkinWeights, joint::JOINTS};
use toile_geometry::Mesh;

use crate::AvatarError;

/// The layers of a file.
#[derive(Debug, Clone)]
pub struct AvatarFile {
    /// Joints at rest, metres.
    pub skeleton: Skeleton,
    /// The pose that the layers are in.
    pub pose: Pose,
    /// The layers by their names.
    pub layers: BTreeMap<String, FileLayer>,
}

/// A layer of a file.
#[derive(Debug, Clone)]
pub struct FileLayer {
    /// Its mesh.
    pub mesh: Mesh,
    /// Its skin weights.
    pub weights: SkinWeights,
    /// The type of garment that its extras name.
    pub garment: Option<String>,
}

/// Reads all layers with a skin.
///
/// # Errors
/// [`AvatarError::Avatar`] where the bytes are not a GLB file with its buffers, no mesh has a skin, or a joint of the humanoid is missing.
pub fn read_avatar(bytes: &[u8]) -> Result<AvatarFile, AvatarError> {
    let wrong = |reason: String| AvatarError::Avatar(reason);
    let gltf::Gltf { document, blob } =
        gltf::Gltf::from_slice(bytes).map_err(|e| wrong(format!("it is not a glTF file: {e}")))?;
    let buffers = gltf::import_buffers(&document, None, blob)
        .map_err(|e| wrong(format!("its buffers are not in it ({e}): export it as one GLB")))?;
    let mut layers = BTreeMap::new();
    let mut rig = None;
    for node in document.nodes() {
        let (Some(mesh), Some(skin)) = (node.mesh(), node.skin()) else { continue };
        let joints = joints_of(&skin);
        rig = rig.or(Some(bound(&skin, &joints, &buffers)?));
        let name = node.name().or(mesh.name()).unwrap_or("without a name").to_string();
        let layer = layer(&mesh, &joints, &buffers).ok_or_else(|| {
            AvatarError::layer(
                &name,
                "its vertices have no positions, no skin weights, or weights of joints that there are not",
            )
        })?;
        let garment = extra(&node, "garment");
        layers.insert(name, FileLayer { garment, ..layer });
    }
    let Some((skeleton, pose)) = rig else {
        return Err(wrong("no mesh in it has a skin: export it with its skeleton".into()));
    };
    Ok(AvatarFile { skeleton, pose, layers })
}

/// The humanoid joint that each joint of a skin is, where it is one.
fn joints_of(skin: &gltf::Skin) -> Vec<Option<Joint>> {
    let of = |name: &str| JointNaming::ALL.iter().find_map(|naming| naming.joint(name));
    skin.joints().map(|node| node.name().and_then(of)).collect()
}

/// Skeleton at rest and pose of a skin.
fn bound(
    skin: &gltf::Skin,
    joints: &[Option<Joint>],
    buffers: &[gltf::buffer::Data],
) -> Result<(Skeleton, Pose), AvatarError> {
    let reader = skin.reader(|buffer| buffers.get(buffer.index()).map(|data| data.0.as_slice()));
    let matrices = reader.read_inverse_bind_matrices();
    let mut frames: Vec<Option<Isometry3<f64>>> = vec![None; JOINT_COUNT];
    for (joint, matrix) in joints.iter().zip(matrices.into_iter().flatten()) {
        if let (Some(joint), Some(frame)) = (joint, frame_of(&matrix)) {
            frames[joint.index()] = Some(frame);
        }
    }
    let (mut rest, mut pose) = ([Point3::origin(); JOINT_COUNT], Pose::identity());
    for joint in JOINTS {
        let missing = || AvatarError::Skeleton(format!("the file's skin has no joint `{}` at its place", joint.name()));
        let frame = frames[joint.index()].ok_or_else(missing)?;
        let above = joint.parent().and_then(|p| Some((p, frames[p.index()]?)));
        let (at, turn) = match above {
            None => (frame.translation.vector.into(), frame.rotation),
            Some((parent, above)) => {
                let local = above.inverse() * frame;
                (rest[parent.index()] + local.translation.vector, local.rotation)
            }
        };
        (rest[joint.index()], *pose.rotation_mut(joint)) = (at, turn);
    }
    Ok((Skeleton { rest }, pose))
}

/// `scene_from_joint` of an inverse bind matrix; `None` where it is no rigid motion.
fn frame_of(inverse: &[[f32; 4]; 4]) -> Option<Isometry3<f64>> {
    let matrix = Matrix4::from(*inverse).cast::<f64>().try_inverse()?;
    let turn = matrix.fixed_view::<3, 3>(0, 0).into_owned();
    if (turn.determinant() - 1.0).abs() > 1e-3 || !matrix.iter().all(|x| x.is_finite()) {
        return None;
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&turn));
    Some(Isometry3::from_parts(Translation3::new(matrix[(0, 3)], matrix[(1, 3)], matrix[(2, 3)]), rotation))
}

/// Copies of vertices that a texture's seams need become the vertex that they are copies of: the first at that place.
fn without_copies(mesh: &Mesh, weights: &SkinWeights) -> (Mesh, SkinWeights) {
    let mut first = BTreeMap::new();
    let mut kept: Vec<u32> = Vec::new();
    let new_of_old: Vec<u32> = (0..)
        .zip(&mesh.positions)
        .map(|(v, p)| {
            *first.entry([p.x.to_bits(), p.y.to_bits(), p.z.to_bits()]).or_insert_with(|| {
                kept.push(v);
                kept.len() as u32 - 1
            })
        })
        .collect();
    let triangles = mesh.triangles.iter().map(|t| t.map(|v| new_of_old[v as usize])).collect();
    let positions = kept.iter().map(|&v| mesh.positions[v as usize]).collect();
    (Mesh::new(positions, triangles), weights.gather(&kept))
}

/// All primitives of a mesh as one; `None` where they are not skinned triangles.
fn layer(mesh: &gltf::Mesh, joints: &[Option<Joint>], buffers: &[gltf::buffer::Data]) -> Option<FileLayer> {
    let (mut all, mut weights) = (Mesh::default(), SkinWeights::default());
    let mut is_textured = false;
    for primitive in mesh.primitives().filter(|p| p.mode() == gltf::mesh::Mode::Triangles) {
        let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(|data| data.0.as_slice()));
        let start = all.positions.len() as u32;
        all.positions.extend(reader.read_positions()?.map(Point3::from));
        let count = all.positions.len() as u32 - start;
        let corners: Vec<u32> = match reader.read_indices() {
            Some(indices) => indices.into_u32().collect(),
            None => (0..count).collect(),
        };
        all.triangles.extend(corners.chunks_exact(3).map(|c| [c[0] + start, c[1] + start, c[2] + start]));
        is_textured |= reader.read_tex_coords(0).is_some();
        let influences = reader.read_joints(0)?.into_u16().zip(reader.read_weights(0)?.into_f32());
        for (own, shares) in influences {
            let of = |(k, w): (u16, f32)| Some((joints.get(usize::from(k)).copied()??.index() as u8, w));
            let known: Vec<(u8, f32)> = own.into_iter().zip(shares).filter(|p| p.1 > 0.0).filter_map(of).collect();
            if known.is_empty() {
                return None;
            }
            weights.push(&known);
        }
    }
    let is_whole = all.validate().is_ok() && weights.len() == all.positions.len() && !all.is_empty();
    if !is_whole {
        return None;
    }
    let (mesh, weights) = if is_textured { without_copies(&all, &weights) } else { (all, weights) };
    Some(FileLayer { mesh, weights, garment: None })
}

fn extra(node: &gltf::Node, key: &str) -> Option<String> {
    let extras: serde_json::Value = serde_json::from_str(node.extras().as_ref()?.get()).ok()?;
    Some(extras.get(key)?.as_str()?.to_string())
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use toile_character::BodyModel;

    use super::*;
    use crate::{Avatar, AvatarLayer, write_glb};

    #[test]
    fn layers_come_back_as_they_were_written_with_skeleton_and_pose() {
        let model = BodyModel::load_default().unwrap();
        let body = model.skinned(&[1.0]);
        let mut pose = model.t_pose(&[1.0]);
        *pose.rotation_mut(Joint::Hips) = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, 0.4, 0.0));
        let layer = AvatarLayer {
            name: "01-coat".into(),
            mesh: body.posed_mesh(&pose),
            weights: body.weights.clone(),
            order: 1,
            garment: Some("jacket".into()),
            thickness: None,
            texture: None,
        };
        let avatar = Avatar {
            name: "anna".into(),
            skeleton: body.skeleton.clone(),
            joint_names: JointNaming::Mixamo,
            pose0: pose.clone(),
            layers: vec![layer.clone()],
            motions: Vec::new(),
        };
        let glb = write_glb(&avatar).unwrap();
        let read = read_avatar(&glb).unwrap();
        let coat = &read.layers["01-coat"];
        assert_eq!((&coat.mesh.positions, coat.garment.as_deref()), (&layer.mesh.positions, Some("jacket")));
        assert_eq!(coat.mesh.triangles.len(), layer.mesh.triangles.len());
        let (was, is) = (pose.joint_frames(&body.skeleton), read.pose.joint_frames(&read.skeleton));
        for (a, b) in was.iter().zip(&is) {
            assert!(
                (a.translation.vector - b.translation.vector).norm() < 1e-5 && a.rotation.angle_to(&b.rotation) < 1e-4
            );
        }
        for (a, b) in coat.weights.weights.iter().zip(&layer.weights.weights) {
            assert!(a.iter().sum::<f32>() > 0.99 && (a[0] - b[0]).abs() < 0.02, "{a:?} {b:?}");
        }
        for cut in [0, 11, glb.len() / 2, glb.len() - 5] {
            assert!(read_avatar(&glb[..cut]).is_err(), "{cut} bytes of {}", glb.len());
        }
    }

    #[test]
    fn a_file_without_a_skin_is_refused() {
        let bare = br#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{}}]}]}"#;
        assert!(
            read_avatar(bare).unwrap_err().to_string().contains("no mesh in it has a skin")
                || read_avatar(bare).is_err()
        );
        assert!(read_avatar(b"ply\n").unwrap_err().to_string().contains("not a glTF file"));
    }
}
