//! The material of a layer with a texture (OpenUSD's `UsdPreviewSurface`), inside of its mesh.

use super::text::{array, tuple};
use crate::{AvatarLayer, LayerTexture, Picture, picture_name};

/// Places in the texture, one a corner, upwards as USD has them.
pub(super) fn places(texture: &LayerTexture) -> String {
    format!(
        "        texCoord2f[] primvars:st = {} (\n            interpolation = \"faceVarying\"\n        )\n        int[] primvars:st:indices = {}\n",
        array(texture.uv.iter().map(|[u, v]| tuple([*u, 1.0 - v]))),
        array(texture.triangles.as_flattened()),
    )
}

/// The binding of the mesh `name`, and the material that it is bound to.
pub(super) fn material(layer: &AvatarLayer, name: &str) -> String {
    let Some(texture) = &layer.texture else { return String::new() };
    let path = format!("/avatar/{name}/material");
    let picture = |kind: &str, picture: &Picture, space: &str, more: &str| {
        format!(
            "            def Shader \"{kind}\"\n            {{\n                uniform token info:id = \"UsdUVTexture\"\n                \
             asset inputs:file = @./{}@\n                token inputs:sourceColorSpace = \"{space}\"\n                \
             token inputs:wrapS = \"clamp\"\n                token inputs:wrapT = \"clamp\"\n{more}                \
             float2 inputs:st.connect = <{path}/place.outputs:result>\n                float3 outputs:rgb\n            }}\n",
            picture_name(&layer.name, kind, picture),
        )
    };
    // a map's values lie from 0 to 1, its directions from -1 to 1
    let signed =
        "                float4 inputs:scale = (2, 2, 2, 1)\n                float4 inputs:bias = (-1, -1, -1, 0)\n";
    let normal = texture.normal.as_ref().map(|normal| picture("normal", normal, "raw", signed));
    let relief = normal.as_ref().map_or_else(String::new, |_| {
        format!("                normal3f inputs:normal.connect = <{path}/normal.outputs:rgb>\n")
    });
    format!(
        "        rel material:binding = <{path}>\n\n        def Material \"material\"\n        {{\n            \
         token outputs:surface.connect = <{path}/surface.outputs:surface>\n            \
         def Shader \"surface\"\n            {{\n                uniform token info:id = \"UsdPreviewSurface\"\n                \
         color3f inputs:diffuseColor.connect = <{path}/color.outputs:rgb>\n                float inputs:metallic = 0\n                \
         float inputs:roughness = 1\n{relief}                token outputs:surface\n            }}\n            \
         def Shader \"place\"\n            {{\n                uniform token info:id = \"UsdPrimvarReader_float2\"\n                \
         string inputs:varname = \"st\"\n                float2 outputs:result\n            }}\n{}{}        }}\n",
        picture("color", &texture.base_color, "sRGB", ""),
        normal.unwrap_or_default(),
    )
}
