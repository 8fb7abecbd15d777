//! The avatar's files in other formats than GLB and VRM: where they lie and what is in them.

use std::{
    collections::BTreeMap,
    io::Read,
    path::{Path, PathBuf},
};

use toile_animation::{Bvh, bvh};
use toile_avatar::{Avatar, AvatarError, AvatarLayer, Picture, picture_name, write_mtl, write_obj, write_usda};
use toile_capture::files::open_regular;
use toile_geometry::Mesh;

use crate::{folders::Folders, formats::FileFormat, hash, meshes::encode_skinned};

/// The file of the materials, as the OBJ file names it.
const MATERIALS: &str = "avatar.mtl";
/// What the names of pictures say that give the colour.
const COLOR: &str = "color";
/// The first bytes of a layer's file, which say what its picture is.
const HEAD: u64 = 16 << 10;

/// The files of `formats` for an avatar with these `layers`.
///
/// `textured` are the layers that have a texture, with the files that it is in.
pub(crate) fn paths(
    folders: &Folders,
    formats: &[FileFormat],
    layers: &[&str],
    textured: &[(&str, PathBuf)],
) -> Vec<PathBuf> {
    let of_format = |format: &FileFormat| match format {
        FileFormat::Glb | FileFormat::Vrm => Vec::new(),
        FileFormat::Obj => vec![folders.avatar_as("obj"), folders.root.join(MATERIALS)],
        FileFormat::Ply => layers.iter().map(|layer| folders.avatar_layer(layer)).collect(),
        FileFormat::Bvh | FileFormat::Usda => vec![folders.avatar_as(format.name())],
    };
    let mut paths: Vec<PathBuf> = formats.iter().flat_map(of_format).collect();
    if refer_to_pictures(formats) {
        paths.extend(textured.iter().map(|(name, path)| {
            let kind = if is_png(path) { Picture::Png(Vec::new()) } else { Picture::Jpeg(Vec::new()) };
            folders.root.join(picture_name(name, COLOR, &kind))
        }));
    }
    paths
}

/// Whether files of these formats name pictures that lie beside.
fn refer_to_pictures(formats: &[FileFormat]) -> bool {
    formats.iter().any(|format| matches!(format, FileFormat::Obj | FileFormat::Usda))
}

/// The pictures of all layers that have a texture.
pub(crate) fn pictures(avatar: &Avatar) -> Vec<Picture> {
    avatar.layers.iter().filter_map(|layer| Some(layer.texture.as_ref()?.base_color.clone())).collect()
}

/// Whether the picture in a layer's file is a PNG, by what stands before its binary part.
fn is_png(path: &Path) -> bool {
    let mut head = Vec::new();
    let read = open_regular(path).ok().and_then(|file| file.take(HEAD).read_to_end(&mut head).ok());
    read.is_some() && String::from_utf8_lossy(&head).contains("image/png")
}

/// What belongs into [`paths`], in their order. A layer of which nothing is left has an empty mesh.
///
/// # Errors
/// [`AvatarError`] where the avatar breaks a rule.
///
/// `pictures` are those of [`pictures`] before anything was left out of the avatar.
pub(crate) fn contents(
    avatar: &Avatar,
    formats: &[FileFormat],
    layers: &[&str],
    pictures: &[Picture],
) -> Result<Vec<Vec<u8>>, AvatarError> {
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
    if refer_to_pictures(formats) {
        files.extend(pictures.iter().map(|picture| picture.bytes().to_vec()));
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
