//! Crumpled membrane that fusion drew into a sleeve or behind a hem.

use nalgebra::Point3;
use toile_geometry::{bvh::Bvh, intersection::self_crossings, topology::boundary_loops};

use super::draft::Draft;

/// Cuts away, with a ring of triangles, what crosses itself within `depth` metres of a rim. Returns whether anything was
/// cut.
pub(super) fn cut_crumpled(draft: &mut Draft, depth: f32) -> bool {
    let mesh = &draft.surface;
    let pairs = self_crossings(mesh, &Bvh::new(&mesh.positions, &mesh.triangles));
    let rims: Vec<Point3<f32>> =
        boundary_loops(&mesh.triangles).iter().flatten().map(|&v| mesh.positions[v as usize]).collect();
    let at_rim = |t: &u32| {
        let corner = mesh.corners(*t as usize)[0];
        rims.iter().any(|p| (p - corner).norm() < depth)
    };
    let crumpled: Vec<u32> = pairs.into_iter().flatten().filter(at_rim).collect();
    if crumpled.is_empty() {
        return false;
    }
    let mut cut = vec![false; mesh.positions.len()];
    crumpled.iter().flat_map(|&t| mesh.triangles[t as usize]).for_each(|v| cut[v as usize] = true);
    *draft = draft.filter(|t| mesh.triangles[t].iter().all(|&v| !cut[v as usize]));
    true
}
