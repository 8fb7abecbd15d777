//! The tables of a PLY file: vertices, faces, and others, which are read over.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::{
    TextureCorners,
    header::{Element, Property, Scalar},
    numbers::Numbers,
};
use crate::Mesh;

const POSITION: [&str; 3] = ["x", "y", "z"];
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];
const COLOR: [&str; 3] = ["red", "green", "blue"];

/// Reads positions, normals, colours and attributes into `mesh`.
pub(super) fn read_vertices(element: &Element, numbers: &mut dyn Numbers, mesh: &mut Mesh) -> Result<(), String> {
    let mut columns: Vec<Vec<f32>> = element.properties.iter().map(|_| Vec::new()).collect();
    for _ in 0..element.count {
        for (property, column) in element.properties.iter().zip(&mut columns) {
            if let Some(value) = read_value(property, numbers)? {
                column.push(value as f32);
            }
        }
    }
    let properties = element.properties.iter().filter(|p| p.list_count.is_none());
    let color_type = properties.clone().find(|p| p.name == COLOR[0]).map_or(Scalar::U8, |p| p.scalar);
    let columns = element.properties.iter().zip(columns).filter(|(p, _)| p.list_count.is_none());
    let mut named: BTreeMap<&str, Vec<f32>> = columns.map(|(p, column)| (p.name.as_str(), column)).collect();
    let positions = take_triple(&mut named, POSITION).ok_or("the vertices have no x, y and z")?;
    mesh.positions = positions.into_iter().map(Point3::from).collect();
    mesh.normals = take_triple(&mut named, NORMAL).unwrap_or_default().into_iter().map(Vector3::from).collect();
    mesh.colors = to_bytes(take_triple(&mut named, COLOR).unwrap_or_default(), color_type);
    mesh.attributes = named.into_iter().map(|(k, a)| (k.to_string(), a)).collect();
    Ok(())
}

/// Three columns as one, where all are there.
fn take_triple(named: &mut BTreeMap<&str, Vec<f32>>, names: [&str; 3]) -> Option<Vec<[f32; 3]>> {
    if !names.iter().all(|n| named.contains_key(n)) {
        return None;
    }
    let [a, b, c] = names.map(|n| named.remove(n).unwrap_or_default());
    Some((0..a.len()).map(|i| [a[i], b[i], c[i]]).collect())
}

/// Colours of type `scalar` as bytes.
fn to_bytes(colors: Vec<[f32; 3]>, scalar: Scalar) -> Vec<[u8; 3]> {
    let scale = match scalar {
        Scalar::U16 => 1.0 / 257.0,
        // Some writers give floats from 0 to 255; a scan of which no channel exceeds 1 would be black then.
        Scalar::F32 | Scalar::F64 if colors.as_flattened().iter().all(|&x| x <= 1.0) => 255.0,
        _ => 1.0,
    };
    if scale == 1.0 {
        return colors.into_iter().map(|c| c.map(|x| x as u8)).collect();
    }
    colors.into_iter().map(|c| c.map(|x| (x * scale).round() as u8)).collect()
}

/// One scalar property, or `None` for a list, which is read over.
fn read_value(property: &Property, numbers: &mut dyn Numbers) -> Result<Option<f64>, String> {
    let Some(count) = property.list_count else { return numbers.next(property.scalar).map(Some) };
    for _ in 0..list_length(count, numbers)? {
        numbers.next(property.scalar)?;
    }
    Ok(None)
}

fn list_length(scalar: Scalar, numbers: &mut dyn Numbers) -> Result<usize, String> {
    let length = numbers.next(scalar)?;
    if length < 0.0 || length.fract() != 0.0 {
        return Err(format!("a list has the length {length}"));
    }
    Ok(length as usize)
}

/// Reads triangles into `mesh`, and the texture coordinates of their corners into `texture`.
pub(super) fn read_faces(
    element: &Element,
    numbers: &mut dyn Numbers,
    mesh: &mut Mesh,
    texture: &mut Vec<TextureCorners>,
) -> Result<(), String> {
    let (mut corners, mut places): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    for face in 0..element.count {
        corners.clear();
        places.clear();
        for property in &element.properties {
            match property.name.as_str() {
                "vertex_indices" | "vertex_index" if property.list_count.is_some() => {
                    read_list(property, numbers, &mut corners)?;
                }
                "texcoord" if property.list_count.is_some() => read_list(property, numbers, &mut places)?,
                _ => drop(read_value(property, numbers)?),
            }
        }
        if let Some(index) = corners.iter().find(|i| !(0.0..=f64::from(u32::MAX)).contains(*i) || i.fract() != 0.0) {
            return Err(format!("face {face} has the vertex index {index}"));
        }
        let fan = 1..corners.len().max(2) - 1;
        mesh.triangles.extend(fan.clone().map(|i| [0, i, i + 1].map(|c| corners[c] as u32)));
        if places.len() == 2 * corners.len() {
            texture.extend(fan.map(|i| [0, i, i + 1].map(|c| [places[2 * c] as f32, places[2 * c + 1] as f32])));
        }
    }
    Ok(())
}

/// The numbers of a list property.
fn read_list(property: &Property, numbers: &mut dyn Numbers, list: &mut Vec<f64>) -> Result<(), String> {
    let Some(count) = property.list_count else { return Ok(()) };
    for _ in 0..list_length(count, numbers)? {
        list.push(numbers.next(property.scalar)?);
    }
    Ok(())
}

/// Reads over an element.
pub(super) fn skip(element: &Element, numbers: &mut dyn Numbers) -> Result<(), String> {
    for _ in 0..element.count {
        for property in &element.properties {
            read_value(property, numbers)?;
        }
    }
    Ok(())
}
