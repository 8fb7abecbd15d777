//! Triangulations of a cube's 256 sign patterns, built once from one rule instead of a typed-in table.
//!
//! On every face the crossing edges are joined so that inside corners stay apart where the face is ambiguous. The
//! rule looks at the face's own corners only, so the two cells of a face always agree and the surface has no cracks.
//! Corner k sits at (k & 1, k >> 1 & 1, k >> 2).

use std::sync::LazyLock;

/// The cube's edges as corner pairs, along x, then y, then z.
pub(crate) const EDGES: [[usize; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

/// Corners of each face, counter-clockwise seen from outside the cube.
const FACES: [[usize; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// Triangles (edge indices) of each sign pattern; bit k set: corner k is inside. Counter-clockwise from outside.
pub(crate) static TRIANGLES: LazyLock<Vec<Vec<[u8; 3]>>> = LazyLock::new(|| (0..256).map(triangulate).collect());

fn triangulate(pattern: usize) -> Vec<[u8; 3]> {
    let mut next = [usize::MAX; 12];
    for face in &FACES {
        join_face(pattern, face, &mut next);
    }
    let mut triangles = Vec::new();
    let mut seen = [false; 12];
    for start in 0..12 {
        if next[start] == usize::MAX || seen[start] {
            continue;
        }
        let mut polygon = Vec::new();
        let mut edge = start;
        while !seen[edge] {
            seen[edge] = true;
            polygon.push(edge);
            edge = next[edge];
        }
        clip_ears(polygon, &mut triangles);
    }
    triangles
}

/// Adds directed segments crossing edge → crossing edge of one face. Walking around the face, an inside run is cut
/// off by the segment from the edge where it is left to the edge where it was entered.
fn join_face(pattern: usize, face: &[usize; 4], next: &mut [usize; 12]) {
    let inside = |k: usize| pattern >> face[k % 4] & 1 == 1;
    for enter in 0..4 {
        if inside(enter) || !inside(enter + 1) {
            continue;
        }
        let leave = (enter + 1..enter + 4).find(|&k| inside(k) && !inside(k + 1));
        if let Some(leave) = leave {
            next[edge_of(face[enter], face[(enter + 1) % 4])] = edge_of(face[leave % 4], face[(leave + 1) % 4]);
        }
    }
}

fn edge_of(a: usize, b: usize) -> usize {
    EDGES.iter().position(|e| *e == [a.min(b), a.max(b)]).unwrap_or(0)
}

/// Triangulates a loop, preferring diagonals that do not lie in a face of the cube: those could meet a neighbour's.
fn clip_ears(mut polygon: Vec<usize>, triangles: &mut Vec<[u8; 3]>) {
    while polygon.len() > 3 {
        let n = polygon.len();
        let ear = (0..n).min_by_key(|&i| usize::from(share_face(polygon[(i + n - 1) % n], polygon[(i + 1) % n])));
        let i = ear.unwrap_or(0);
        triangles.push([polygon[(i + n - 1) % n] as u8, polygon[i] as u8, polygon[(i + 1) % n] as u8]);
        polygon.remove(i);
    }
    if let [a, b, c] = polygon[..] {
        triangles.push([a as u8, b as u8, c as u8]);
    }
}

fn share_face(a: usize, b: usize) -> bool {
    FACES.iter().any(|f| EDGES[a].iter().chain(&EDGES[b]).all(|c| f.contains(c)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_crossed_edge_is_used_and_inner_sides_pair_up() {
        for pattern in 0..256usize {
            let crossed = |e: usize| (pattern >> EDGES[e][0] & 1) != (pattern >> EDGES[e][1] & 1);
            let triangles = &TRIANGLES[pattern];
            for e in 0..12 {
                assert_eq!(
                    triangles.iter().flatten().any(|&x| x as usize == e),
                    crossed(e),
                    "pattern {pattern} edge {e}"
                );
            }
            let mut open: Vec<(u8, u8)> = Vec::new();
            for t in triangles {
                for k in 0..3 {
                    let (a, b) = (t[k], t[(k + 1) % 3]);
                    match open.iter().position(|&s| s == (b, a)) {
                        Some(i) => _ = open.swap_remove(i),
                        None => open.push((a, b)),
                    }
                }
            }
            assert!(open.iter().all(|&(a, b)| share_face(a as usize, b as usize)), "pattern {pattern}: {open:?}");
        }
    }
}
