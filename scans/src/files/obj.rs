//! OBJ with its materials (MTL) and their pictures, or with vertex colours.

use std::collections::BTreeMap;

use toile_geometry::obj as geometry_obj;

use super::{Beside, printable, textures};
use crate::{Material, Surface};

/// The largest MTL file, bytes.
const MAX_MATERIALS: u64 = 64 << 20;

/// Decodes OBJ text without the materials that it may name.
///
/// # Errors
/// A sentence with the line that is wrong.
pub fn decode_obj(bytes: &[u8]) -> Result<Surface, String> {
    decode(bytes, &Beside::nothing())
}

pub(super) fn decode(bytes: &[u8], beside: &Beside) -> Result<Surface, String> {
    let mesh = geometry_obj::decode(bytes)?;
    let mut surface = Surface { colors: mesh.colors, ..Surface::new(mesh.positions, mesh.triangles) };
    let text = String::from_utf8_lossy(bytes);
    let mut look = Look::default();
    for (number, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        look.read_line(line).ok_or_else(|| format!("line {}: cannot read its texture coordinates", number + 1))?;
    }
    if look.names.is_empty() {
        return Ok(surface);
    }
    let mut library = read_library(&text, beside, &mut surface.notices);
    let material =
        |name: &String| library.remove(name).unwrap_or_else(|| Material { name: name.clone(), ..Material::default() });
    surface.materials = look.names.iter().map(material).collect();
    surface.material_of = look.material_of;
    if look.has_coordinates {
        surface.texture_coordinates = look.coordinates;
    }
    Ok(surface)
}

/// Texture coordinates and materials of the triangles, which [`geometry_obj::decode`] has read from the same lines.
#[derive(Default)]
struct Look {
    points: Vec<[f32; 2]>,
    coordinates: Vec<[[f32; 2]; 3]>,
    has_coordinates: bool,
    names: Vec<String>,
    now: u32,
    material_of: Vec<u32>,
}

impl Look {
    fn read_line(&mut self, line: &str) -> Option<()> {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("vt") => {
                let mut next = || words.next()?.parse::<f32>().ok().filter(|x| x.is_finite());
                // OBJ counts heights in a picture from below.
                self.points.push([next()?, 1.0 - next().unwrap_or(0.0)]);
            }
            Some("usemtl") => self.use_material(line.trim_start()["usemtl".len()..].trim()),
            Some("f") => {
                if self.names.is_empty() {
                    self.use_material("");
                }
                let corners: Vec<[f32; 2]> = words.map(|word| self.corner(word)).collect::<Option<_>>()?;
                let fan = 1..corners.len().checked_sub(1)?;
                self.coordinates.extend(fan.clone().map(|i| [corners[0], corners[i], corners[i + 1]]));
                self.material_of.extend(fan.map(|_| self.now));
            }
            _ => {}
        }
        Some(())
    }

    fn use_material(&mut self, name: &str) {
        let found = self.names.iter().position(|known| known == name);
        self.now = found.unwrap_or(self.names.len()) as u32;
        if found.is_none() {
            self.names.push(name.to_string());
        }
    }

    /// The place in the picture of a corner `vertex/point/normal`; 0 where it has none.
    fn corner(&mut self, word: &str) -> Option<[f32; 2]> {
        let Some(index) = word.split('/').nth(1).filter(|index| !index.is_empty()) else { return Some([0.0; 2]) };
        let index: i64 = index.parse().ok()?;
        let count = self.points.len() as i64;
        self.has_coordinates = true;
        self.points
            .get(usize::try_from(if index < 0 { count.checked_add(index)? } else { index.checked_sub(1)? }).ok()?)
            .copied()
    }
}

/// The materials by name, with their pictures.
fn read_library(text: &str, beside: &Beside, notices: &mut Vec<String>) -> BTreeMap<String, Material> {
    let mut library: BTreeMap<String, Material> = BTreeMap::new();
    let mut pictures = BTreeMap::new();
    for name in libraries(text) {
        let bytes = match beside.read(&name, MAX_MATERIALS) {
            Ok(bytes) => bytes,
            Err(reason) => {
                notices.push(reason);
                continue;
            }
        };
        for (name, color, picture) in parse_materials(&String::from_utf8_lossy(&bytes)) {
            let mut read = |name: String| {
                let read = textures::read(&name, beside);
                read.map_err(|reason| notices.push(reason)).ok()
            };
            let picture = picture.and_then(|file| pictures.entry(file.clone()).or_insert_with(|| read(file)).clone());
            library.insert(name.clone(), Material { name, color, picture });
        }
    }
    library
}

/// The MTL files that an OBJ file names.
fn libraries(text: &str) -> Vec<String> {
    let named = text.lines().filter_map(|line| line.trim().strip_prefix("mtllib"));
    let mut names: Vec<String> = named.map(|name| name.trim().to_string()).filter(|name| !name.is_empty()).collect();
    names.dedup();
    names
}

/// Name, diffuse colour and picture of each material of an MTL file.
fn parse_materials(text: &str) -> Vec<(String, Option<[u8; 3]>, Option<String>)> {
    let mut materials: Vec<(String, Option<[u8; 3]>, Option<String>)> = Vec::new();
    for line in text.trim_start_matches('\u{feff}').lines().map(str::trim) {
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        match word.to_ascii_lowercase().as_str() {
            "newmtl" => materials.push((rest.trim().to_string(), None, None)),
            "kd" => {
                let numbers: Vec<f32> = rest.split_whitespace().filter_map(|x| x.parse().ok()).collect();
                if let (Some(material), [r, g, b]) = (materials.last_mut(), numbers.as_slice()) {
                    material.1 = Some([r, g, b].map(|x| (x.clamp(0.0, 1.0) * 255.0).round() as u8));
                }
            }
            "map_kd" => {
                if let Some(material) = materials.last_mut() {
                    material.2 = Some(picture_name(rest));
                }
            }
            _ => {}
        }
    }
    materials
}

/// The file's name behind options such as `-s 1 1 1`; names may hold blanks.
fn picture_name(rest: &str) -> String {
    let words: Vec<&str> = rest.split_whitespace().collect();
    let is_argument = |word: &str| word.parse::<f32>().is_ok() || ["on", "off"].contains(&word);
    let mut at = 0;
    while words.get(at).is_some_and(|word| word.starts_with('-')) {
        at += 1;
        while words.get(at).is_some_and(|word| is_argument(word)) {
            at += 1;
        }
    }
    if at == 0 { rest.trim().to_string() } else { words[at..].join(" ") }
}

/// The MTL files and pictures that are named.
pub(super) fn named_files(bytes: &[u8], beside: &Beside) -> Vec<String> {
    let mut names = Vec::new();
    for library in libraries(&String::from_utf8_lossy(bytes)) {
        let text = beside.read(&library, MAX_MATERIALS).unwrap_or_default();
        names.push(library);
        names
            .extend(parse_materials(&String::from_utf8_lossy(&text)).into_iter().filter_map(|(_, _, picture)| picture));
    }
    names.iter().map(|name| printable(name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const OBJ: &str = "mtllib body.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0.25 0.25\nvt 0.75 0.75\nusemtl skin\n\
        f 1/1 2/1 3/-1 4/2\nusemtl plain\nf 1 2 3\nusemtl skin\nf 1/2 2/2 3/2\n";

    #[test]
    fn materials_and_pictures_are_read_from_files_beside_it() {
        let dir = tempfile::tempdir().unwrap();
        let mut picture = image::RgbImage::new(2, 2);
        picture.put_pixel(0, 1, image::Rgb([200, 10, 20]));
        picture.save(dir.path().join("my skin.png")).unwrap();
        let mtl = "newmtl skin\nKd 1 1 1\nmap_Kd -s 1 1 1 my skin.png\nnewmtl plain\nKd 0 1.0 0\n";
        std::fs::write(dir.path().join("body.mtl"), mtl).unwrap();
        let path = dir.path().join("body.obj");
        std::fs::write(&path, OBJ).unwrap();
        let surface = crate::read(&path).unwrap();
        assert!(surface.notices.is_empty(), "{:?}", surface.notices);
        assert_eq!(surface.material_of, [0, 0, 1, 0]);
        let first = |t| surface.color_at(t, [1.0, 0.0, 0.0]);
        assert_eq!([first(0), first(2), first(3)], [Some([200, 10, 20]), Some([0, 255, 0]), Some([0; 3])]);
        assert_eq!(surface.color_at(1, [0.0, 1.0, 0.0]), Some([0; 3]), "the fan's third corner");
        assert_eq!(crate::others(&path).unwrap(), ["body.mtl", "my skin.png"]);
    }

    #[test]
    fn what_is_missing_is_said_and_wrong_indices_are_refused() {
        let alone = decode_obj(OBJ.as_bytes()).unwrap();
        assert!(alone.notices[0].contains("body.mtl") && !alone.has_colors());
        let wrong = decode_obj(OBJ.replace("f 1/2", "f 1/3").as_bytes()).unwrap_err();
        assert!(wrong.contains("line 13"), "{wrong}");
        assert!(decode_obj(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/-9223372036854775808 2 3\n").is_err());
    }
}
