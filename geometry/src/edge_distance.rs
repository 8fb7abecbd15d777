//! Distances along the edges of a mesh.

use std::{cmp::Reverse, collections::BinaryHeap};

use nalgebra::Point3;

use crate::topology::VertexNeighbors;

/// Length of the shortest way along edges from the nearest of `starts` to every vertex, metres (Dijkstra 1959): 0 at the
/// starts, infinite for vertices that no way shorter than `farthest` reaches. Ways lead through vertices for which
/// `may_pass` holds only; starts need not fulfil it. O(n log n).
pub fn distances_along_edges(
    positions: &[Point3<f32>],
    neighbors: &VertexNeighbors,
    starts: impl IntoIterator<Item = u32>,
    farthest: f32,
    may_pass: impl Fn(u32) -> bool,
) -> Vec<f32> {
    let mut distances = vec![f32::INFINITY; positions.len()];
    // Lengths are not negative, so that their bits have their order.
    let mut queue: BinaryHeap<Reverse<(u32, u32)>> = BinaryHeap::new();
    for v in starts {
        distances[v as usize] = 0.0;
        queue.push(Reverse((0, v)));
    }
    while let Some(Reverse((bits, v))) = queue.pop() {
        let so_far = f32::from_bits(bits);
        if so_far > distances[v as usize] {
            continue;
        }
        for &n in neighbors.of(v as usize) {
            let longer = so_far + (positions[n as usize] - positions[v as usize]).norm();
            if longer < distances[n as usize] && longer < farthest && may_pass(n) {
                distances[n as usize] = longer;
                queue.push(Reverse((longer.to_bits(), n)));
            }
        }
    }
    distances
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of unit squares along x: vertices 2 i at (i, 0) and 2 i + 1 at (i, 1).
    fn strip(squares: u32) -> (Vec<Point3<f32>>, VertexNeighbors) {
        let positions = (0..=squares).flat_map(|i| [0.0, 1.0].map(|y| Point3::new(i as f32, y, 0.0))).collect();
        let triangles: Vec<[u32; 3]> =
            (0..squares).flat_map(|i| [[2 * i, 2 * i + 2, 2 * i + 1], [2 * i + 1, 2 * i + 2, 2 * i + 3]]).collect();
        (positions, VertexNeighbors::new(2 * squares as usize + 2, &triangles))
    }

    #[test]
    fn ways_are_the_shortest_and_end_at_the_limit() {
        let (positions, neighbors) = strip(6);
        let found = distances_along_edges(&positions, &neighbors, [0], 3.5, |_| true);
        assert_eq!(found[..8], [0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, f32::INFINITY]);
        let from_both_ends = distances_along_edges(&positions, &neighbors, [0, 12], f32::INFINITY, |_| true);
        assert_eq!((from_both_ends[6], from_both_ends[10]), (3.0, 1.0));
    }

    #[test]
    fn ways_lead_around_what_they_may_not_pass() {
        let (positions, neighbors) = strip(3);
        let found = distances_along_edges(&positions, &neighbors, [0], f32::INFINITY, |v| v != 2);
        assert_eq!(found[2], f32::INFINITY);
        assert!(found[4] > 3.0 && found[4].is_finite(), "{}", found[4]);
    }
}
