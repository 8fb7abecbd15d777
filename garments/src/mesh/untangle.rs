//! A mesh that cuts through itself is smoothed there until it does not.

use toile_geometry::{
    Mesh,
    bvh::Bvh,
    intersection::{self_crossings, self_crossings_among},
    rims::{grow, rim_neighbors},
    topology::{Edges, VertexNeighbors},
};

/// Limit of the rounds.
const ROUNDS: usize = 12;
/// Rings of neighbours that are smoothed around a crossing in the first round; one more every third round.
const RINGS: usize = 1;
/// Smoothing steps a round.
const STEPS: usize = 4;

/// Smooths around the triangles of `mesh` that cross one another. Returns the number of pairs that are left.
pub(super) fn untangle(mesh: &mut Mesh) -> usize {
    untangle_but(mesh, &[])
}

/// As [`untangle`], where vertices that are `held` stay (all others may move).
pub(crate) fn untangle_but(mesh: &mut Mesh, held: &[bool]) -> usize {
    let mut pairs = self_crossings(mesh, &Bvh::new(&mesh.positions, &mesh.triangles));
    if pairs.is_empty() {
        return 0;
    }
    let neighbors = VertexNeighbors::new(mesh.positions.len(), &mesh.triangles);
    for round in 0..ROUNDS {
        let seeds = pairs.iter().flatten().flat_map(|&t| mesh.triangles[t as usize]);
        let mut patch = grow(seeds.collect(), &neighbors, RINGS + round / 3);
        patch.retain(|&v| held.get(v as usize) != Some(&true));
        smooth(mesh, &neighbors, &patch, STEPS);
        // Only what moved can cross anew, and all that crossed has moved.
        let mut moved = vec![false; mesh.positions.len()];
        patch.iter().for_each(|&v| moved[v as usize] = true);
        let of_patch = |t: &u32| mesh.triangles[*t as usize].iter().any(|&v| moved[v as usize]);
        let some: Vec<u32> = (0..mesh.triangles.len() as u32).filter(of_patch).collect();
        pairs = self_crossings_among(mesh, &some, &Bvh::new(&mesh.positions, &mesh.triangles));
        if pairs.is_empty() {
            break;
        }
    }
    pairs.len()
}

/// Moves each vertex of the patch half-way to its neighbours' mean, `steps` times; vertices on a rim follow the rim only.
fn smooth(mesh: &mut Mesh, neighbors: &VertexNeighbors, patch: &[u32], steps: usize) {
    let rim = rim_neighbors(&Edges::new(&mesh.triangles));
    for _ in 0..steps {
        let moved: Vec<_> = patch
            .iter()
            .map(|&v| {
                let around = rim.get(&v).map_or(neighbors.of(v as usize), Vec::as_slice);
                let p = mesh.positions[v as usize];
                let sum = around.iter().fold(nalgebra::Vector3::zeros(), |s, &n| s + mesh.positions[n as usize].coords);
                if around.is_empty() { p } else { p + (sum / around.len() as f32 - p.coords) * 0.5 }
            })
            .collect();
        patch.iter().zip(moved).for_each(|(&v, p)| mesh.positions[v as usize] = p);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    #[test]
    fn a_fold_is_taken_out_and_the_rest_stays() {
        let n = 20u32;
        let positions: Vec<Point3<f32>> = (0..n * n)
            .map(|i| {
                let (x, y) = ((i % n) as f32 * 0.01, (i / n) as f32 * 0.01);
                Point3::new(x, y, 0.0)
            })
            .collect();
        let triangles = (0..n - 1)
            .flat_map(|j| (0..n - 1).map(move |i| j * n + i))
            .flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]])
            .collect();
        let mut mesh = Mesh::new(positions, triangles);
        mesh.positions[(10 * n + 10) as usize] = Point3::new(0.125, 0.125, -0.002);
        mesh.positions[(11 * n + 11) as usize].z = 0.004;
        mesh.positions[(10 * n + 11) as usize] = Point3::new(0.095, 0.118, 0.003);
        let before = mesh.clone();
        assert!(!self_crossings(&mesh, &Bvh::new(&mesh.positions, &mesh.triangles)).is_empty());
        assert_eq!(untangle(&mut mesh), 0);
        let far = |p: &Point3<f32>| (p - Point3::new(0.11, 0.11, 0.0)).norm() > 0.06;
        assert!(mesh.positions.iter().zip(&before.positions).all(|(a, b)| a == b || !far(b)));
    }
}
