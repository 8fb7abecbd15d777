//! Takes a deformed surface back where it crosses itself and did not before.

use nalgebra::Point3;
use toile_geometry::{
    Mesh,
    bvh::Bvh,
    intersection::{pair_crosses, self_crossings, self_crossings_among},
};

/// Maximum number of rounds; each halves the distance that is left, so that the last is within micrometres of the start.
const ROUNDS: usize = 12;

/// Where triangles of `points` cross that did not cross in `start`, the vertices around them go halfway back towards
/// `start` in each round, until no crossing is added.
pub(crate) fn uncrossed(triangles: &[[u32; 3]], start: &[Point3<f32>], points: Vec<Point3<f32>>) -> Vec<Point3<f32>> {
    let before = Mesh::new(start.to_vec(), triangles.to_vec());
    let mut mesh = Mesh::new(points, triangles.to_vec());
    let mut pairs = self_crossings(&mesh, &Bvh::new(&mesh.positions, triangles));
    for _ in 0..ROUNDS {
        let mut back = vec![false; start.len()];
        let mut mark = |t: u32| triangles[t as usize].iter().for_each(|&v| back[v as usize] = true);
        let added = pairs.into_iter().filter(|pair| !pair_crosses(&before, pair[0], pair[1]));
        added.flatten().for_each(&mut mark);
        if !back.contains(&true) {
            break;
        }
        let back = around(triangles, &back);
        for (v, _) in back.iter().enumerate().filter(|b| *b.1) {
            mesh.positions[v] = nalgebra::center(&mesh.positions[v], &start[v]);
        }
        let has_moved = |t: &u32| triangles[*t as usize].iter().any(|&v| back[v as usize]);
        let moved: Vec<u32> = (0..triangles.len() as u32).filter(has_moved).collect();
        // Every triangle that crossed has moved, so each new or remaining crossing involves one of these.
        pairs = self_crossings_among(&mesh, &moved, &Bvh::new(&mesh.positions, triangles));
    }
    mesh.positions
}

/// The marked vertices and their neighbours.
fn around(triangles: &[[u32; 3]], marked: &[bool]) -> Vec<bool> {
    let mut out = marked.to_vec();
    for t in triangles.iter().filter(|t| t.iter().any(|&v| marked[v as usize])) {
        t.iter().for_each(|&v| out[v as usize] = true);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crossings(triangles: &[[u32; 3]], points: &[Point3<f32>]) -> Vec<[u32; 2]> {
        let mesh = Mesh::new(points.to_vec(), triangles.to_vec());
        self_crossings(&mesh, &Bvh::new(points, triangles))
    }

    #[test]
    fn a_spike_through_a_sheet_goes_back_and_nothing_else_moves() {
        let sheet = |y: f32, shift: u32| {
            let points = (0..49).map(|i| Point3::new((i % 7) as f32, y, (i / 7) as f32)).collect::<Vec<_>>();
            let cell = |i: u32| {
                let a = shift + (i / 6) * 7 + i % 6;
                [[a, a + 7, a + 1], [a + 1, a + 7, a + 8]]
            };
            (points, (0..36).flat_map(cell).collect::<Vec<_>>())
        };
        let ((mut start, mut triangles), (upper, more)) = (sheet(0.0, 0), sheet(1.0, 49));
        start.extend(upper);
        triangles.extend(more);
        let mut points = start.clone();
        points[24] = Point3::new(3.3, 1.5, 3.2);
        assert!(!crossings(&triangles, &points).is_empty());
        points[0].y = -0.5;
        let mended = uncrossed(&triangles, &start, points.clone());
        assert!(crossings(&triangles, &mended).is_empty());
        assert!(mended[24].y > 0.3 && mended[24].y < 1.0, "{}", mended[24]);
        assert_eq!(mended[0], points[0]);
    }
}
