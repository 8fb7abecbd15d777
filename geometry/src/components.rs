//! Connected pieces of a mesh and repairs that make it a manifold.

use nalgebra::Point3;

use crate::{
    Mesh,
    topology::{Edges, VertexTriangles, vertex_components},
};

/// A connected piece of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Square metres.
    pub area: f64,
    /// Lowest coordinates.
    pub low: Point3<f32>,
    /// Highest coordinates.
    pub high: Point3<f32>,
}

/// The connected piece with the largest area, and the number of pieces before.
pub fn largest_component(mesh: &Mesh) -> (Mesh, usize) {
    keep_components(mesh, |pieces| {
        let largest = pieces.iter().map(|p| p.area).fold(0.0, f64::max);
        let first = pieces.iter().position(|p| p.area == largest);
        (0..pieces.len()).map(|i| Some(i) == first).collect()
    })
}

/// Keeps the connected pieces for which `choose` holds; also returns the number of pieces before.
pub fn keep_components(mesh: &Mesh, choose: impl FnOnce(&[Piece]) -> Vec<bool>) -> (Mesh, usize) {
    let (label, count) = vertex_components(mesh.positions.len(), &mesh.triangles);
    let mut all: Vec<Option<Piece>> = vec![None; count];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let corners = mesh.corners(t);
        let [a, b, c] = corners.map(Point3::cast::<f64>);
        let start = Piece { area: 0.0, low: corners[0], high: corners[0] };
        let piece = all[label[triangle[0] as usize] as usize].get_or_insert(start);
        piece.area += (b - a).cross(&(c - a)).norm() * 0.5;
        piece.low = corners.iter().fold(piece.low, |l, p| l.inf(p));
        piece.high = corners.iter().fold(piece.high, |h, p| h.sup(p));
    }
    let numbers: Vec<usize> = (0..count).filter(|&c| all[c].is_some()).collect();
    let pieces: Vec<Piece> = all.into_iter().flatten().collect();
    let mut keep = vec![false; count];
    numbers.iter().zip(choose(&pieces)).for_each(|(&c, chosen)| keep[c] = chosen);
    let (kept, _) = mesh.filter_triangles(|t| keep[label[mesh.triangles[t][0] as usize] as usize]);
    (kept, pieces.len())
}

/// Drops degenerate triangles and those on edges that more than two triangles share, then parts vertices whose
/// triangles form more than one fan. Afterwards every edge has one or two triangles and every vertex one fan.
pub fn make_manifold(mesh: &Mesh) -> Mesh {
    let (mut mesh, _) = mesh.filter_triangles(|t| {
        let [a, b, c] = mesh.triangles[t];
        a != b && b != c && c != a
    });
    loop {
        let edges = Edges::new(&mesh.triangles);
        if edges.uses.iter().all(|&u| u <= 2) {
            break;
        }
        let bad = |t: usize| edges.of_triangle[t].iter().any(|&e| edges.uses[e as usize] > 2);
        mesh = mesh.filter_triangles(|t| !bad(t)).0;
    }
    part_fans(mesh)
}

fn part_fans(mesh: Mesh) -> Mesh {
    let around = VertexTriangles::new(mesh.positions.len(), &mesh.triangles);
    let mut triangles = mesh.triangles.clone();
    let mut source: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    for v in 0..mesh.positions.len() {
        if is_one_fan(&mesh.triangles, around.of(v), v as u32) {
            continue;
        }
        let fans = fans(&mesh.triangles, around.of(v), v as u32);
        for fan in fans.iter().skip(1) {
            let copy = source.len() as u32;
            source.push(v as u32);
            for &t in fan {
                for corner in &mut triangles[t as usize] {
                    if *corner == v as u32 {
                        *corner = copy;
                    }
                }
            }
        }
    }
    if source.len() == mesh.positions.len() { mesh } else { mesh.gather(&source, triangles) }
}

/// True where a walk over shared edges from the first of a vertex's triangles reaches all; false where not, or where
/// there are too many to check quickly.
fn is_one_fan(triangles: &[[u32; 3]], around: &[u32], v: u32) -> bool {
    if around.len() > 64 {
        return false;
    }
    let ends = |k: usize| {
        let tri = triangles[around[k] as usize];
        let at = tri.iter().position(|&c| c == v).unwrap_or(0);
        [tri[(at + 1) % 3], tri[(at + 2) % 3]]
    };
    let all = u64::MAX.checked_shr(64 - around.len() as u32).unwrap_or(0);
    let (mut reached, mut last) = (all & 1, if around.is_empty() { [v; 2] } else { ends(0) });
    // Around a closed fan every step finds the next triangle; a second way round serves open ones.
    for side in [1, 0] {
        while reached != all {
            let next = (0..around.len()).find(|&k| reached >> k & 1 == 0 && ends(k).contains(&last[side]));
            let Some(k) = next else { break };
            reached |= 1 << k;
            let [a, b] = ends(k);
            last[side] = if a == last[side] { b } else { a };
        }
    }
    reached == all
}

/// Groups of a vertex's triangles that hang together by edges at the vertex.
fn fans(triangles: &[[u32; 3]], around: &[u32], v: u32) -> Vec<Vec<u32>> {
    let mut left: Vec<u32> = around.to_vec();
    let mut groups = Vec::new();
    while let Some(first) = left.first().copied() {
        left.remove(0);
        let mut group = vec![first];
        let mut at = 0;
        while at < group.len() {
            let t = triangles[group[at] as usize];
            let linked = |s: &u32| triangles[*s as usize].iter().any(|c| *c != v && t.contains(c));
            let (joined, rest): (Vec<u32>, Vec<u32>) = left.iter().partition(|s| linked(s));
            group.extend(joined);
            left = rest;
            at += 1;
        }
        groups.push(group);
    }
    groups
}

/// Cuts off triangles with two or three open sides, `passes` times, so that ragged borders become smoother.
pub fn trim_border(mut mesh: Mesh, passes: usize) -> Mesh {
    for _ in 0..passes {
        let edges = Edges::new(&mesh.triangles);
        let open = |t: usize| edges.of_triangle[t].iter().filter(|&&e| edges.uses[e as usize] == 1).count();
        let (trimmed, _) = mesh.filter_triangles(|t| open(t) < 2);
        if trimmed.triangles.len() == mesh.triangles.len() {
            break;
        }
        mesh = trimmed;
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bow_tie_is_parted_and_the_larger_side_kept() {
        let p = |x: f32, y: f32| Point3::new(x, y, 0.0);
        let mesh = Mesh::new(
            vec![p(0.0, 0.0), p(1.0, 0.0), p(0.0, 1.0), p(-2.0, 0.0), p(0.0, -2.0)],
            vec![[0, 1, 2], [0, 3, 4]],
        );
        let parted = make_manifold(&mesh);
        assert_eq!(parted.positions.len(), 6);
        let (largest, count) = largest_component(&parted);
        assert_eq!((largest.positions.len(), count), (3, 2));
        assert!((largest.area() - 2.0).abs() < 1e-6);
    }

    #[test]
    fn fans_are_distinguished_whatever_the_order_of_their_triangles() {
        // Around vertex 0: a closed fan of six, an open one of three, and both together.
        let closed: Vec<[u32; 3]> = (0..6).map(|k| [0, 1 + k, 1 + (k + 1) % 6]).collect();
        let open: Vec<[u32; 3]> = (0..3).map(|k| [0, 10 + k, 11 + k]).collect();
        for turn in 0..6 {
            let mut one = closed.clone();
            one.rotate_left(turn);
            one.swap(1, 4);
            let mut part = open.clone();
            part.rotate_left(turn % 3);
            let both: Vec<[u32; 3]> = one.iter().chain(&part).copied().collect();
            for (triangles, expected) in [(one, 1), (part, 1), (both, 2)] {
                let around: Vec<u32> = (0..triangles.len() as u32).collect();
                assert_eq!(is_one_fan(&triangles, &around, 0), expected == 1, "{triangles:?}");
                assert_eq!(fans(&triangles, &around, 0).len(), expected, "{triangles:?}");
            }
        }
    }

    #[test]
    fn a_third_triangle_on_an_edge_goes() {
        let p = |x: f32, y: f32, z: f32| Point3::new(x, y, z);
        let mesh = Mesh::new(
            vec![
                p(0.0, 0.0, 0.0),
                p(1.0, 0.0, 0.0),
                p(0.0, 1.0, 0.0),
                p(0.0, -1.0, 0.0),
                p(0.0, 0.0, 1.0),
                p(2.0, 1.0, 0.0),
            ],
            vec![[0, 1, 2], [1, 0, 3], [0, 1, 4], [1, 5, 2]],
        );
        let fixed = make_manifold(&mesh);
        assert!(Edges::new(&fixed.triangles).uses.iter().all(|&u| u <= 2));
        assert_eq!(fixed.triangles.len(), 1);
    }
}
