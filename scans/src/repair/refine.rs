//! Long edges split, so that a coarse surface has vertices enough for the colours of its pictures.

use toile_geometry::{Mesh, topology::Edges};

/// Rounds after which it ends in any case: each halves the longest edge.
const ROUNDS: usize = 14;

/// Splits edges longer than `longest` in their middle, round by round, until there are none or the mesh has `most` triangles.
/// The surface stays where it is; positions alone are kept.
pub(crate) fn refine(mut mesh: Mesh, longest: f32, most: usize) -> Mesh {
    for _ in 0..ROUNDS {
        let edges = Edges::new(&mesh.triangles);
        let length = |[a, b]: [u32; 2]| (mesh.positions[b as usize] - mesh.positions[a as usize]).norm();
        let mut middle_of = vec![u32::MAX; edges.vertices.len()];
        let mut positions = mesh.positions.clone();
        for (e, ends) in edges.vertices.iter().enumerate() {
            if length(*ends) > longest {
                middle_of[e] = positions.len() as u32;
                positions.push(nalgebra::center(&mesh.positions[ends[0] as usize], &mesh.positions[ends[1] as usize]));
            }
        }
        let added = positions.len() - mesh.positions.len();
        if added == 0 || mesh.triangles.len() + 2 * added > most {
            break;
        }
        let mut triangles = Vec::with_capacity(mesh.triangles.len() + 2 * added);
        for (t, corners) in mesh.triangles.iter().enumerate() {
            let middles = edges.of_triangle[t].map(|e| middle_of[e as usize]);
            split(*corners, middles, &positions, &mut triangles);
        }
        mesh = Mesh::new(positions, triangles);
    }
    mesh
}

/// The parts of a triangle whose side k, from corner k to the next, has a middle (or `u32::MAX`).
fn split(corners: [u32; 3], middles: [u32; 3], positions: &[nalgebra::Point3<f32>], out: &mut Vec<[u32; 3]>) {
    let count = middles.iter().filter(|&&m| m != u32::MAX).count();
    // Turned so that the sides with a middle, or the only one without, come first.
    let first = (0..3).find(|&k| match count {
        1 => middles[k] != u32::MAX,
        2 => middles[k] == u32::MAX,
        _ => true,
    });
    let k = first.unwrap_or(0);
    let [a, b, c] = [0, 1, 2].map(|i| corners[(k + i) % 3]);
    let [ab, bc, ca] = [0, 1, 2].map(|i| middles[(k + i) % 3]);
    match count {
        0 => out.push([a, b, c]),
        1 => out.extend([[a, ab, c], [ab, b, c]]),
        2 => {
            out.push([bc, c, ca]);
            let length = |p: u32, q: u32| (positions[q as usize] - positions[p as usize]).norm_squared();
            // The shorter diagonal of the rest.
            out.extend(if length(a, bc) < length(b, ca) {
                [[a, b, bc], [a, bc, ca]]
            } else {
                [[a, b, ca], [b, bc, ca]]
            });
        }
        _ => out.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    #[test]
    fn edges_become_short_and_the_surface_stays_closed_with_its_volume() {
        let p = |x, y, z| Point3::new(x, y, z);
        let tetrahedron = Mesh::new(
            vec![p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.0), p(0.0, 0.3, 0.0), p(0.0, 0.0, 2.0)],
            vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        );
        let fine = refine(tetrahedron.clone(), 0.1, usize::MAX);
        let edges = Edges::new(&fine.triangles);
        let longest =
            edges.vertices.iter().map(|[a, b]| (fine.positions[*a as usize] - fine.positions[*b as usize]).norm());
        assert!(longest.fold(0.0, f32::max) <= 0.1 && edges.is_closed());
        assert!((fine.signed_volume() - tetrahedron.signed_volume()).abs() < 1e-6);
        assert!((fine.area() - tetrahedron.area()).abs() < 1e-5);
        assert_eq!(refine(tetrahedron, 0.1, 30).triangles.len(), 16, "it stays below the largest number");
    }
}
