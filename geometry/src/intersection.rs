//! Triangles of two meshes, or of one, that cut through one another; decided with exact signs.

mod fans;

use nalgebra::Point3;
use rayon::prelude::*;

use crate::{Mesh, bvh::Bvh, predicates::orientation};

/// Triangles in a parallel chunk.
const CHUNK: usize = 1024;

/// True where triangles `x` and `y` properly cross: an edge of one passes through the other. Triangles that only touch do not cross.
pub fn triangles_cross(x: &[Point3<f32>; 3], y: &[Point3<f32>; 3]) -> bool {
    // Nothing passes through the plane of a triangle that the other lies beside.
    let sides = |[a, b, c]: &[Point3<f32>; 3], other: &[Point3<f32>; 3]| other.map(|p| orientation(a, b, c, &p));
    let of_y = sides(x, y);
    if of_y.iter().all(|&s| s > 0) || of_y.iter().all(|&s| s < 0) {
        return false;
    }
    let of_x = sides(y, x);
    let passes = |k: usize, sides: &[i8; 3], of: &[Point3<f32>; 3], through: &[Point3<f32>; 3]| {
        let l = (k + 1) % 3;
        sides[k] * sides[l] < 0 && line_meets(&of[k], &of[l], through)
    };
    (0..3).any(|k| passes(k, &of_x, x, y) || passes(k, &of_y, y, x))
}

/// True where the open segment `pq` passes through triangle `t` (its rim counts, its plane does not).
pub fn segment_crosses(p: &Point3<f32>, q: &Point3<f32>, t: &[Point3<f32>; 3]) -> bool {
    let [a, b, c] = t;
    if orientation(a, b, c, p) * orientation(a, b, c, q) >= 0 {
        return false;
    }
    line_meets(p, q, t)
}

/// True where the line through `p` and `q` meets triangle `t` or its rim.
fn line_meets(p: &Point3<f32>, q: &Point3<f32>, [a, b, c]: &[Point3<f32>; 3]) -> bool {
    let signs = [(a, b), (b, c), (c, a)].map(|(u, v)| orientation(p, q, u, v));
    signs.iter().all(|&s| s >= 0) || signs.iter().all(|&s| s <= 0)
}

/// All pairs (triangle of `a`, triangle of `b`) that cross, ascending. The hierarchies are built over `a` and `b`.
pub fn crossings(a: &Mesh, bvh_a: &Bvh, b: &Mesh, bvh_b: &Bvh) -> Vec<[u32; 2]> {
    bvh_a.pairs_with(bvh_b, |t, u| triangles_cross(&a.corners(t as usize), &b.corners(u as usize)))
}

/// All pairs of triangles of one mesh that cross, ascending. Pairs that share an edge are skipped; of pairs that share
/// a vertex the opposite edges are tested.
pub fn self_crossings(mesh: &Mesh, bvh: &Bvh) -> Vec<[u32; 2]> {
    let open = fans::lie_open(mesh);
    bvh.pairs_within(|t, u| {
        let (x, y) = (mesh.triangles[t as usize], mesh.triangles[u as usize]);
        !x.iter().any(|&v| open[v as usize] && y.contains(&v)) && pair_crosses(mesh, t, u)
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
    let (mut shared, mut count) = ((0, 0), 0);
    for (i, v) in ti.iter().enumerate() {
        if let Some(j) = ui.iter().position(|u| u == v) {
            (shared, count) = ((i, j), count + 1);
        }
    }
    let (i, j) = shared;
    match count {
        0 => triangles_cross(&x, &y),
        1 => {
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

    #[test]
    fn a_crumpled_sheet_crosses_itself_where_its_pairs_do() {
        let (n, mut seed) = (14u32, 3u32);
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 16_777_216.0
        };
        // Shifted by up to half and up to three of its edges, so that some triangles are turned over and others lie open.
        let mut at = |v: u32| {
            let shift = if v / n < n / 2 { 0.5 } else { 3.0 };
            Point3::new((v % n) as f32 + shift * random(), shift * random(), (v / n) as f32 + shift * random())
        };
        let positions = (0..n * n).map(&mut at).collect();
        let cell = |q: u32| q / (n - 1) * n + q % (n - 1);
        let cut = |a: u32| [[a, a + n, a + 1], [a + 1, a + n, a + n + 1]];
        let mesh = Mesh::new(positions, (0..(n - 1) * (n - 1)).map(cell).flat_map(cut).collect());
        let count = mesh.triangles.len() as u32;
        let all = (0..count).flat_map(|t| (t + 1..count).map(move |u| [t, u]));
        let expected: Vec<[u32; 2]> = all.filter(|p| pair_crosses(&mesh, p[0], p[1])).collect();
        assert!(expected.len() > 50);
        assert!(fans::lie_open(&mesh).iter().filter(|open| **open).count() > 50);
        assert_eq!(self_crossings(&mesh, &Bvh::new(&mesh.positions, &mesh.triangles)), expected);
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
        let bvh = |mesh: &Mesh| Bvh::new(&mesh.positions, &mesh.triangles);
        let pairs = crossings(&spike, &bvh(&spike), &sheet, &bvh(&sheet));
        assert!(!pairs.is_empty());
        let mut both = sheet.clone();
        both.positions.extend(&spike.positions);
        both.triangles.push([4, 5, 6]);
        let own = self_crossings(&both, &Bvh::new(&both.positions, &both.triangles));
        assert_eq!(own.len(), pairs.len());
        assert!(self_crossings(&sheet, &Bvh::new(&sheet.positions, &sheet.triangles)).is_empty());
    }
}
