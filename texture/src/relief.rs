//! The relief of a surface as a normal map for a simpler one that lies at the same places of the picture.

use nalgebra::Vector3;

use crate::{Atlas, pad::pad, raster};

/// The normals of a surface where its triangles lie in a picture.
#[derive(Debug, Clone, Copy)]
pub struct Shape<'a> {
    /// Place of each vertex in the picture: 0 to 1 to the right and downwards.
    pub uv: &'a [[f32; 2]],
    /// Unit normal of each.
    pub normals: &'a [Vector3<f32>],
    /// Triangles.
    pub triangles: &'a [[u32; 3]],
}

/// The normal map of `size` texels (a power of two) that gives the surface `simple` the normals of `fine`: linear, row by row; directions from -1 to 1 as
/// 0 to 255, +X along `tangents`, +Z along the normal, as glTF has them. `tangents` are those of the vertices of `simple`, with the sign of the third axis.
///
/// Both surfaces lie at the same places of the picture, so that a texel's normal is that of the point whose colour it has; nothing is searched for. Between
/// charts are the nearest ones' values.
pub fn relief(fine: &Shape, simple: &Shape, tangents: &[[f32; 4]], size: u32) -> Vec<[u8; 3]> {
    let edge = size as usize;
    let mut normals = vec![[0u8; 4]; edge * edge];
    let corners = |shape: &Shape, t: usize| shape.triangles[t].map(|v| shape.normals[v as usize]);
    let of_fine = |t: usize| corners(fine, t);
    raster::draw(&flat(fine, size), &mut normals, of_fine, |n, w, texel| *texel = coded(mixed(n, w)));
    let normals = pad(normals, edge);
    let mut texels: Vec<([u8; 3], [u8; 4])> = normals.into_iter().map(|n| (n, [0; 4])).collect();
    let frame = |t: usize| {
        let along = simple.triangles[t].map(|v| tangents[v as usize]);
        (corners(simple, t), along.map(|[x, y, z, _]| Vector3::new(x, y, z)), along[0][3])
    };
    raster::draw(&flat(simple, size), &mut texels, frame, |(n, along, sign), w, (fine, texel)| {
        // As a renderer does it (MikkTSpace): interpolated, not made of unit length.
        let (up, along) = (mixed(n, w), mixed(along, w));
        let across = up.cross(&along) * *sign;
        let wanted = decoded(*fine);
        let inverse = nalgebra::Matrix3::from_columns(&[along, across, up]).try_inverse();
        *texel = coded(inverse.map_or_else(Vector3::z, |inverse| inverse * wanted));
    });
    pad(texels.into_iter().map(|(_, texel)| texel).collect(), edge)
}

fn mixed(n: &[Vector3<f32>; 3], w: [f32; 3]) -> Vector3<f32> {
    n[0] * w[0] + n[1] * w[1] + n[2] * w[2]
}

/// The triangles as an atlas that can be drawn.
fn flat(shape: &Shape, size: u32) -> Atlas {
    Atlas { size, source: Vec::new(), uv: shape.uv.to_vec(), triangles: shape.triangles.to_vec(), charts: 0 }
}

fn coded(n: Vector3<f32>) -> [u8; 4] {
    let unit = n.try_normalize(1e-12).unwrap_or_else(Vector3::z);
    let [x, y, z] = [unit.x, unit.y, unit.z].map(|c| (c * 127.5 + 127.5).round().clamp(0.0, 255.0) as u8);
    [x, y, z, 255]
}

fn decoded(texel: [u8; 3]) -> Vector3<f32> {
    Vector3::from(texel.map(|c| (f32::from(c) - 127.5) / 127.5))
}
