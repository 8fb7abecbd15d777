//! Triangles of glTF's meshes.

use nalgebra::{Matrix4, Point3};

use super::{
    accessors::File,
    json::Primitive,
    looks::{coordinate_set, srgb},
    nodes::Placed,
};
use crate::Surface;

/// Where positions become the scene's: by one matrix, or each by its own.
enum Moves {
    Rigid(Matrix4<f64>),
    Skinned(Vec<Matrix4<f64>>),
}

/// Appends the triangles of a placed mesh.
pub(super) fn append(file: &File, placed: &Placed, surface: &mut Surface) -> Result<(), String> {
    let missing = || format!("mesh {} is missing", placed.mesh);
    let mesh = file.root.meshes.get(placed.mesh).ok_or_else(missing)?;
    for primitive in &mesh.primitives {
        if matches!(primitive.mode, 4..=6) {
            append_primitive(file, placed, primitive, surface)?;
        } else {
            surface.notices.push(format!("mesh {} holds points or lines, which are left out", placed.mesh));
        }
    }
    Ok(())
}

fn append_primitive(file: &File, placed: &Placed, primitive: &Primitive, surface: &mut Surface) -> Result<(), String> {
    let attribute = |name: &str| primitive.attributes.get(name).copied();
    let position = attribute("POSITION").ok_or_else(|| format!("mesh {} has no positions", placed.mesh))?;
    let positions: Vec<[f32; 3]> = file.floats(position)?;
    let moves = moves(file, placed, primitive, positions.len())?;
    let first = surface.positions.len();
    surface.positions.extend(positions.iter().enumerate().map(|(v, p)| moves.apply(v, p)));
    let count = positions.len();
    let indices = match primitive.indices {
        Some(index) => file.whole::<1>(index)?.into_iter().map(|[i]| i).collect(),
        None => (0..count as u32).collect::<Vec<u32>>(),
    };
    if indices.iter().any(|&i| i as usize >= count) {
        return Err(format!("mesh {} has a triangle with a vertex beyond the last of {count}", placed.mesh));
    }
    let triangles = triangles(&indices, primitive.mode);
    let material = primitive.material.and_then(|m| file.root.materials.get(m));
    let places = match attribute(&format!("TEXCOORD_{}", coordinate_set(material))) {
        Some(index) => file.floats::<2>(index)?,
        None => Vec::new(),
    };
    let place = |v: u32| places.get(v as usize).copied().unwrap_or_default();
    surface.texture_coordinates.extend(triangles.iter().map(|t| t.map(place)));
    let nothing = surface.materials.len() - 1;
    let index = primitive.material.filter(|&m| m < nothing).unwrap_or(nothing) as u32;
    surface.material_of.extend(triangles.iter().map(|_| index));
    append_colors(file, attribute("COLOR_0"), first, count, surface)?;
    surface.triangles.extend(triangles.iter().map(|t| t.map(|v| v + first as u32)));
    Ok(())
}

/// Vertex colours, which are there for the whole surface or are dropped: a part without them is told by the length.
fn append_colors(
    file: &File,
    index: Option<usize>,
    first: usize,
    count: usize,
    surface: &mut Surface,
) -> Result<(), String> {
    let Some(index) = index.filter(|_| surface.colors.len() == first) else { return Ok(()) };
    let linear: Vec<[f32; 3]> = match file.components(index) {
        4 => file.floats::<4>(index)?.into_iter().map(|[r, g, b, _]| [r, g, b]).collect(),
        _ => file.floats(index)?,
    };
    if linear.len() == count {
        surface.colors.extend(linear.into_iter().map(|color| color.map(srgb)));
    }
    Ok(())
}

fn triangles(indices: &[u32], mode: u32) -> Vec<[u32; 3]> {
    match mode {
        4 => indices.as_chunks::<3>().0.to_vec(),
        // Every second triangle of a strip runs the other way round.
        5 => (0..indices.len().saturating_sub(2))
            .map(|i| {
                if i % 2 == 0 {
                    [indices[i], indices[i + 1], indices[i + 2]]
                } else {
                    [indices[i + 1], indices[i], indices[i + 2]]
                }
            })
            .collect(),
        _ => (1..indices.len().max(2) - 1).map(|i| [indices[0], indices[i], indices[i + 1]]).collect(),
    }
}

fn moves(file: &File, placed: &Placed, primitive: &Primitive, count: usize) -> Result<Moves, String> {
    let attribute = |name: &str| primitive.attributes.get(name).copied();
    let (Some((index, joints)), Some(of), Some(by)) = (&placed.skin, attribute("JOINTS_0"), attribute("WEIGHTS_0"))
    else {
        return Ok(Moves::Rigid(placed.transform));
    };
    let bind: Vec<[f32; 16]> = match file.root.skins[*index].inverse_bind_matrices {
        Some(accessor) => file.floats(accessor)?,
        None => Vec::new(),
    };
    let from_rest = |(j, joint): (usize, &Matrix4<f64>)| match bind.get(j) {
        Some(inverse) => joint * Matrix4::from_column_slice(&inverse.map(f64::from)),
        None => *joint,
    };
    let joints: Vec<Matrix4<f64>> = joints.iter().enumerate().map(from_rest).collect();
    let (of, by): (Vec<[u32; 4]>, Vec<[f32; 4]>) = (file.whole(of)?, file.floats(by)?);
    if of.len() != count || by.len() != count || of.as_flattened().iter().any(|&j| j as usize >= joints.len()) {
        return Err(format!("skin {index} does not fit its mesh"));
    }
    let blend = |(of, by): (&[u32; 4], &[f32; 4])| -> Matrix4<f64> {
        let total: f32 = by.iter().sum();
        let sum: Matrix4<f64> = of.iter().zip(by).map(|(&j, &w)| joints[j as usize] * f64::from(w)).sum();
        if total > 0.0 { sum / f64::from(total) } else { placed.transform }
    };
    Ok(Moves::Skinned(of.iter().zip(&by).map(blend).collect()))
}

impl Moves {
    fn apply(&self, v: usize, p: &[f32; 3]) -> Point3<f32> {
        let matrix = match self {
            Self::Rigid(matrix) => matrix,
            Self::Skinned(each) => &each[v],
        };
        matrix.transform_point(&Point3::from(p.map(f64::from))).cast()
    }
}
