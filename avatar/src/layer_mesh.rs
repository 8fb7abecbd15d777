//! One layer as a glTF mesh: positions, normals, places in its texture or linear colours, skin weights, where it hangs free (`_FREE`), indices.

use std::borrow::Cow;

use nalgebra::Vector3;
use serde_json::{Value, json};
use toile_character::{FREE_PART, SkinWeights};
use toile_geometry::Mesh;

use crate::{
    AvatarLayer,
    buffer::{Buffer, Shape, Target},
    tangents,
};

/// The linear colour of a layer whose vertices have none.
pub(crate) const NEUTRAL: [f64; 3] = [0.6, 0.6, 0.6];

/// Appends the layer's arrays to `buffer`; returns the glTF mesh, which uses material `material`.
pub(crate) fn layer_mesh(layer: &AvatarLayer, material: usize, buffer: &mut Buffer) -> Value {
    let drawn = layer.drawn();
    let mesh = &drawn.mesh;
    let positions: Vec<f32> = mesh.positions.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    let normals: Vec<[f32; 3]> = mesh.normals.iter().map(unit).collect();
    let (joints, weights) = influences(&drawn.weights);
    let mut attributes = json!({
        "POSITION": buffer.add_bounded(&positions, Shape::Vec3, Target::Vertices),
        "NORMAL": buffer.add(normals.as_flattened(), Shape::Vec3, Target::Vertices),
        "JOINTS_0": buffer.add(&joints, Shape::Vec4, Target::Vertices),
        "WEIGHTS_0": buffer.add(&weights, Shape::Vec4, Target::Vertices),
    });
    if let Some(texture) = &layer.texture {
        attributes["TEXCOORD_0"] = json!(buffer.add(texture.uv.as_flattened(), Shape::Vec2, Target::Vertices));
        if texture.normal.is_some() {
            let tangents = tangents(mesh, &texture.uv);
            attributes["TANGENT"] = json!(buffer.add(tangents.as_flattened(), Shape::Vec4, Target::Vertices));
        }
    } else if !mesh.colors.is_empty() {
        let colors = buffer.add(&linear_colors(&mesh.colors), Shape::Vec4, Target::Vertices);
        attributes["COLOR_0"] = json!(buffer.normalized(colors));
    }
    if let Some(free) = mesh.attributes.get(FREE_PART) {
        attributes["_FREE"] = json!(buffer.add(free, Shape::Scalar, Target::Vertices));
    }
    json!({
        "name": layer.name,
        "primitives": [{
            "attributes": attributes,
            "indices": indices(&mesh.triangles, mesh.positions.len(), buffer),
            "material": material,
            "mode": 4,
        }],
    })
}

/// A layer with the vertices that its files have.
pub(crate) struct DrawnLayer<'a> {
    /// With normals.
    pub mesh: Cow<'a, Mesh>,
    pub weights: Cow<'a, SkinWeights>,
}

impl AvatarLayer {
    /// The layer with a texture's vertices where it has one, else with its own; normals are those of the whole surface, also along borders of charts.
    pub(crate) fn drawn(&self) -> DrawnLayer<'_> {
        let normals = if self.mesh.normals.is_empty() { self.mesh.vertex_normals() } else { self.mesh.normals.clone() };
        let whole = Mesh { normals, ..self.mesh.clone() };
        let Some(texture) = &self.texture else {
            return DrawnLayer { mesh: Cow::Owned(whole), weights: Cow::Borrowed(&self.weights) };
        };
        DrawnLayer {
            mesh: Cow::Owned(whole.gather(&texture.source, texture.triangles.clone())),
            weights: Cow::Owned(self.weights.gather(&texture.source)),
        }
    }

    /// The normal of every vertex, of unit length.
    pub(crate) fn normals(&self) -> Vec<[f32; 3]> {
        let mesh = &self.mesh;
        let normals = if mesh.normals.is_empty() { mesh.vertex_normals() } else { mesh.normals.clone() };
        normals.iter().map(unit).collect()
    }
}

/// Facts that importers cannot know: order of dressing, type of garment, thickness, how much of it hangs free.
pub(crate) fn extras(layer: &AvatarLayer) -> Value {
    let mut extras = json!({ "layer": layer.order });
    if let Some(garment) = &layer.garment {
        extras["garment"] = json!(garment);
    }
    if let Some(thickness) = layer.thickness {
        // shortest decimal of the f32, not its binary expansion
        extras["thickness_m"] = thickness.to_string().parse::<f64>().map_or(Value::Null, |t| json!(t));
    }
    if let Some(free) = layer.mesh.attributes.get(FREE_PART).filter(|free| !free.is_empty()) {
        let share = free.iter().map(|f| f64::from(*f)).sum::<f64>() / free.len() as f64;
        extras["free_percent"] = json!((share * 100.0).round() as u32);
    }
    extras
}

/// Unit length as the format demands; straight up where a vertex has no normal.
pub(crate) fn unit(normal: &Vector3<f32>) -> [f32; 3] {
    let unit = normal.cast::<f64>().try_normalize(1e-12).unwrap_or_else(Vector3::y);
    unit.cast::<f32>().into()
}

pub(crate) fn indices(triangles: &[[u32; 3]], vertices: usize, buffer: &mut Buffer) -> usize {
    // the largest u16 is reserved: it restarts a primitive
    if vertices < usize::from(u16::MAX) {
        let short: Vec<u16> = triangles.iter().flatten().map(|&i| i as u16).collect();
        buffer.add(&short, Shape::Scalar, Target::Indices)
    } else {
        buffer.add(triangles.as_flattened(), Shape::Scalar, Target::Indices)
    }
}

/// glTF's vertex colours are linear; 16 bits keep the dark ones apart.
fn linear_colors(colors: &[[u8; 3]]) -> Vec<u16> {
    let table: Vec<u16> = (0..=255u8).map(|c| (linear_of_srgb(c) * f64::from(u16::MAX)).round() as u16).collect();
    colors.iter().flat_map(|c| [table[c[0] as usize], table[c[1] as usize], table[c[2] as usize], u16::MAX]).collect()
}

/// IEC 61966-2-1, decoding.
pub(crate) fn linear_of_srgb(value: u8) -> f64 {
    let c = f64::from(value) / 255.0;
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// Joints and weights, four a vertex. Weights are whole 65536ths and sum to 1 without rounding; unused slots are
/// joint 0, weight 0; no joint comes twice.
pub(crate) fn influences(weights: &SkinWeights) -> (Vec<u8>, Vec<f32>) {
    const WHOLE: u32 = 1 << 16;
    let (mut joints, mut out) = (Vec::with_capacity(4 * weights.len()), Vec::with_capacity(4 * weights.len()));
    for v in 0..weights.len() {
        let mut slots: Vec<(u8, f32)> = Vec::with_capacity(4);
        for (joint, weight) in weights.of(v) {
            match slots.iter_mut().find(|s| s.0 == joint) {
                Some(slot) => slot.1 += weight,
                None => slots.push((joint, weight)),
            }
        }
        slots.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let sum: f64 = slots.iter().map(|s| f64::from(s.1)).sum();
        let mut parts = [(0u8, 0u32); 4];
        for (part, (joint, weight)) in parts.iter_mut().zip(&slots) {
            let share = (f64::from(*weight) / sum * f64::from(WHOLE)).round() as u32;
            *part = if share > 0 { (*joint, share) } else { (0, 0) };
        }
        // what rounding left over or took goes to the largest
        let rest: u32 = parts[1..].iter().map(|p| p.1).sum();
        parts[0].1 = WHOLE - rest;
        joints.extend(parts.map(|p| p.0));
        out.extend(parts.map(|p| p.1 as f32 / WHOLE as f32));
    }
    (joints, out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_exactly_one() {
        let mut weights = SkinWeights::default();
        for i in 0..500u16 {
            let t = f32::from(i) * 0.7;
            weights.push(&[(3, t.sin().abs()), (1, t.cos().abs()), (51, 0.1), (7, 1e-7)]);
        }
        weights.joints.push([5, 5, 0, 0]);
        weights.weights.push([0.5, 0.5, 0.0, 0.0]);
        let (joints, out) = influences(&weights);
        for (j, w) in joints.chunks(4).zip(out.chunks(4)) {
            assert_eq!(w.iter().sum::<f32>(), 1.0);
            assert!(j.iter().zip(w).all(|(j, w)| *w > 0.0 || *j == 0));
        }
        assert_eq!(joints[2000..], [5, 0, 0, 0]);
        assert_eq!(out[2000..], [1.0, 0.0, 0.0, 0.0]);
        let half = weights.of(1).find(|i| i.0 == 3).unwrap().1;
        let slot = joints[4..8].iter().position(|j| *j == 3).unwrap();
        assert!((out[4 + slot] - half).abs() < 1e-4);
    }

    #[test]
    fn colours_become_linear() {
        assert_eq!(linear_colors(&[[0, 255, 0]]), [0, 65535, 0, 65535]);
        // sRGB 188 is 0.5029 linear
        assert!((f64::from(linear_colors(&[[188, 0, 0]])[0]) / 65535.0 - 0.5029).abs() < 1e-3);
    }

    #[test]
    fn a_vertex_without_a_normal_points_up() {
        assert_eq!(unit(&Vector3::zeros()), [0.0, 1.0, 0.0]);
        assert_eq!(unit(&Vector3::new(0.0, 0.0, 9.0)), [0.0, 0.0, 1.0]);
    }
}
