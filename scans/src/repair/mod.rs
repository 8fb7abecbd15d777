//! Repairs of a surface whose makers promised nothing.

mod ground;
mod orient;
mod refine;

pub(crate) use ground::cut_ground;
pub(crate) use orient::orient;
pub(crate) use refine::refine;

use std::collections::HashSet;

use nalgebra::Point3;
use toile_geometry::{Mesh, components::Piece};

/// A piece of at least this share of the largest one's area belongs to the person: a hand below a wide sleeve has 1 to 2 %.
const MIN_PIECE: f64 = 0.008;
/// A piece lower than this is a remnant of the ground, metres.
const FLAT: f32 = 0.06;
/// Twice the area of a triangle below which it has no direction, as a share of its longest side squared.
const DEGENERATE: f64 = 1e-7;

/// Leaves out triangles without area and all but the first of those with the same three vertices, whichever way round:
/// programs write both sides of a sheet. Gives how many of each kind there were.
pub(crate) fn drop_needless(mesh: &mut Mesh) -> [usize; 2] {
    let before = mesh.triangles.len();
    let positions = &mesh.positions;
    mesh.triangles.retain(|t| {
        let [a, b, c] = t.map(|v| positions[v as usize].cast::<f64>());
        let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
        (b - a).cross(&(c - a)).norm() > DEGENERATE * longest
    });
    let whole = mesh.triangles.len();
    let mut seen: HashSet<[u32; 3]> = HashSet::with_capacity(whole);
    mesh.triangles.retain(|t| {
        let mut sorted = *t;
        sorted.sort_unstable();
        seen.insert(sorted)
    });
    [before - whole, whole - mesh.triangles.len()]
}

/// The largest piece, and others that are large and not flat: legs below a skirt, hands below sleeves.
pub(crate) fn pieces_of_a_person(pieces: &[Piece]) -> Vec<bool> {
    let largest = pieces.iter().map(|p| p.area).fold(0.0, f64::max);
    let height = |p: &Piece| p.high.y - p.low.y;
    pieces.iter().map(|p| p.area >= largest || (p.area > MIN_PIECE * largest && height(p) > FLAT)).collect()
}

/// The middle of a surface: its area's centre.
pub(crate) fn middle(mesh: &Mesh) -> Point3<f64> {
    let areas = toile_geometry::areas::vertex_areas(mesh);
    let total: f64 = areas.iter().map(|&a| f64::from(a)).sum::<f64>().max(1e-12);
    let weighted = mesh.positions.iter().zip(&areas).map(|(p, &a)| p.coords.cast::<f64>() * f64::from(a));
    Point3::from(weighted.sum::<nalgebra::Vector3<f64>>() / total)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_sides_of_a_sheet_become_one_and_needles_go() {
        let p = |x: f32, y: f32| Point3::new(x, y, 0.0);
        let positions = vec![p(0.0, 0.0), p(1.0, 0.0), p(0.0, 1.0), p(2.0, 0.0)];
        let mut mesh = Mesh::new(positions, vec![[0, 1, 2], [2, 1, 0], [0, 1, 3], [1, 1, 2], [1, 3, 2]]);
        assert_eq!(drop_needless(&mut mesh), [2, 1]);
        assert_eq!(mesh.triangles, [[0, 1, 2], [1, 3, 2]]);
    }
}
