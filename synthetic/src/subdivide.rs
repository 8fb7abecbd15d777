//! Splitting triangles in four.

use std::collections::HashMap;

use toile_character::SkinnedMesh;
use toile_geometry::Mesh;

/// Splits every triangle at its edges' middles. New vertices lie on the edges, with interpolated weights. Returns the
/// mesh and, for each vertex, the two old vertices it lies between (the same one twice for old vertices).
pub fn split(skinned: &SkinnedMesh) -> (SkinnedMesh, Vec<[u32; 2]>) {
    let old = &skinned.mesh;
    let mut between: Vec<[u32; 2]> = (0..old.positions.len() as u32).map(|v| [v, v]).collect();
    let mut middle_of_edge: HashMap<[u32; 2], u32> = HashMap::new();
    let mut triangles = Vec::with_capacity(old.triangles.len() * 4);
    let mut weights = skinned.weights.clone();
    let mut positions = old.positions.clone();
    for t in &old.triangles {
        let middles = [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(|[a, b]| {
            let edge = [a.min(b), a.max(b)];
            *middle_of_edge.entry(edge).or_insert_with(|| {
                let [a, b] = edge;
                positions.push(nalgebra::center(&old.positions[a as usize], &old.positions[b as usize]));
                weights.push_interpolated(&skinned.weights, [a, b, b], [0.5, 0.5, 0.0]);
                between.push(edge);
                between.len() as u32 - 1
            })
        });
        let [ab, bc, ca] = middles;
        triangles.extend([[t[0], ab, ca], [ab, t[1], bc], [ca, bc, t[2]], [ab, bc, ca]]);
    }
    let mesh = Mesh::new(positions, triangles);
    (SkinnedMesh { mesh, skeleton: skinned.skeleton.clone(), weights }, between)
}

#[cfg(test)]
mod tests {
    use toile_character::BodyModel;
    use toile_geometry::topology::Edges;

    use super::*;

    #[test]
    fn a_split_body_is_closed_and_has_the_same_area() {
        let body = BodyModel::load_default().unwrap().skinned(&[]);
        let (fine, between) = split(&body);
        assert_eq!(fine.mesh.triangles.len(), 4 * body.mesh.triangles.len());
        assert_eq!(between.len(), fine.mesh.positions.len());
        assert!(Edges::new(&fine.mesh.triangles).is_closed());
        assert!((fine.mesh.area() - body.mesh.area()).abs() < 1e-5);
    }
}
