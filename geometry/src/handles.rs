//! Handles cut: bridges and tunnels that a surface should not have. The shortest loop that goes around a handle is cut
//! and both sides are closed, until no such loop is short.

use std::collections::BTreeMap;

use crate::{Mesh, holes};

mod loops;

/// The mesh without those handles that a loop of at most `longest` (metres) goes around or through, and the number that
/// was cut. New vertices are marked as by [`holes::fill_holes`]. The mesh must be an oriented manifold, with or without
/// borders ([`crate::components::make_manifold`]); loops that touch a border are left, and the search ends at the first
/// handle that cannot be closed.
pub fn cut_handles(mesh: &Mesh, longest: f32) -> (Mesh, usize) {
    let mut out = mesh.clone();
    let mut count = 0;
    while let Some(cycle) = loops::shortest_cycle(&out, longest) {
        let Some(cut) = cut_along(&out, &cycle) else { break };
        out = cut;
        count += 1;
    }
    (out, count)
}

/// The mesh cut along a simple cycle of inner vertices, both rims closed; `None` where its surroundings are not a
/// manifold or a rim cannot be closed.
fn cut_along(mesh: &Mesh, cycle: &[u32]) -> Option<Mesh> {
    let mut triangle_of_side = BTreeMap::new();
    for (t, tri) in mesh.triangles.iter().enumerate() {
        triangle_of_side.extend((0..3).map(|k| ((tri[k], tri[(k + 1) % 3]), (t, tri[(k + 2) % 3]))));
    }
    let (n, old_count) = (cycle.len(), mesh.positions.len() as u32);
    let mut triangles = mesh.triangles.clone();
    for (i, &v) in cycle.iter().enumerate() {
        let (before, after) = (cycle[(i + n - 1) % n], cycle[(i + 1) % n]);
        // Around the vertex, from the way on to the way back: what lies to the left of the cycle.
        let mut at = after;
        while at != before {
            let (t, opposite) = *triangle_of_side.get(&(v, at))?;
            triangles[t].iter_mut().filter(|c| **c == v).for_each(|c| *c = old_count + i as u32);
            at = opposite;
            if at == after {
                return None;
            }
        }
    }
    let sources: Vec<u32> = (0..old_count).chain(cycle.iter().copied()).collect();
    let mut on_rim = vec![false; sources.len()];
    cycle.iter().for_each(|&v| on_rim[v as usize] = true);
    on_rim[old_count as usize..].fill(true);
    let cut = mesh.gather(&sources, triangles);
    let (closed, filled) = holes::fill_where(&cut, |rim| rim.iter().all(|&v| on_rim[v as usize]));
    (filled.holes == 2).then_some(closed)
}

#[cfg(test)]
mod tests {
    use std::f32::consts::TAU;

    use nalgebra::Point3;

    use super::*;
    use crate::topology::{Edges, boundary_loops};

    /// A ring of radius 0.1 m of a tube of radius 0.02 m.
    fn torus() -> Mesh {
        let (around, across) = (60u32, 16u32);
        let positions = (0..around * across).map(|i| {
            let (a, b) = ((i / across) as f32 / around as f32 * TAU, (i % across) as f32 / across as f32 * TAU);
            let r = 0.1 + 0.02 * b.cos();
            Point3::new(r * a.cos(), 0.02 * b.sin(), r * a.sin())
        });
        let at = |i: u32, j: u32| (i % around) * across + j % across;
        let squares = (0..around * across).map(|k| (k / across, k % across));
        let triangles = squares.flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            [[a, b, c], [a, c, d]]
        });
        Mesh::new(positions.collect(), triangles.collect())
    }

    fn euler(mesh: &Mesh) -> i64 {
        let edges = Edges::new(&mesh.triangles).vertices.len();
        mesh.positions.len() as i64 - edges as i64 + mesh.triangles.len() as i64
    }

    #[test]
    fn a_ring_is_cut_where_it_is_thinnest() {
        let ring = torus();
        assert_eq!(euler(&ring), 0);
        let (cut, count) = cut_handles(&ring, 0.2);
        assert_eq!((count, euler(&cut)), (1, 2));
        assert!(Edges::new(&cut.triangles).is_closed());
        assert!((cut.signed_volume() / ring.signed_volume() - 1.0).abs() < 0.02, "{}", cut.signed_volume());
    }

    #[test]
    fn handles_longer_than_asked_for_and_other_holes_stay() {
        let ring = torus();
        assert_eq!(cut_handles(&ring, 0.1).1, 0);
        // The border of a hole is not a handle.
        let (open, _) = ring.filter_triangles(|t| t > 3);
        let rims = boundary_loops(&open.triangles).len();
        let (cut, count) = cut_handles(&open, 0.2);
        assert_eq!((count, boundary_loops(&cut.triangles).len()), (1, rims));
        assert_eq!(cut_handles(&Mesh::default(), 1.0).1, 0);
    }
}
