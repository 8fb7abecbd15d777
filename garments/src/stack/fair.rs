//! A part of a mesh made as smooth as its surroundings allow: thin-plate energy with uniform weights, so that neither the
//! crumples nor the sizes of the triangles that are there matter.

use nalgebra::Vector3;
use toile_geometry::{
    Mesh,
    rims::{grow, rim_neighbors},
    surface_solve::conjugate_gradients,
    topology::{Edges, VertexNeighbors},
};

/// Keeps the equations definite where nothing around the part is held.
const REGULAR: f32 = 1e-5;

/// Moves the vertices of `patch` (ascending) so that Σ |x − mean of its neighbours|² over them and the ring around them
/// is least; all others stay. At a rim it is Σ |difference|² along the rim instead, which draws it straight.
pub(super) fn fair(mesh: &mut Mesh, neighbors: &VertexNeighbors, patch: &[u32]) {
    if patch.is_empty() {
        return;
    }
    let rim = rim_neighbors(&Edges::new(&mesh.triangles));
    let mut local = vec![u32::MAX; mesh.positions.len()];
    patch.iter().enumerate().for_each(|(i, &v)| local[v as usize] = i as u32);
    let mut rows = Vec::new();
    for v in grow(patch.to_vec(), neighbors, 1) {
        match rim.get(&v) {
            Some(along) => rows.extend(along.iter().map(|&n| Row::new(v, &[n], mesh, &local))),
            None => rows.push(Row::new(v, neighbors.of(v as usize), mesh, &local)),
        }
    }
    let mut diagonal = vec![REGULAR; patch.len()];
    for (i, w) in rows.iter().flat_map(|row| &row.terms) {
        diagonal[*i as usize] += w * w;
    }
    let moves: [Vec<f32>; 3] = std::array::from_fn(|k| {
        let mut right = vec![0.0; patch.len()];
        rows.iter().for_each(|row| row.scatter(-row.bend[k], &mut right));
        conjugate_gradients(&right, vec![0.0; patch.len()], &diagonal, |x, out| {
            out.iter_mut().zip(x).for_each(|(o, x)| *o = REGULAR * x);
            rows.iter().for_each(|row| row.scatter(row.gather(x), out));
        })
    });
    for (i, &v) in patch.iter().enumerate() {
        mesh.positions[v as usize] += Vector3::new(moves[0][i], moves[1][i], moves[2][i]);
    }
}

/// One vertex against the mean of some others.
struct Row {
    /// Those of its vertices that may move, by their place in the patch, with their weights.
    terms: Vec<(u32, f32)>,
    /// How far the vertex is from the mean, metres.
    bend: Vector3<f32>,
}

impl Row {
    fn new(v: u32, around: &[u32], mesh: &Mesh, local: &[u32]) -> Self {
        let share = 1.0 / around.len().max(1) as f32;
        let all: Vec<(u32, f32)> = std::iter::once((v, 1.0)).chain(around.iter().map(|&n| (n, -share))).collect();
        let bend = all.iter().fold(Vector3::zeros(), |s, &(u, w)| s + mesh.positions[u as usize].coords * w);
        let terms = all.into_iter().map(|(u, w)| (local[u as usize], w)).filter(|t| t.0 != u32::MAX).collect();
        Self { terms, bend }
    }

    fn gather(&self, x: &[f32]) -> f32 {
        self.terms.iter().map(|&(i, w)| w * x[i as usize]).sum()
    }

    fn scatter(&self, value: f32, out: &mut [f32]) {
        self.terms.iter().for_each(|&(i, w)| out[i as usize] += w * value);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    #[test]
    fn a_crumple_on_a_bent_sheet_becomes_the_bent_sheet() {
        let n = 31u32;
        let bent = |x: f32| 2.0 * (x - 0.15) * (x - 0.15);
        let at = |i: u32| {
            let (x, y) = ((i % n) as f32 * 0.01, (i / n) as f32 * 0.01);
            Point3::new(x, y, bent(x))
        };
        let triangles = (0..n - 1)
            .flat_map(|j| (0..n - 1).map(move |i| j * n + i))
            .flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]])
            .collect();
        let mut mesh = Mesh::new((0..n * n).map(at).collect(), triangles);
        let smooth = mesh.clone();
        let center = 15 * n + 15;
        let neighbors = VertexNeighbors::new(mesh.positions.len(), &mesh.triangles);
        let patch = grow(vec![center], &neighbors, 5);
        for (k, &v) in patch.iter().enumerate() {
            mesh.positions[v as usize] += Vector3::new(0.3, -0.2, 1.0) * 0.02 * ((k * 7) as f32).sin();
        }
        fair(&mut mesh, &neighbors, &patch);
        let worst = mesh.positions.iter().zip(&smooth.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f32::max);
        assert!(worst < 1e-3, "{worst} m off the sheet");
    }
}
