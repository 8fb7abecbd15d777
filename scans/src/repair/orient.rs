//! Triangles that all face outward.

use nalgebra::Point3;
use toile_geometry::{Mesh, topology::Edges};

/// Turns triangles so that neighbours agree and every connected piece encloses a positive volume, seen from its own middle
/// (which works with holes, too). The mesh must be a manifold up to the directions of its triangles. Gives how many were
/// turned.
pub(crate) fn orient(mesh: &mut Mesh) -> usize {
    let edges = Edges::new(&mesh.triangles);
    let at_edge = edges.triangles();
    let mut turned = vec![None; mesh.triangles.len()];
    let mut count = 0;
    for seed in 0..mesh.triangles.len() {
        if turned[seed].is_some() {
            continue;
        }
        turned[seed] = Some(false);
        let mut piece = vec![seed];
        let mut next = 0;
        while let Some(&t) = piece.get(next) {
            next += 1;
            for &e in &edges.of_triangle[t] {
                if edges.uses[e as usize] != 2 {
                    continue;
                }
                let [a, b] = at_edge[e as usize];
                let other = if a as usize == t { b } else { a } as usize;
                if turned[other].is_none() {
                    let agrees = runs_up(&mesh.triangles[t], edges.vertices[e as usize])
                        != runs_up(&mesh.triangles[other], edges.vertices[e as usize]);
                    turned[other] = Some(turned[t] == Some(agrees));
                    piece.push(other);
                }
            }
        }
        let faces_inward = volume(mesh, &piece, &turned) < 0.0;
        for &t in &piece {
            if (turned[t] == Some(true)) != faces_inward {
                mesh.triangles[t].swap(1, 2);
                count += 1;
            }
        }
    }
    count
}

/// Whether a triangle passes an edge from its smaller to its larger vertex.
fn runs_up(triangle: &[u32; 3], [low, high]: [u32; 2]) -> bool {
    (0..3).any(|k| triangle[k] == low && triangle[(k + 1) % 3] == high)
}

/// Six times the signed volume that a piece encloses with its middle, some of its triangles turned.
fn volume(mesh: &Mesh, piece: &[usize], turned: &[Option<bool>]) -> f64 {
    let corners = |t: usize| mesh.corners(t).map(Point3::cast::<f64>);
    let sum =
        piece.iter().fold(Point3::origin(), |sum: Point3<f64>, &t| corners(t).iter().fold(sum, |s, p| s + p.coords));
    let middle = sum / (3 * piece.len()).max(1) as f64;
    let enclosed = |&t: &usize| {
        let [a, b, c] = corners(t).map(|p| p - middle);
        a.dot(&b.cross(&c)) * if turned[t] == Some(true) { -1.0 } else { 1.0 }
    };
    piece.iter().map(enclosed).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of twelve triangles from `low` to `low + 1`.
    pub(crate) fn cube(low: f32) -> Mesh {
        let positions = (0..8).map(|k| {
            Point3::new((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2) as f32) + nalgebra::Vector3::repeat(low)
        });
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        Mesh::new(positions.collect(), quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect())
    }

    #[test]
    fn mixed_and_inward_pieces_face_outward() {
        let outward = cube(0.0);
        assert!((outward.signed_volume() - 1.0).abs() < 1e-6);
        for flips in [0b0000_0000_0000, 0b1111_1111_1111, 0b0101_0011_0110, 0b0000_0000_0001_u32] {
            let mut mesh = outward.clone();
            let second = cube(5.0);
            mesh.triangles.extend(second.triangles.iter().map(|t| t.map(|v| v + 8)));
            mesh.positions.extend(&second.positions);
            (0..12).filter(|t| flips >> t & 1 == 1).for_each(|t| mesh.triangles[t].swap(0, 1));
            assert_eq!(orient(&mut mesh), flips.count_ones() as usize);
            assert!((mesh.signed_volume() - 2.0).abs() < 1e-3, "{flips:b}");
        }
    }

    #[test]
    fn a_hole_does_not_matter() {
        let mut mesh = cube(0.0).filter_triangles(|t| t != 3).0;
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        assert_eq!(orient(&mut mesh), 11);
    }
}
