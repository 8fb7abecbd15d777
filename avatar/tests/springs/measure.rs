//! How alike two hems are, and how far a leg comes through.

use nalgebra::{Point3, Vector3};
use toile_character::{Joint, SkinWeights};
use toile_geometry::{Mesh, bvh::Bvh, topology::boundary_loops};

/// Vertices of the lowest open rim: for an open coat, its lower half.
pub fn hem(mesh: &Mesh) -> Vec<u32> {
    let height = |v: &u32| mesh.positions[*v as usize].y;
    let mean = |rim: &Vec<u32>| rim.iter().map(height).sum::<f32>() / rim.len() as f32;
    let rims = boundary_loops(&mesh.triangles);
    let lowest = rims.iter().filter(|rim| rim.len() > 40).min_by(|a, b| mean(a).total_cmp(&mean(b))).unwrap();
    let low = lowest.iter().map(height).fold(f32::MAX, f32::min);
    lowest.iter().filter(|v| height(v) < low + 0.15).copied().collect()
}

/// Mean distance between the `vertices` of two meshes, metres.
pub fn mean_distance(a: &[Point3<f32>], b: &[Point3<f32>], vertices: &[u32]) -> f64 {
    let apart = |v: &u32| f64::from((a[*v as usize] - b[*v as usize]).norm());
    vertices.iter().map(apart).sum::<f64>() / vertices.len() as f64
}

/// Farthest that a vertex of a leg, above the hem, is outside the `garment` when its vertices are at `worn`, metres.
pub fn leg_outside(weights: &SkinWeights, body: &[Point3<f32>], garment: &Mesh, worn: &[Point3<f32>]) -> f64 {
    use Joint::*;
    let legs = [LeftUpperLeg, RightUpperLeg, LeftLowerLeg, RightLowerLeg];
    let highest = hem(garment).iter().map(|&v| worn[v as usize].y).fold(f32::MIN, f32::max);
    let waist = worn.iter().map(|p| p.y).fold(f32::MIN, f32::max) - 0.08;
    let is_leg = |v: &usize| legs.iter().any(|j| j.index() == usize::from(weights.joints[*v][0]));
    let bvh = Bvh::new(worn, &garment.triangles);
    let outside = |p: &Point3<f32>| {
        let far = bvh.closest(p, 0.2).map_or(0.2, |hit| hit.distance);
        if far > 1e-3 && crossings(&bvh, p).is_multiple_of(2) { f64::from(far) } else { 0.0 }
    };
    let between = |p: &&Point3<f32>| p.y > highest + 0.005 && p.y < waist;
    (0..body.len()).filter(is_leg).map(|v| &body[v]).filter(between).map(outside).fold(0.0, f64::max)
}

/// Surfaces that a level ray from `p`, away from the body's middle, goes through.
fn crossings(bvh: &Bvh, p: &Point3<f32>) -> usize {
    let direction = Vector3::new(p.x, 0.0, 0.35 * p.x.abs() + 0.02).normalize();
    let mut from = *p;
    for count in 0..50 {
        match bvh.ray(&from, &direction, 2.0) {
            Some(hit) => from += direction * (hit.t + 1e-5),
            None => return count,
        }
    }
    50
}
