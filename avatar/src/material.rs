//! Materials of layers, with their textures.

use serde_json::{Map, Value, json};

use crate::{AvatarLayer, Picture, buffer::Buffer, layer_mesh::NEUTRAL};

/// Materials, textures and images as they grow.
#[derive(Default)]
pub(crate) struct Materials {
    materials: Vec<Value>,
    textures: Vec<Value>,
    images: Vec<Value>,
}

impl Materials {
    /// Adds the material of a layer: matt, both sides of cloth visible; its colour from the texture, else from the vertices.
    pub fn add(&mut self, layer: &AvatarLayer, buffer: &mut Buffer) {
        let has_color = layer.texture.is_some() || !layer.mesh.colors.is_empty();
        let [r, g, b] = if has_color { [1.0; 3] } else { NEUTRAL };
        let mut surface = json!({ "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0 });
        let mut material = json!({ "name": layer.name, "doubleSided": layer.order > 0 });
        if let Some(texture) = &layer.texture {
            let index = self.add_picture(&format!("{} color", layer.name), &texture.base_color, buffer);
            surface["baseColorTexture"] = json!({ "index": index });
            if let Some(normal) = &texture.normal {
                let index = self.add_picture(&format!("{} normal", layer.name), normal, buffer);
                material["normalTexture"] = json!({ "index": index });
            }
        }
        material["pbrMetallicRoughness"] = surface;
        self.materials.push(material);
    }

    /// Index of the texture of a new picture.
    fn add_picture(&mut self, name: &str, picture: &Picture, buffer: &mut Buffer) -> usize {
        let view = buffer.add_file(picture.bytes());
        self.images.push(json!({ "name": name, "bufferView": view, "mimeType": picture.mime() }));
        self.textures.push(json!({ "source": self.images.len() - 1, "sampler": 0 }));
        self.textures.len() - 1
    }

    /// Puts all into a document.
    pub fn finish(self, document: &mut Map<String, Value>) {
        document.insert("materials".into(), Value::Array(self.materials));
        if !self.textures.is_empty() {
            document.insert("textures".into(), Value::Array(self.textures));
            document.insert("images".into(), Value::Array(self.images));
            document.insert("samplers".into(), json!([sampler()]));
        }
    }
}

/// Linear with mip levels; nothing repeats.
pub(crate) fn sampler() -> Value {
    json!({ "magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071 })
}
