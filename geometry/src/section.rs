//! Plane sections of triangle meshes.

use nalgebra::{Point3, Vector3};

use crate::topology::vertex_components;

/// Points of each connected piece of the section of some triangles by the plane through `point` with unit `normal`. Where the
/// triangles have a rim, pieces are open.
pub fn section_pieces(
    positions: &[Point3<f32>],
    triangles: &[[u32; 3]],
    point: &Point3<f64>,
    normal: &Vector3<f64>,
) -> Vec<Vec<Point3<f64>>> {
    let heights: Vec<f64> = positions.iter().map(|p| (p.cast::<f64>() - point).dot(normal)).collect();
    let segments = crossed_edges(triangles, &heights);
    let mut edges: Vec<[u32; 2]> = segments.iter().flatten().copied().collect();
    edges.sort_unstable();
    edges.dedup();
    let index = |e: &[u32; 2]| edges.binary_search(e).unwrap_or(0) as u32;
    let links: Vec<[u32; 3]> = segments.iter().map(|[a, b]| [index(a), index(b), index(b)]).collect();
    let (labels, count) = vertex_components(edges.len(), &links);
    let mut pieces = vec![Vec::new(); count];
    for (&edge, label) in edges.iter().zip(labels) {
        pieces[label as usize].push(crossing(positions, edge, &heights));
    }
    pieces
}

/// The two edges of each triangle that the plane crosses.
fn crossed_edges(triangles: &[[u32; 3]], heights: &[f64]) -> Vec<[[u32; 2]; 2]> {
    let side = |v: u32| heights[v as usize] > 0.0;
    let mut segments = Vec::new();
    for t in triangles {
        if side(t[0]) == side(t[1]) && side(t[1]) == side(t[2]) {
            continue;
        }
        let mut crossed =
            (0..3).map(|k| [t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3])]).filter(|e| side(e[0]) != side(e[1]));
        if let (Some(a), Some(b)) = (crossed.next(), crossed.next()) {
            segments.push([a, b]);
        }
    }
    segments
}

fn crossing(positions: &[Point3<f32>], [a, b]: [u32; 2], heights: &[f64]) -> Point3<f64> {
    let (p, q) = (positions[a as usize].cast::<f64>(), positions[b as usize].cast::<f64>());
    let (h, k) = (heights[a as usize], heights[b as usize]);
    let t = if (h - k).abs() > 1e-12 { (h / (h - k)).clamp(0.0, 1.0) } else { 0.5 };
    p + (q - p) * t
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four walls around a square column of side 2 about `x`.
    fn column(x: f32, first: u32) -> (Vec<Point3<f32>>, Vec<[u32; 3]>) {
        let around = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let ring = |y: f32| around.map(|[a, b]: [f32; 2]| Point3::new(x + a, y, b));
        let wall = |k: u32| {
            let n = (k + 1) % 4;
            [[k, n, k + 4], [n, n + 4, k + 4]].map(|t| t.map(|v| v + first))
        };
        ([ring(0.0), ring(3.0)].concat(), (0..4).flat_map(wall).collect())
    }

    #[test]
    fn two_columns_give_two_pieces_on_their_walls() {
        let (mut positions, mut triangles) = column(0.0, 0);
        let (more, walls) = column(5.0, 8);
        positions.extend(more);
        triangles.extend(walls);
        let pieces = section_pieces(&positions, &triangles, &Point3::new(0.0, 1.0, 0.0), &Vector3::y());
        assert_eq!(pieces.len(), 2);
        for (piece, x) in pieces.iter().zip([0.0, 5.0]) {
            assert_eq!(piece.len(), 8);
            assert!(piece.iter().all(|p| (p.y - 1.0).abs() < 1e-9 && (p.x - x).abs().max(p.z.abs()) > 0.999));
        }
        assert!(section_pieces(&positions, &triangles, &Point3::new(0.0, 9.0, 0.0), &Vector3::y()).is_empty());
    }
}
