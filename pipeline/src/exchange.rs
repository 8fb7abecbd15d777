//! The avatar's files in other formats than GLB and VRM: where they lie and what is in them.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use toile_animation::{Bvh, bvh};
use toile_avatar::{Avatar, AvatarError, AvatarLayer, write_mtl, write_obj, write_usda};
use toile_geometry::Mesh;

use crate::{folders::Folders, formats::FileFormat, hash, meshes::encode_skinned};

/// The file of the materials, as the OBJ file names it.
const MATERIALS: &str = "avatar.mtl";

/// The files of `formats` for an avatar with these `layers`.
pub(crate) fn paths(folders: &Folders, formats: &[FileFormat], layers: &[&str]) -> Vec<PathBuf> {
    let of_format = |format: &FileFormat| match format {
        FileFormat::Glb | FileFormat::Vrm => Vec::new(),
        FileFormat::Obj => vec![folders.avatar_as("obj"), folders.root.join(MATERIALS)],
        FileFormat::Ply => layers.iter().map(|layer| folders.avatar_layer(layer)).collect(),
        FileFormat::Bvh | FileFormat::Usda => vec![folders.avatar_as(format.name())],
    };
    formats.iter().flat_map(of_format).collect()
}

/// What belongs into [`paths`], in their order. A layer of which nothing is left has an empty mesh.
///
/// # Errors
/// [`AvatarError`] where the avatar breaks a rule.
pub(crate) fn contents(avatar: &Avatar, formats: &[FileFormat], layers: &[&str]) -> Result<Vec<Vec<u8>>, AvatarError> {
    let mut files = Vec::new();
    for format in formats {
        match format {
            FileFormat::Glb | FileFormat::Vrm => {}
            FileFormat::Obj => {
                files.extend([write_obj(avatar, MATERIALS)?, write_mtl(avatar)].map(String::into_bytes));
            }
            FileFormat::Ply => files.extend(layers.iter().map(|name| alone(avatar, name))),
            FileFormat::Bvh => files.push(motion(avatar)?),
            FileFormat::Usda => files.push(write_usda(avatar)?.into_bytes()),
        }
    }
    Ok(files)
}

/// The layer called `name` with its skin weights as vertex attributes.
fn alone(avatar: &Avatar, name: &str) -> Vec<u8> {
    let layer: Option<&AvatarLayer> = avatar.layers.iter().find(|layer| layer.name == name);
    layer.map_or_else(
        || encode_skinned(&Mesh::default(), &Default::default()),
        |layer| encode_skinned(&layer.mesh, &layer.weights),
    )
}

/// The first motion on the avatar's own skeleton.
fn motion(avatar: &Avatar) -> Result<Vec<u8>, AvatarError> {
    let motion = avatar.motions.first().ok_or_else(|| AvatarError::Avatar("it has no motion".into()))?;
    Ok(bvh::write(&Bvh::of_motion(&avatar.skeleton, motion, avatar.joint_names)).into_bytes())
}

/// Of the files that an earlier run wrote, those that are no longer asked for and still are as it wrote them: `before` and
/// `now` are outputs with their hashes, by path below `root`.
pub(crate) fn left_over(
    root: &Path,
    before: &BTreeMap<String, String>,
    now: &BTreeMap<String, String>,
) -> Vec<PathBuf> {
    let gone = before.iter().filter(|(path, _)| !now.contains_key(*path));
    let ours = |(path, written): (&String, &String)| {
        let path = root.join(path);
        hash::file(&path).is_ok_and(|found| found == *written).then_some(path)
    };
    gone.filter_map(ours).collect()
}
