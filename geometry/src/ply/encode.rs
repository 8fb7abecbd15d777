//! Meshes to PLY bytes.

use crate::Mesh;

/// Encodes a mesh as binary little endian PLY: positions, normals, colours and every attribute (as float), faces with
/// `int` indices.
pub fn encode(mesh: &Mesh) -> Vec<u8> {
    let mut out = header(mesh).into_bytes();
    for i in 0..mesh.positions.len() {
        let p = mesh.positions[i];
        let normal = mesh.normals.get(i).map(|n| [n.x, n.y, n.z]);
        for value in [p.x, p.y, p.z].into_iter().chain(normal.into_iter().flatten()) {
            out.extend(value.to_le_bytes());
        }
        out.extend(mesh.colors.get(i).into_iter().flatten());
        for attribute in mesh.attributes.values() {
            out.extend(attribute[i].to_le_bytes());
        }
    }
    for t in &mesh.triangles {
        out.push(3);
        t.iter().for_each(|&v| out.extend((v as i32).to_le_bytes()));
    }
    out
}

fn header(mesh: &Mesh) -> String {
    let mut text = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", mesh.positions.len());
    let float = |text: &mut String, name: &str| text.push_str(&format!("property float {name}\n"));
    ["x", "y", "z"].iter().for_each(|n| float(&mut text, n));
    if !mesh.normals.is_empty() {
        ["nx", "ny", "nz"].iter().for_each(|n| float(&mut text, n));
    }
    if !mesh.colors.is_empty() {
        ["red", "green", "blue"].iter().for_each(|n| text.push_str(&format!("property uchar {n}\n")));
    }
    mesh.attributes.keys().for_each(|n| float(&mut text, n));
    text.push_str(&format!(
        "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.triangles.len()
    ));
    text
}
