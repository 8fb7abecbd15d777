//! Triangles of two meshes, or of one, that cut through one another; decided with exact signs.

use nalgebra::Point3;
use rayon::prelude::*;

use crate::{Mesh, bvh::Bvh, predicates::orientation};

/// Triangles in a parallel chunk.
const CHUNK: usize = 1024;

/// True where triangles `x` and `y` properly cross: an edge of one passes through the other. Triangles that only touch do not cross.
pub fn triangles_cross(x: &[Point3<f32>; 3], y: &[Point3<f32>; 3]) -> bool {
    (0..3).any(|k| segment_crosses(&x[k], &x[(k + 1) % 3], y) || segment_crosses(&y[k], &y[(k + 1) % 3], x))
}

/// True where the open segment `pq` passes through triangle `t` (its rim counts, its plane does not).
pub fn segment_crosses(p: &Point3<f32>, q: &Point3<f32>, t: &[Point3<f32>; 3]) -> bool {
    let [a, b, c] = t;
    if orientation(a, b, c, p) * orientation(a, b, c, q) >= 0 {
        return false;
    }
    let signs = [(a, b), (b, c), (c, a)].map(|(u, v)| orientation(p, q, u, v));
    signs.iter().all(|&s| s >= 0) || signs.iter().all(|&s| s <= 0)
}

/// All pairs (triangle of `a`, triangle of `b`) that cross, ascending. `bvh_b` is built over `b`.
pub fn crossings(a: &Mesh, b: &Mesh, bvh_b: &Bvh) -> Vec<[u32; 2]> {
    crossings_among(a, &(0..a.triangles.len() as u32).collect::<Vec<_>>(), b, bvh_b)
}

/// As [`crossings`], for some of `a`'s triangles.
pub fn crossings_among(a: &Mesh, some: &[u32], b: &Mesh, bvh_b: &Bvh) -> Vec<[u32; 2]> {
    let of = |t: u32, found: &mut Vec<[u32; 2]>| {
        let x = a.corners(t as usize);
        visit_sorted(bvh_b, &x, |u| {
            if triangles_cross(&x, &b.corners(u as usize)) {
                found.push([t, u]);
            }
        });
    };
    collect(some, of)
}

/// All pairs of triangles of one mesh that cross, ascending. Pairs that share an edge are skipped; of pairs that share
/// a vertex the opposite edges are tested.
pub fn self_crossings(mesh: &Mesh, bvh: &Bvh) -> Vec<[u32; 2]> {
    let all: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    collect(&all, |t, found| {
        let x = mesh.corners(t as usize);
        visit_sorted(bvh, &x, |u| {
            if u > t && pair_crosses(mesh, t, u) {
                found.push([t, u]);
            }
        });
    })
}

/// As [`self_crossings`], for pairs of which at least one is among `some`.
pub fn self_crossings_among(mesh: &Mesh, some: &[u32], bvh: &Bvh) -> Vec<[u32; 2]> {
    let mut pairs = collect(some, |t, found| {
        let x = mesh.corners(t as usize);
        visit_sorted(bvh, &x, |u| {
            if u != t && pair_crosses(mesh, t, u) {
                found.push([t.min(u), t.max(u)]);
            }
        });
    });
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// True where two triangles of one mesh cross, as [`self_crossings`] judges a pair.
pub fn pair_crosses(mesh: &Mesh, t: u32, u: u32) -> bool {
    let (ti, ui) = (mesh.triangles[t as usize], mesh.triangles[u as usize]);
    let (x, y) = (mesh.corners(t as usize), mesh.corners(u as usize));
    let shared: Vec<(usize, usize)> =
        (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).filter(|&(i, j)| ti[i] == ui[j]).collect();
    match shared[..] {
        [] => triangles_cross(&x, &y),
        [(i, j)] => {
            segment_crosses(&x[(i + 1) % 3], &x[(i + 2) % 3], &y)
                || segment_crosses(&y[(j + 1) % 3], &y[(j + 2) % 3], &x)
        }
        _ => false,
    }
}

fn visit_sorted(bvh: &Bvh, x: &[Point3<f32>; 3], mut visit: impl FnMut(u32)) {
    let mut near = Vec::new();
    bvh.overlapping(&x[0].inf(&x[1]).inf(&x[2]), &x[0].sup(&x[1]).sup(&x[2]), |u| near.push(u));
    near.sort_unstable();
    near.into_iter().for_each(&mut visit);
}

fn collect(triangles: &[u32], of: impl Fn(u32, &mut Vec<[u32; 2]>) + Sync) -> Vec<[u32; 2]> {
    let parts: Vec<Vec<[u32; 2]>> = triangles
        .par_chunks(CHUNK)
        .map(|chunk| {
            let mut found = Vec::new();
            chunk.iter().for_each(|&t| of(t, &mut found));
            found
        })
        .collect();
    parts.concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossings_among_some_are_those_of_all_that_have_one_of_them() {
        let mut seed = 7u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 16_777_216.0
        };
        let positions = (0..120).map(|_| Point3::new(random(), random(), random())).collect();
        let mesh = Mesh::new(positions, (0..40).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect());
        let bvh = Bvh::new(&mesh.positions, &mesh.triangles);
        let some: Vec<u32> = (0..40).filter(|t| t % 3 == 0).collect();
        let all = self_crossings(&mesh, &bvh);
        let expected: Vec<[u32; 2]> = all.iter().filter(|p| p.iter().any(|t| t % 3 == 0)).copied().collect();
        assert!(expected.len() > 5 && expected.len() < all.len());
        assert_eq!(self_crossings_among(&mesh, &some, &bvh), expected);
    }

    fn triangle(p: [[f32; 3]; 3]) -> [Point3<f32>; 3] {
        p.map(Point3::from)
    }

    #[test]
    fn known_pairs() {
        let flat = triangle([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let through = triangle([[0.2, 0.2, -1.0], [0.2, 0.2, 1.0], [2.0, 2.0, 0.5]]);
        let above = triangle([[0.2, 0.2, 0.1], [0.2, 0.2, 1.0], [2.0, 2.0, 0.5]]);
        let touching = triangle([[0.2, 0.2, 0.0], [0.2, 0.2, 1.0], [2.0, 2.0, 0.5]]);
        let beside = triangle([[3.0, 0.2, -1.0], [3.0, 0.2, 1.0], [4.0, 2.0, 0.5]]);
        let coplanar = triangle([[0.1, 0.1, 0.0], [0.9, 0.1, 0.0], [0.1, 0.9, 0.0]]);
        let expected = [(through, true), (above, false), (touching, false), (beside, false), (coplanar, false)];
        for (i, (t, crosses)) in expected.iter().enumerate() {
            assert_eq!(triangles_cross(&flat, t), *crosses, "case {i}");
            assert_eq!(triangles_cross(t, &flat), *crosses, "case {i} swapped");
        }
    }

    #[test]
    fn a_tube_through_a_sheet_is_found_and_a_fold_finds_itself() {
        let sheet = Mesh::new(
            [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]].map(Point3::from).to_vec(),
            vec![[0, 1, 2], [0, 2, 3]],
        );
        let spike = Mesh::new(
            [[0.1, 0.2, -1.0], [0.3, 0.2, -1.0], [0.2, 0.25, 1.0]].map(Point3::from).to_vec(),
            vec![[0, 1, 2]],
        );
        let pairs = crossings(&spike, &sheet, &Bvh::new(&sheet.positions, &sheet.triangles));
        assert!(!pairs.is_empty());
        let mut both = sheet.clone();
        both.positions.extend(&spike.positions);
        both.triangles.push([4, 5, 6]);
        let own = self_crossings(&both, &Bvh::new(&both.positions, &both.triangles));
        assert_eq!(own.len(), pairs.len());
        assert!(self_crossings(&sheet, &Bvh::new(&sheet.positions, &sheet.triangles)).is_empty());
    }
}
