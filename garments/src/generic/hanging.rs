//! Cloth added below the lower rim of a generic garment: it hangs around both legs.

use nalgebra::{Point2, Point3};
use toile_geometry::{Mesh, topology::boundary_loops};

/// Height of a row of added cloth, metres; the mesh is made even afterwards.
const ROW: f32 = 0.02;
/// Vertices this near to the line were cut at it, metres: a cut keeps away from the ends of edges.
const AT_LINE: f32 = 0.02;
/// Skin this much above or below a row holds it off, metres: half a row and what the body's triangles span.
const SLICE: f32 = 0.03;

/// Adds rows of cloth from the rim at height `from` down to height `to`, around the vertical `axis`; each row is as wide as the one
/// above and what of the body `skin` lies in it, plus `flare` (metres a metre).
pub(super) fn hang(mesh: &mut Mesh, skin: &[Point3<f32>], axis: &Point3<f32>, from: f32, to: f32, flare: f32) {
    let rows = ((from - to) / ROW).ceil().max(0.0) as usize;
    let is_at = |v: u32, mesh: &Mesh| (mesh.positions[v as usize].y - from).abs() < AT_LINE;
    // The edges of an opening in front stand upright.
    let is_level = |[a, b]: &[u32; 2], mesh: &Mesh| {
        let side = mesh.positions[*b as usize] - mesh.positions[*a as usize];
        side.y.abs() < side.x.hypot(side.z)
    };
    let mut edges = Vec::new();
    for cycle in boundary_loops(&mesh.triangles) {
        let sides = (0..cycle.len()).map(|i| [cycle[i], cycle[(i + 1) % cycle.len()]]);
        edges.extend(sides.filter(|side| side.iter().all(|&v| is_at(v, mesh)) && is_level(side, mesh)));
    }
    let mut columns: Vec<u32> = edges.iter().flatten().copied().collect();
    columns.sort_unstable();
    columns.dedup();
    let flat = |p: &Point3<f32>| Point2::new(p.x - axis.x, p.z - axis.z);
    let ways: Vec<_> = columns.iter().map(|&v| flat(&mesh.positions[v as usize]).coords.normalize()).collect();
    let mut radii: Vec<f32> = columns.iter().map(|&v| flat(&mesh.positions[v as usize]).coords.norm()).collect();
    let mut above = columns.clone();
    for row in 1..=rows {
        let y = from - (from - to) * row as f32 / rows as f32;
        let slice: Vec<Point2<f32>> = skin.iter().filter(|p| (p.y - y).abs() < SLICE).map(flat).collect();
        let start = mesh.positions.len() as u32;
        for (radius, way) in radii.iter_mut().zip(&ways) {
            let held = slice.iter().map(|q| q.coords.dot(way)).fold(0.0, f32::max);
            *radius = held.max(*radius) + flare * ROW;
            mesh.positions.push(Point3::new(axis.x + way.x * *radius, y, axis.z + way.y * *radius));
        }
        let below = |v: u32| start + columns.binary_search(&v).unwrap_or(0) as u32;
        let old = |v: u32| above[columns.binary_search(&v).unwrap_or(0)];
        for [a, b] in &edges {
            mesh.triangles.push([old(*b), old(*a), below(*a)]);
            mesh.triangles.push([old(*b), below(*a), below(*b)]);
        }
        above = (start..mesh.positions.len() as u32).collect();
    }
}
