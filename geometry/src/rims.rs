//! Rims of open meshes, and rings of vertices around others.

use std::collections::{BTreeMap, BTreeSet};

use crate::topology::{Edges, VertexNeighbors};

/// True for those of `vertex_count` vertices that lie on an open edge: one that a single triangle uses.
pub fn open_vertices(edges: &Edges, vertex_count: usize) -> Vec<bool> {
    let mut open = vec![false; vertex_count];
    open_edges(edges).flatten().for_each(|v| open[v as usize] = true);
    open
}

/// The neighbours along the rim of each vertex that lies on one.
pub fn rim_neighbors(edges: &Edges) -> BTreeMap<u32, Vec<u32>> {
    let mut rim = BTreeMap::<u32, Vec<u32>>::new();
    for [a, b] in open_edges(edges) {
        rim.entry(a).or_default().push(b);
        rim.entry(b).or_default().push(a);
    }
    rim
}

fn open_edges(edges: &Edges) -> impl Iterator<Item = [u32; 2]> {
    edges.vertices.iter().zip(&edges.uses).filter(|(_, uses)| **uses == 1).map(|(ends, _)| *ends)
}

/// The vertices `seeds` and `rings` rings of neighbours around them, ascending.
pub fn grow(mut seeds: Vec<u32>, neighbors: &VertexNeighbors, rings: usize) -> Vec<u32> {
    seeds.sort_unstable();
    seeds.dedup();
    let mut start = 0;
    let mut found: BTreeSet<u32> = seeds.iter().copied().collect();
    for _ in 0..rings {
        let end = seeds.len();
        for i in start..end {
            for &n in neighbors.of(seeds[i] as usize) {
                if found.insert(n) {
                    seeds.push(n);
                }
            }
        }
        start = end;
    }
    found.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four triangles around vertex 4.
    const FAN: [[u32; 3]; 4] = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];

    #[test]
    fn the_rim_of_a_fan_is_all_but_its_middle() {
        let edges = Edges::new(&FAN);
        assert_eq!(open_vertices(&edges, 5), [true, true, true, true, false]);
        let rim = rim_neighbors(&edges);
        assert_eq!((rim.len(), &rim[&0], &rim[&2]), (4, &vec![1, 3], &vec![1, 3]));
    }

    #[test]
    fn rings_grow_by_neighbours() {
        let neighbors = VertexNeighbors::new(5, &FAN);
        assert_eq!(grow(vec![0, 0], &neighbors, 0), [0]);
        assert_eq!(grow(vec![0], &neighbors, 1), [0, 1, 3, 4]);
        assert_eq!(grow(vec![0], &neighbors, 2), [0, 1, 2, 3, 4]);
    }
}
