//! Edges, neighbours, boundary loops and components of a triangle mesh.

use nalgebra::Point3;

/// Undirected edges with the triangles on either side, sorted by their vertices.
#[derive(Debug, Clone, Default)]
pub struct Edges {
    /// Vertex pairs, smaller index first, in ascending order.
    pub vertices: Vec<[u32; 2]>,
    /// Number of triangles that use each edge: 1 on a boundary, 2 inside, more where the mesh is not manifold.
    pub uses: Vec<u32>,
    /// Edge index of each triangle's side k (corners k and k + 1).
    pub of_triangle: Vec<[u32; 3]>,
}

impl Edges {
    /// Collects the edges of `triangles`.
    pub fn new(triangles: &[[u32; 3]]) -> Self {
        let count = triangles.as_flattened().iter().max().map_or(0, |&v| v as usize + 1);
        let ends = |side: usize| {
            let (tri, k) = (triangles[side / 3], side % 3);
            let (a, b) = (tri[k], tri[(k + 1) % 3]);
            [a.min(b), a.max(b)]
        };
        // Sides in compressed rows by their smaller vertex; rows are short and sorted one by one.
        let mut starts = vec![0u32; count + 1];
        (0..triangles.len() * 3).for_each(|side| starts[ends(side)[0] as usize + 1] += 1);
        (0..count).for_each(|v| starts[v + 1] += starts[v]);
        let mut fill = starts.clone();
        let mut sides = vec![(0u32, 0u32); triangles.len() * 3];
        for side in 0..sides.len() {
            let [a, b] = ends(side);
            sides[fill[a as usize] as usize] = (b, side as u32);
            fill[a as usize] += 1;
        }
        let mut edges = Self { of_triangle: vec![[0; 3]; triangles.len()], ..Self::default() };
        edges.vertices.reserve(sides.len() / 2 + 1);
        edges.uses.reserve(sides.len() / 2 + 1);
        for a in 0..count {
            let row = &mut sides[starts[a] as usize..starts[a + 1] as usize];
            row.sort_unstable();
            for &(b, side) in row.iter() {
                let pair = [a as u32, b];
                if edges.vertices.last() != Some(&pair) {
                    edges.vertices.push(pair);
                    edges.uses.push(0);
                }
                let e = edges.vertices.len() - 1;
                edges.uses[e] += 1;
                edges.of_triangle[side as usize / 3][side as usize % 3] = e as u32;
            }
        }
        edges
    }

    /// The triangles at each edge: two slots, `u32::MAX` where there is none (a third user is left out).
    pub fn triangles(&self) -> Vec<[u32; 2]> {
        let mut out = vec![[u32::MAX; 2]; self.vertices.len()];
        for (t, sides) in self.of_triangle.iter().enumerate() {
            for &e in sides {
                if let Some(slot) = out[e as usize].iter_mut().find(|s| **s == u32::MAX) {
                    *slot = t as u32;
                }
            }
        }
        out
    }

    /// True when every edge has exactly two triangles.
    pub fn is_closed(&self) -> bool {
        self.uses.iter().all(|&u| u == 2)
    }
}

/// Neighbouring vertices of each vertex, ascending, in compressed rows.
#[derive(Debug, Clone, Default)]
pub struct VertexNeighbors {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl VertexNeighbors {
    /// Neighbours over the edges of `triangles` among `vertex_count` vertices.
    pub fn new(vertex_count: usize, triangles: &[[u32; 3]]) -> Self {
        let edges = Edges::new(triangles);
        let pairs = edges.vertices.iter().flat_map(|&[a, b]| [(a, b), (b, a)]);
        let (starts, items) = rows(vertex_count, pairs);
        Self { starts, items }
    }

    /// Neighbours of vertex `v`.
    pub fn of(&self, v: usize) -> &[u32] {
        &self.items[self.starts[v] as usize..self.starts[v + 1] as usize]
    }
}

/// Triangles around each vertex, ascending, in compressed rows.
#[derive(Debug, Clone, Default)]
pub struct VertexTriangles {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl VertexTriangles {
    /// Triangles around each of `vertex_count` vertices.
    pub fn new(vertex_count: usize, triangles: &[[u32; 3]]) -> Self {
        let pairs = triangles.iter().enumerate().flat_map(|(t, tri)| tri.map(|v| (v, t as u32)));
        let (starts, items) = rows(vertex_count, pairs);
        Self { starts, items }
    }

    /// Triangles around vertex `v`.
    pub fn of(&self, v: usize) -> &[u32] {
        &self.items[self.starts[v] as usize..self.starts[v + 1] as usize]
    }
}

fn rows(count: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0u32; count + 1];
    for (row, _) in pairs.clone() {
        starts[row as usize + 1] += 1;
    }
    for i in 0..count {
        starts[i + 1] += starts[i];
    }
    let mut fill = starts.clone();
    let mut items = vec![0u32; starts[count] as usize];
    for (row, item) in pairs {
        items[fill[row as usize] as usize] = item;
        fill[row as usize] += 1;
    }
    for i in 0..count {
        items[starts[i] as usize..starts[i + 1] as usize].sort_unstable();
    }
    (starts, items)
}

/// Component of each vertex (numbered by first vertex) and the number of components; vertices without triangles count too.
pub fn vertex_components(vertex_count: usize, triangles: &[[u32; 3]]) -> (Vec<u32>, usize) {
    let mut parent: Vec<u32> = (0..vertex_count as u32).collect();
    for t in triangles {
        union(&mut parent, t[0], t[1]);
        union(&mut parent, t[1], t[2]);
    }
    let mut number = vec![u32::MAX; vertex_count];
    let mut count = 0;
    let labels = (0..vertex_count as u32)
        .map(|v| {
            let root = find(&mut parent, v) as usize;
            if number[root] == u32::MAX {
                number[root] = count;
                count += 1;
            }
            number[root]
        })
        .collect();
    (labels, count as usize)
}

fn find(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}

fn union(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(parent, a), find(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}

/// Boundary loops as closed vertex cycles along the triangles' own direction, in order of their first vertex.
///
/// Where several loops touch in one vertex they are separated as far as the directions of the edges allow.
pub fn boundary_loops(triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let edges = Edges::new(triangles);
    let mut next: std::collections::BTreeMap<u32, Vec<u32>> = std::collections::BTreeMap::new();
    for (t, tri) in triangles.iter().enumerate() {
        for k in 0..3 {
            if edges.uses[edges.of_triangle[t][k] as usize] == 1 {
                next.entry(tri[k]).or_default().push(tri[(k + 1) % 3]);
            }
        }
    }
    let starts: Vec<u32> = next.keys().copied().collect();
    let mut loops = Vec::new();
    for start in starts {
        while let Some(path) = walk(&mut next, start) {
            loops.push(path);
        }
    }
    loops
}

fn walk(next: &mut std::collections::BTreeMap<u32, Vec<u32>>, start: u32) -> Option<Vec<u32>> {
    let mut path = vec![start];
    let mut at = next.get_mut(&start)?.pop()?;
    while at != start {
        path.push(at);
        match next.get_mut(&at).and_then(Vec::pop) {
            Some(n) => at = n,
            None => break,
        }
    }
    Some(path)
}

/// Length of a closed vertex cycle, metres.
pub fn loop_length(positions: &[Point3<f32>], cycle: &[u32]) -> f32 {
    (0..cycle.len())
        .map(|i| (positions[cycle[i] as usize] - positions[cycle[(i + 1) % cycle.len()] as usize]).norm())
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_has_one_loop_and_one_inner_edge() {
        let triangles = [[0, 1, 2], [0, 2, 3]];
        let edges = Edges::new(&triangles);
        assert_eq!(edges.vertices.len(), 5);
        assert_eq!(edges.uses.iter().filter(|&&u| u == 2).count(), 1);
        assert_eq!(boundary_loops(&triangles), vec![vec![0, 1, 2, 3]]);
        assert_eq!(vertex_components(5, &triangles), (vec![0, 0, 0, 0, 1], 2));
        assert_eq!(VertexNeighbors::new(4, &triangles).of(0), &[1, 2, 3]);
        assert_eq!(VertexTriangles::new(4, &triangles).of(2), &[0, 1]);
    }

    #[test]
    fn edges_agree_with_brute_force_on_a_tangle() {
        let mut seed = 7u32;
        let mut vertex = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            seed >> 28
        };
        let triangles: Vec<[u32; 3]> = (0..90).map(|_| [vertex(), vertex() + 16, vertex() + 32]).collect();
        let mut uses: std::collections::BTreeMap<[u32; 2], u32> = std::collections::BTreeMap::new();
        for [a, b, c] in &triangles {
            [[*a, *b], [*b, *c], [*a, *c]].into_iter().for_each(|e| *uses.entry(e).or_default() += 1);
        }
        let edges = Edges::new(&triangles);
        assert_eq!(edges.vertices, uses.keys().copied().collect::<Vec<_>>());
        assert_eq!(edges.uses, uses.values().copied().collect::<Vec<_>>());
        for (tri, sides) in triangles.iter().zip(&edges.of_triangle) {
            let ends = [[tri[0], tri[1]], [tri[1], tri[2]], [tri[0], tri[2]]];
            assert_eq!(sides.map(|e| edges.vertices[e as usize]), ends);
        }
        assert!(Edges::new(&[]).vertices.is_empty());
    }
}
