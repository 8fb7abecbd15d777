//! PLY: binary little endian on the way out; binary (both orders) and ASCII on the way in.

use std::{collections::BTreeMap, io::Write, path::Path};

use nalgebra::{Point3, Vector3};

use crate::{GeometryError, Mesh};

/// Largest element count that is believed; a torn header must not ask for all memory.
const MAX_ELEMENTS: usize = 200_000_000;

/// Encodes a mesh: positions, normals, colours and every attribute (as float), faces with `int` indices.
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

/// Writes a mesh to `path` in place. Stages write through the pipeline's own whole-or-nothing writer and [`encode`].
///
/// # Errors
/// [`GeometryError::Io`] where the file cannot be written.
pub fn write(path: &Path, mesh: &Mesh) -> Result<(), GeometryError> {
    let mut file = std::fs::File::create(path).map_err(|e| GeometryError::io(path, e))?;
    file.write_all(&encode(mesh)).map_err(|e| GeometryError::io(path, e))
}

/// Reads a PLY file.
///
/// # Errors
/// [`GeometryError::Io`] where it cannot be read, [`GeometryError::Format`] where it is torn or no triangle mesh.
pub fn read(path: &Path) -> Result<Mesh, GeometryError> {
    let bytes = std::fs::read(path).map_err(|e| GeometryError::io(path, e))?;
    decode(&bytes).map_err(|reason| GeometryError::format(path, reason))
}

/// Decodes PLY bytes; polygons are cut into fans; unknown numeric vertex properties become attributes.
///
/// # Errors
/// A sentence on what is wrong.
pub fn decode(bytes: &[u8]) -> Result<Mesh, String> {
    let (header, body) = parse_header(bytes)?;
    let mut reader: Box<dyn Numbers> = match header.format {
        Format::Ascii => Box::new(AsciiNumbers::new(body)?),
        Format::Binary { big_endian } => Box::new(BinaryNumbers { bytes: body, at: 0, big_endian }),
    };
    let mut mesh = Mesh::default();
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => read_vertices(element, reader.as_mut(), &mut mesh)?,
            "face" => read_faces(element, reader.as_mut(), &mut mesh)?,
            _ => skip(element, reader.as_mut())?,
        }
    }
    mesh.validate().map_err(|e| e.to_string())?;
    Ok(mesh)
}

#[derive(Clone, Copy)]
enum Format {
    Ascii,
    Binary { big_endian: bool },
}

#[derive(Clone, Copy, PartialEq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(name: &str) -> Result<Self, String> {
        Ok(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            other => return Err(format!("unknown property type \"{other}\"")),
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

struct Property {
    name: String,
    list_count: Option<Scalar>,
    scalar: Scalar,
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

struct Header {
    format: Format,
    elements: Vec<Element>,
}

fn parse_header(bytes: &[u8]) -> Result<(Header, &[u8]), String> {
    let end = find(bytes, b"end_header").ok_or("no PLY header: end_header is missing")?;
    let body = find(&bytes[end..], b"\n").map(|n| &bytes[end + n + 1..]).ok_or("the file ends in its header")?;
    let text = String::from_utf8_lossy(&bytes[..end]);
    if !text.starts_with("ply") {
        return Err("not a PLY file".into());
    }
    let mut header = Header { format: Format::Ascii, elements: Vec::new() };
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["format", "ascii", _] => header.format = Format::Ascii,
            ["format", "binary_little_endian", _] => header.format = Format::Binary { big_endian: false },
            ["format", "binary_big_endian", _] => header.format = Format::Binary { big_endian: true },
            ["format", other, ..] => return Err(format!("unknown format \"{other}\"")),
            ["element", name, count] => header.elements.push(Element {
                name: name.into(),
                count: count.parse().ok().filter(|&n| n <= MAX_ELEMENTS).ok_or(format!("bad count in \"{line}\""))?,
                properties: Vec::new(),
            }),
            ["property", "list", count, scalar, name] => {
                push_property(&mut header, name, Some(Scalar::parse(count)?), Scalar::parse(scalar)?)?;
            }
            ["property", scalar, name] => push_property(&mut header, name, None, Scalar::parse(scalar)?)?,
            _ => {}
        }
    }
    Ok((header, body))
}

fn push_property(header: &mut Header, name: &str, list_count: Option<Scalar>, scalar: Scalar) -> Result<(), String> {
    let element = header.elements.last_mut().ok_or("a property stands before any element")?;
    element.properties.push(Property { name: name.into(), list_count, scalar });
    Ok(())
}

fn find(bytes: &[u8], what: &[u8]) -> Option<usize> {
    bytes.windows(what.len()).position(|w| w == what)
}

trait Numbers {
    fn next(&mut self, scalar: Scalar) -> Result<f64, String>;
}

struct AsciiNumbers<'a>(std::str::SplitAsciiWhitespace<'a>);

impl<'a> AsciiNumbers<'a> {
    fn new(body: &'a [u8]) -> Result<Self, String> {
        let text = std::str::from_utf8(body).map_err(|_| "the ASCII body holds bytes that are no text")?;
        Ok(Self(text.split_ascii_whitespace()))
    }
}

impl Numbers for AsciiNumbers<'_> {
    fn next(&mut self, _: Scalar) -> Result<f64, String> {
        let word = self.0.next().ok_or("the file ends before its last element")?;
        word.parse().map_err(|_| format!("\"{word}\" is no number"))
    }
}

struct BinaryNumbers<'a> {
    bytes: &'a [u8],
    at: usize,
    big_endian: bool,
}

impl Numbers for BinaryNumbers<'_> {
    #[inline]
    fn next(&mut self, scalar: Scalar) -> Result<f64, String> {
        let size = scalar.size();
        let slice = self.bytes.get(self.at..self.at + size).ok_or("the file ends before its last element")?;
        self.at += size;
        let mut raw = [0u8; 8];
        raw[..size].copy_from_slice(slice);
        if self.big_endian {
            raw[..size].reverse();
        }
        let bits = u64::from_le_bytes(raw);
        Ok(match scalar {
            Scalar::I8 => f64::from(bits as i8),
            Scalar::U8 => f64::from(bits as u8),
            Scalar::I16 => f64::from(bits as i16),
            Scalar::U16 => f64::from(bits as u16),
            Scalar::I32 => f64::from(bits as i32),
            Scalar::U32 => f64::from(bits as u32),
            Scalar::F32 => f64::from(f32::from_bits(bits as u32)),
            Scalar::F64 => f64::from_bits(bits),
        })
    }
}

fn read_vertices(element: &Element, reader: &mut dyn Numbers, mesh: &mut Mesh) -> Result<(), String> {
    let mut columns: Vec<Vec<f32>> = element.properties.iter().map(|_| Vec::new()).collect();
    for _ in 0..element.count {
        for (property, column) in element.properties.iter().zip(&mut columns) {
            if let Some(value) = read_value(property, reader)? {
                column.push(value as f32);
            }
        }
    }
    let mut named: BTreeMap<&str, Vec<f32>> = BTreeMap::new();
    for (property, column) in element.properties.iter().zip(columns) {
        if property.list_count.is_none() {
            named.insert(&property.name, column);
        }
    }
    let mut triple = |names: [&str; 3]| -> Option<Vec<[f32; 3]>> {
        if !names.iter().all(|n| named.contains_key(n)) {
            return None;
        }
        let [a, b, c] = names.map(|n| named.remove(n).unwrap_or_default());
        Some((0..a.len()).map(|i| [a[i], b[i], c[i]]).collect())
    };
    let positions = triple(["x", "y", "z"]).ok_or("the vertices have no x, y and z")?;
    mesh.positions = positions.into_iter().map(Point3::from).collect();
    mesh.normals = triple(["nx", "ny", "nz"]).unwrap_or_default().into_iter().map(Vector3::from).collect();
    mesh.colors =
        triple(["red", "green", "blue"]).unwrap_or_default().into_iter().map(|c| c.map(|x| x as u8)).collect();
    mesh.attributes = named.into_iter().map(|(k, a)| (k.to_string(), a)).collect();
    Ok(())
}

/// One scalar property, or `None` for a list, which is read over.
fn read_value(property: &Property, reader: &mut dyn Numbers) -> Result<Option<f64>, String> {
    let Some(count) = property.list_count else { return reader.next(property.scalar).map(Some) };
    for _ in 0..reader.next(count)? as usize {
        reader.next(property.scalar)?;
    }
    Ok(None)
}

fn read_faces(element: &Element, reader: &mut dyn Numbers, mesh: &mut Mesh) -> Result<(), String> {
    let mut corners: Vec<u32> = Vec::new();
    for face in 0..element.count {
        for property in &element.properties {
            let is_face = property.name == "vertex_indices" || property.name == "vertex_index";
            let (true, Some(count)) = (is_face, property.list_count) else {
                read_value(property, reader)?;
                continue;
            };
            corners.clear();
            for _ in 0..reader.next(count)? as usize {
                let index = reader.next(property.scalar)?;
                if index < 0.0 {
                    return Err(format!("face {face} has the vertex index {index}"));
                }
                corners.push(index as u32);
            }
            let fan = 1..corners.len().max(2) - 1;
            mesh.triangles.extend(fan.map(|i| [corners[0], corners[i], corners[i + 1]]));
        }
    }
    Ok(())
}

fn skip(element: &Element, reader: &mut dyn Numbers) -> Result<(), String> {
    for _ in 0..element.count {
        for property in &element.properties {
            read_value(property, reader)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Mesh {
        Mesh {
            positions: vec![Point3::new(0.0, 0.5, -1.0), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 2.0)],
            triangles: vec![[0, 1, 2], [2, 1, 0]],
            normals: vec![Vector3::z(); 3],
            colors: vec![[1, 2, 3], [4, 5, 6], [250, 251, 252]],
            attributes: BTreeMap::from([("filled".to_string(), vec![0.0, 1.0, 0.5])]),
        }
    }

    #[test]
    fn what_is_written_is_read_back() {
        assert_eq!(decode(&encode(&sample())).unwrap(), sample());
    }

    #[test]
    fn ascii_quads_become_two_triangles() {
        let text = "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
            element face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
        assert_eq!(decode(text.as_bytes()).unwrap().triangles, vec![[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn every_torn_file_is_an_error_and_none_panics() {
        let bytes = encode(&sample());
        for end in 0..bytes.len() {
            assert!(decode(&bytes[..end]).is_err(), "{end} of {} bytes were taken for a whole file", bytes.len());
        }
    }

    #[test]
    fn an_index_beyond_the_vertices_is_refused() {
        let mut mesh = sample();
        mesh.triangles[1][2] = 3;
        assert!(decode(&encode(&mesh)).unwrap_err().contains("triangle 1"));
    }
}
