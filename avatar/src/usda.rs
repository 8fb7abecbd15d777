//! The avatar as USD text (`.usda`): a `SkelRoot` with a skeleton, a skinned mesh a layer, and an animation a motion.
//!
//! Source: OpenUSD's file format 1.0 and its schema UsdSkel. Matrices there act on row vectors, so that a matrix is written
//! column by column, and a joint's path names its ancestors.

mod animation;
mod layer;
mod material;
mod names;
mod skeleton;
mod text;

use crate::{Avatar, AvatarError, glb::GENERATOR};
use names::Names;

/// The avatar as a USDA file: metres, +Y up; one `SkelRoot` that holds a `Skeleton` of 52 joints which rest in `pose0`, a `Mesh` a
/// layer with normals, its texture (pictures lie beside, called as [`crate::picture_name`] says) or display colours (linear, as USD has them) and four influences a vertex, and a `SkelAnimation` a motion, of
/// which the first plays: a time code a pose.
///
/// Prims are called as layers, motions and joints are, with `_` in place of what USD's names do not allow; `customData.name`
/// is the name itself. The same avatar gives the same bytes.
///
/// # Errors
/// The error of [`Avatar::validate`].
pub fn write_usda(avatar: &Avatar) -> Result<String, AvatarError> {
    avatar.validate()?;
    let mut names = Names::default();
    let skeleton = names.take("skeleton");
    let motions: Vec<String> = avatar.motions.iter().map(|m| names.take(&m.name)).collect();
    let mut out = header(avatar);
    let plays = motions.first().map(String::as_str);
    out.push_str(&skeleton::skeleton(avatar, &skeleton, plays));
    for (motion, name) in avatar.motions.iter().zip(&motions) {
        out.push_str(&animation::animation(avatar, motion, name));
    }
    for layer in &avatar.layers {
        out.push_str(&layer::layer(layer, &names.take(&layer.name)));
    }
    out.push_str("}\n");
    Ok(out)
}

/// What stands before the prims in the root, and the root's own opening.
fn header(avatar: &Avatar) -> String {
    let mut metadata = format!(
        "    defaultPrim = \"avatar\"\n    doc = {}\n    metersPerUnit = 1\n    upAxis = \"Y\"\n",
        text::string(GENERATOR)
    );
    if let Some(motion) = avatar.motions.first() {
        let longest = avatar.motions.iter().map(|m| m.poses.len()).max().unwrap_or(1);
        // decimals of a rate that came as a time between frames
        let rate = (1e6 / motion.frame_time).round() / 1e6;
        metadata.push_str(&format!(
            "    startTimeCode = 0\n    endTimeCode = {}\n    timeCodesPerSecond = {rate}\n    framesPerSecond = {rate}\n",
            longest - 1
        ));
    }
    let points = avatar.layers.iter().flat_map(|layer| &layer.mesh.positions);
    format!(
        "#usda 1.0\n(\n{metadata})\n\ndef SkelRoot \"avatar\" (\n    prepend apiSchemas = [\"SkelBindingAPI\"]\n    kind = \"component\"\n    \
         customData = {{\n        string name = {}\n    }}\n)\n{{\n    float3[] extent = {}\n    rel skel:skeleton = </avatar/skeleton>\n\n",
        text::string(&avatar.name),
        text::extent(points),
    )
}
