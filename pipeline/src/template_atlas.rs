//! The atlas of the body's template: the same for all people, so that their textures can be exchanged.

use toile_character::BodyModel;
use toile_geometry::Mesh;
use toile_texture::{Atlas, TextureError, TextureSettings, unwrap_from};

/// Texels around charts, at 4096: they stay apart down to the mip level at which eight texels are one.
pub(crate) const PADDING: u32 = 8;
/// Landmarks in whose surroundings no border of charts lies where it can be avoided: what people look at.
const WHOLE: [&str; 3] = ["noseTip", "suprasternale", "navel"];

/// The atlas of the template's mean shape for a picture of `size` texels. Its places do not depend on the size.
///
/// # Errors
/// [`TextureError`] where the template cannot be unwrapped.
pub(crate) fn template_atlas(model: &BodyModel, size: u32) -> Result<Atlas, TextureError> {
    let mesh = Mesh::new(model.mean.clone(), model.triangles.clone());
    let at = |name: &&str| {
        let vertex = model.landmark(name)?;
        model.triangles.iter().position(|t| t.contains(&vertex)).map(|t| t as u32)
    };
    let first: Vec<u32> = WHOLE.iter().filter_map(at).collect();
    let settings = TextureSettings { size: 4096, padding: PADDING, ..TextureSettings::default() };
    Ok(unwrap_from(&mesh, &first, &settings)?.in_order(model.mean.len()).sized(size))
}
