//! Finer surfaces.
#![allow(dead_code)]

use std::collections::BTreeMap;

use toile_geometry::Mesh;

/// Each triangle cut into four at the middles of its edges, which neighbours share.
pub fn split(mesh: &Mesh) -> Mesh {
    let mut out = Mesh::new(mesh.positions.clone(), Vec::new());
    let mut middles = BTreeMap::new();
    for t in &mesh.triangles {
        let [ab, bc, ca] = [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])].map(|(a, b)| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                out.positions.push(nalgebra::center(&mesh.positions[a as usize], &mesh.positions[b as usize]));
                out.positions.len() as u32 - 1
            })
        });
        out.triangles.extend([[t[0], ab, ca], [ab, t[1], bc], [ca, bc, t[2]], [ab, bc, ca]]);
    }
    out.recompute_normals();
    out
}
