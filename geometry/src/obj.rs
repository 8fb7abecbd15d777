//! Wavefront OBJ: the triangles of all its objects, polygons cut into fans.

use std::path::Path;

use nalgebra::Point3;

use crate::{GeometryError, Mesh, file::read_limited};

/// Maximum size of a file, bytes: text is some three times as long as the same mesh in PLY.
const MAX_BYTES: u64 = 1 << 30;
/// Maximum number of corners of a face: a fan over more of them is no surface, but thin triangles all at one vertex.
const MAX_CORNERS: usize = 1000;
/// At most this many characters of a line are shown.
const SHOWN: usize = 60;

/// Reads positions, faces and vertex colours (three numbers from 0 to 1 behind the position, as MeshLab writes them) of an
/// OBJ file; materials, texture coordinates and normals are left out.
///
/// # Errors
/// [`GeometryError::Io`] where the file cannot be read, [`GeometryError::Format`] with the line that is wrong.
pub fn read(path: &Path) -> Result<Mesh, GeometryError> {
    decode(&read_limited(path, MAX_BYTES)?).map_err(|reason| GeometryError::format(path, reason))
}

/// Decodes OBJ text as [`read`] does. Bytes that are not UTF-8 are allowed in comments and names.
///
/// # Errors
/// A sentence with the line that is wrong.
pub fn decode(bytes: &[u8]) -> Result<Mesh, String> {
    let text = String::from_utf8_lossy(bytes);
    let mut mesh = Mesh::default();
    for (number, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        read_line(line, &mut mesh).ok_or_else(|| {
            let corners = line.split_whitespace().count().saturating_sub(1);
            if line.trim_start().starts_with("f ") && corners > MAX_CORNERS {
                return format!("line {}: a face has {corners} corners; cut faces into triangles", number + 1);
            }
            let shown: String = line.chars().take(SHOWN).collect();
            let more = if shown.len() < line.len() { "..." } else { "" };
            format!("line {}: cannot read \"{shown}{more}\"", number + 1)
        })?;
    }
    if mesh.colors.len() != mesh.positions.len() {
        mesh.colors.clear(); // not every vertex has one
    }
    mesh.validate().map_err(|e| e.to_string())?;
    Ok(mesh)
}

fn read_line(line: &str, mesh: &mut Mesh) -> Option<()> {
    let mut words = line.split_whitespace();
    match words.next() {
        Some("v") => {
            let mut next = || words.next()?.parse::<f32>().ok();
            mesh.positions.push(Point3::new(next()?, next()?, next()?));
            if let (Some(r), Some(g), Some(b)) = (next(), next(), next()) {
                mesh.colors.push([r, g, b].map(|x| (x * 255.0).round() as u8));
            }
        }
        Some("f") => {
            let face: Vec<u32> =
                words.take(MAX_CORNERS + 1).map(|w| vertex_index(w, mesh.positions.len())).collect::<Option<_>>()?;
            let fan = 1..face.len().checked_sub(1).filter(|last| (2..MAX_CORNERS).contains(last))?;
            mesh.triangles.extend(fan.map(|i| [face[0], face[i], face[i + 1]]));
        }
        _ => {}
    }
    Some(())
}

/// Index of a face's corner, counted from 0: OBJ counts from 1, and from the last vertex backwards with negative numbers.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polygons_counted_from_either_end_become_triangles() {
        let text = "\u{feff}# four corners\r\no quad\r\nv 0 0 0\r\nv 1 0 0 1.0\r\nv 1 1 0\r\nv 0 1 0\r\n\
            vn 0 0 1\r\nf 1//1 2//1 3//1 4//1\r\nf -4/2/1 -3/1/1 -2/3/1\r\n";
        let mesh = decode(text.as_bytes()).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
        assert_eq!(mesh.positions[2], Point3::new(1.0, 1.0, 0.0));
    }

    #[test]
    fn lines_that_are_wrong_are_named_and_other_bytes_are_allowed() {
        let complaint = |body: &str| decode(format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{body}").as_bytes()).unwrap_err();
        for wrong in ["v 1 2", "v 1 x 2", "f 1 2", "f 0 1 2", "f -9 1 2", "f 1 2 99999999999999999999"] {
            assert!(complaint(wrong).contains("line 4"), "{wrong}");
        }
        let face = |corners: usize| format!("f{}", " 1 2 3".repeat(corners / 3));
        assert!(complaint(&face(3000)).contains("line 4: a face has 3000 corners"));
        assert!(decode(format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", face(999)).as_bytes()).is_ok());
        assert!(complaint(&format!("v {}", "x".repeat(1 << 20))).len() < 200, "a long line is not shown whole");
        assert!(complaint("f 1 2 4").contains("triangle 0"));
        assert!(complaint("v nan 0 0").contains("vertex 3"));
        assert!(decode(b"# M\xfcller\nv 0 0 0\n").is_ok());
    }
}
