//! Extraction of the zero surface: marching cubes with shared vertices, colours and weights.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_geometry::Mesh;

use super::{
    block::{SIDE, VOXELS, Voxel, WEIGHT_ONE, local_index},
    block_index::NONE,
    cube_table::{EDGES, TRIANGLES},
    tsdf::Tsdf,
};

/// Name of the vertex attribute that holds the sum of measurement weights.
pub const WEIGHT: &str = "weight";

/// Corner values of one block and the first layer of its neighbours: 9³.
const PADDED: usize = SIDE + 1;

/// Vertices and triangles of one block before numbering; a vertex is known by its voxel and axis.
#[derive(Default)]
struct Piece {
    /// Vertices on edges that this block owns, ascending keys.
    owned: Vec<(u16, Point3<f32>, [u8; 3], f32)>,
    /// Triangle corners as (block offset code, key).
    triangles: Vec<[(u8, u16); 3]>,
}

/// The zero surface where every corner of a cell has at least `min_weight`. Counter-clockwise from outside, vertices
/// shared, with normals, colours (where the field has them) and the attribute `WEIGHT`.
pub fn extract_surface(tsdf: &Tsdf, min_weight: u16) -> Mesh {
    tidy(&crossings(tsdf, min_weight))
}

/// The first half of [`extract_surface`]; the field may go before the second, [`tidy`].
pub(crate) fn crossings(tsdf: &Tsdf, min_weight: u16) -> Mesh {
    let pieces: Vec<Piece> =
        (0..tsdf.block_count()).into_par_iter().map(|slot| piece(tsdf, slot, min_weight)).collect();
    let mut starts = Vec::with_capacity(pieces.len());
    let mut total = 0;
    for piece in &pieces {
        starts.push(total);
        total += piece.owned.len();
    }
    let mut mesh = Mesh::default();
    let mut weights = Vec::with_capacity(total);
    mesh.positions.reserve_exact(total);
    for piece in &pieces {
        for (_, p, color, weight) in &piece.owned {
            mesh.positions.push(*p);
            weights.push(*weight);
            if tsdf.has_color() {
                mesh.colors.push(*color);
            }
        }
    }
    let number = |slot: usize, corner: (u8, u16)| {
        let c = tsdf.coords[slot];
        let offset = [i32::from(corner.0 & 1), i32::from(corner.0 >> 1 & 1), i32::from(corner.0 >> 2)];
        let owner = tsdf.slot([c[0] + offset[0], c[1] + offset[1], c[2] + offset[2]]);
        let piece = pieces.get(owner as usize)?;
        let k = piece.owned.binary_search_by_key(&corner.1, |v| v.0).ok()?;
        Some((starts[owner as usize] + k) as u32)
    };
    mesh.triangles = (0..pieces.len())
        .into_par_iter()
        .map(|slot| {
            let corners = |t: &[(u8, u16); 3]| Some([number(slot, t[0])?, number(slot, t[1])?, number(slot, t[2])?]);
            pieces[slot].triangles.iter().filter_map(corners).collect::<Vec<_>>()
        })
        .flatten_iter()
        .collect();
    mesh.attributes.insert(WEIGHT.into(), weights);
    mesh
}

/// Vertices on edges without any complete cell have no triangle: drops them and sets normals.
pub(crate) fn tidy(mesh: &Mesh) -> Mesh {
    let (mut mesh, _) = mesh.filter_triangles(|_| true);
    mesh.recompute_normals();
    mesh
}

fn piece(tsdf: &Tsdf, slot: usize, min_weight: u16) -> Piece {
    let mut piece = Piece::default();
    let block = &tsdf.blocks[slot];
    if !block.has_inside() && !borders_inside(tsdf, slot) {
        return piece;
    }
    let (values, weights) = padded(tsdf, slot);
    let corner = |x: usize, y: usize, z: usize| (z * PADDED + y) * PADDED + x;
    for z in 0..SIDE {
        for y in 0..SIDE {
            for x in 0..SIDE {
                let at = corner(x, y, z);
                for (axis, step) in [1, PADDED, PADDED * PADDED].into_iter().enumerate() {
                    let (a, b) = (at, at + step);
                    if weights[a] >= min_weight && weights[b] >= min_weight && (values[a] <= 0.0) != (values[b] <= 0.0)
                    {
                        let t = values[a] / (values[a] - values[b]);
                        piece.owned.push(vertex(tsdf, slot, [x, y, z], axis, t));
                    }
                }
                cell(&mut piece, &values, &weights, [x, y, z], min_weight);
            }
        }
    }
    piece
}

/// True where the first layer of the next blocks holds inside voxels, so that this block's last cells may cross.
fn borders_inside(tsdf: &Tsdf, slot: usize) -> bool {
    let c = tsdf.coords[slot];
    (1..8).any(|code| {
        let next = tsdf.slot([c[0] + (code & 1), c[1] + (code >> 1 & 1), c[2] + (code >> 2)]);
        next != NONE && tsdf.blocks[next as usize].has_inside()
    })
}

fn padded(tsdf: &Tsdf, slot: usize) -> (Vec<f32>, Vec<u16>) {
    let c = tsdf.coords[slot];
    let around: Vec<u32> = (0..8).map(|k| tsdf.slot([c[0] + (k & 1), c[1] + (k >> 1 & 1), c[2] + (k >> 2)])).collect();
    let mut values = Vec::with_capacity(PADDED.pow(3));
    let mut weights = Vec::with_capacity(PADDED.pow(3));
    for z in 0..PADDED {
        for y in 0..PADDED {
            for x in 0..PADDED {
                let code = usize::from(x == SIDE) | usize::from(y == SIDE) << 1 | usize::from(z == SIDE) << 2;
                let voxel = match around[code] {
                    NONE => Voxel::default(),
                    s => tsdf.blocks[s as usize].voxel(local_index([x as i32, y as i32, z as i32])),
                };
                values.push(f32::from(voxel.sdf));
                weights.push(voxel.weight);
            }
        }
    }
    (values, weights)
}

fn vertex(tsdf: &Tsdf, slot: usize, v: [usize; 3], axis: usize, t: f32) -> (u16, Point3<f32>, [u8; 3], f32) {
    let key = ((v[2] * 64 + v[1] * 8 + v[0]) * 3 + axis) as u16;
    let base: [i32; 3] = std::array::from_fn(|k| tsdf.coords[slot][k] * SIDE as i32 + v[k] as i32);
    let mut end = base;
    end[axis] += 1;
    let mut p = Vector3::new(base[0] as f32, base[1] as f32, base[2] as f32);
    p[axis] += t;
    let weight = f32::from(tsdf.voxel(base).weight.min(tsdf.voxel(end).weight)) / WEIGHT_ONE;
    (key, Point3::from(p * tsdf.voxel_size()), color_between(tsdf, base, end, t), weight)
}

fn color_between(tsdf: &Tsdf, a: [i32; 3], b: [i32; 3], t: f32) -> [u8; 3] {
    let at = |v: [i32; 3]| match tsdf.slot(v.map(|c| c >> 3)) {
        slot if slot != NONE && tsdf.has_color() => tsdf.colors[slot as usize].voxel(local_index(v)),
        _ => [0; 4],
    };
    let (a, b) = (at(a), at(b));
    let (wa, wb) = match (a[3], b[3]) {
        (0, 0) => return [0; 3],
        (_, 0) => (1.0, 0.0),
        (0, _) => (0.0, 1.0),
        _ => (1.0 - t, t),
    };
    std::array::from_fn(|k| ((f32::from(a[k]) * wa + f32::from(b[k]) * wb) / 256.0).round().clamp(0.0, 255.0) as u8)
}

fn cell(piece: &mut Piece, values: &[f32], weights: &[u16], v: [usize; 3], min_weight: u16) {
    let mut pattern = 0;
    for k in 0..8 {
        let at = ((v[2] + (k >> 2)) * PADDED + v[1] + (k >> 1 & 1)) * PADDED + v[0] + (k & 1);
        if weights[at] < min_weight || weights[at] == 0 {
            return;
        }
        pattern |= usize::from(values[at] <= 0.0) << k;
    }
    for t in &TRIANGLES[pattern] {
        piece.triangles.push(t.map(|e| owner(v, e as usize)));
    }
}

/// The block offset code and key of the vertex on edge `e` of cell `v`.
fn owner(v: [usize; 3], e: usize) -> (u8, u16) {
    let k = EDGES[e][0];
    let axis = e / 4;
    let g = [v[0] + (k & 1), v[1] + (k >> 1 & 1), v[2] + (k >> 2)];
    let code = (g[0] / SIDE) | (g[1] / SIDE) << 1 | (g[2] / SIDE) << 2;
    let l = g.map(|c| c % SIDE);
    (code as u8, ((l[2] * 64 + l[1] * 8 + l[0]) * 3 + axis) as u16)
}

const _: () = assert!(VOXELS * 3 < u16::MAX as usize);
