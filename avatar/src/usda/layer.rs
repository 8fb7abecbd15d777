//! A layer as a skinned `Mesh`.

use super::{
    material,
    text::{array, extent, string, tuple},
};
use crate::{
    AvatarLayer,
    layer_mesh::{NEUTRAL, influences, linear_of_srgb},
};

/// The prim `name` of `layer`.
pub(super) fn layer(layer: &AvatarLayer, name: &str) -> String {
    let mesh = &layer.mesh;
    let (joints, weights) = influences(&layer.weights);
    let points = mesh.positions.iter().map(|p| tuple(p.iter()));
    format!(
        "    def Mesh \"{name}\" (\n        prepend apiSchemas = [{}]\n        customData = {{\n{}        }}\n    )\n    {{\n        \
         uniform bool doubleSided = {}\n        uniform token subdivisionScheme = \"none\"\n        float3[] extent = {}\n        \
         int[] faceVertexCounts = {}\n        int[] faceVertexIndices = {}\n        point3f[] points = {}\n        \
         normal3f[] normals = {} (\n            interpolation = \"vertex\"\n        )\n{}        \
         matrix4d primvars:skel:geomBindTransform = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))\n        \
         int[] primvars:skel:jointIndices = {} (\n            elementSize = 4\n            interpolation = \"vertex\"\n        )\n        \
         float[] primvars:skel:jointWeights = {} (\n            elementSize = 4\n            interpolation = \"vertex\"\n        )\n        \
         rel skel:skeleton = </avatar/skeleton>\n{}    }}\n\n",
        if layer.texture.is_some() { "\"SkelBindingAPI\", \"MaterialBindingAPI\"" } else { "\"SkelBindingAPI\"" },
        facts(layer),
        u8::from(layer.order > 0),
        extent(mesh.positions.iter()),
        array(mesh.triangles.iter().map(|_| 3)),
        array(mesh.triangles.as_flattened()),
        array(points),
        array(layer.normals().iter().map(tuple)),
        colors(layer),
        array(joints),
        array(weights),
        layer.texture.as_ref().map_or_else(String::new, |_| material::material(layer, name)),
    )
}

/// Facts that importers cannot know: its name, its place in the order of dressing, its type and thickness.
fn facts(layer: &AvatarLayer) -> String {
    let garment = layer.garment.as_ref().map(|g| format!("            string garment = {}\n", string(g)));
    let thickness = layer.thickness.map(|t| format!("            float thickness_m = {t}\n"));
    format!(
        "{}            int layer = {}\n            string name = {}\n{}",
        garment.unwrap_or_default(),
        layer.order,
        string(&layer.name),
        thickness.unwrap_or_default()
    )
}

/// The places in the texture, or the display colours: one a vertex, or one for the whole layer.
fn colors(layer: &AvatarLayer) -> String {
    if let Some(texture) = &layer.texture {
        return material::places(texture);
    }
    let colors = &layer.mesh.colors;
    if colors.is_empty() {
        return format!("        color3f[] primvars:displayColor = [{}]\n", tuple(NEUTRAL));
    }
    let linear: Vec<f32> = (0..=u8::MAX).map(|c| linear_of_srgb(c) as f32).collect();
    let values = colors.iter().map(|color| tuple(color.map(|c| linear[usize::from(c)])));
    format!(
        "        color3f[] primvars:displayColor = {} (\n            interpolation = \"vertex\"\n        )\n",
        array(values)
    )
}
