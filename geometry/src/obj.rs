//! Wavefront OBJ: the triangles of all its objects, polygons cut into fans.

use std::path::Path;

use nalgebra::Point3;

use crate::{GeometryError, Mesh};

/// Reads positions and faces of an OBJ file; materials, texture coordinates and normals are left out.
///
/// # Errors
/// [`GeometryError::Io`] where the file cannot be read, [`GeometryError::Format`] with the line that is wrong.
pub fn read(path: &Path) -> Result<Mesh, GeometryError> {
    let text = std::fs::read_to_string(path).map_err(|e| GeometryError::io(path, e))?;
    let mut mesh = Mesh::default();
    for (number, line) in text.lines().enumerate() {
        let wrong = || GeometryError::format(path, format!("line {}: cannot read \"{line}\"", number + 1));
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let numbers: Vec<f32> = words.take(3).filter_map(|w| w.parse().ok()).collect();
                let [x, y, z] = numbers[..] else { return Err(wrong()) };
                mesh.positions.push(Point3::new(x, y, z));
            }
            Some("f") => {
                let face: Option<Vec<u32>> = words.map(|w| vertex_index(w, mesh.positions.len())).collect();
                let face = face.filter(|f| f.len() >= 3).ok_or_else(wrong)?;
                mesh.triangles.extend((1..face.len() - 1).map(|i| [face[0], face[i], face[i + 1]]));
            }
            _ => {}
        }
    }
    mesh.validate().map_err(|e| GeometryError::format(path, e.to_string()))?;
    Ok(mesh)
}

fn vertex_index(word: &str, count: usize) -> Option<u32> {
    let index: i64 = word.split('/').next()?.parse().ok()?;
    let zero_based = if index < 0 { count as i64 + index } else { index - 1 };
    u32::try_from(zero_based).ok()
}

/// Writes positions and triangles as OBJ text.
///
/// # Errors
/// [`GeometryError::Io`] where the file cannot be written.
pub fn write(path: &Path, mesh: &Mesh) -> Result<(), GeometryError> {
    let mut text = String::new();
    for p in &mesh.positions {
        text.push_str(&format!("v {} {} {}\n", p.x, p.y, p.z));
    }
    for t in &mesh.triangles {
        text.push_str(&format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1));
    }
    std::fs::write(path, text).map_err(|e| GeometryError::io(path, e))
}
