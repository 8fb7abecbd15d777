//! Bones against triangles and holes: where a bone passes, an opening is one of the garment's own.

use nalgebra::{Point3, Vector3};
use toile_geometry::triangle::ray_hit;

/// A segment from a joint to its parent, in the scan's frame.
pub(crate) type Bone = [Point3<f32>; 2];

/// True where a bone goes through a triangle.
pub(crate) fn crosses([from, to]: &Bone, corners: &[Point3<f32>; 3]) -> bool {
    ray_hit(from, &(to - from), corners).is_some_and(|(t, _)| t <= 1.0)
}

/// True where one of `bones` goes through the fan of triangles from the centre of a closed rim.
pub(crate) fn passes(positions: &[Point3<f32>], rim: &[u32], bones: &[Bone]) -> bool {
    let sum = rim.iter().fold(Vector3::zeros(), |s, &v| s + positions[v as usize].coords);
    let center = Point3::from(sum / rim.len() as f32);
    let side = |i: usize| [rim[i], rim[(i + 1) % rim.len()]].map(|v| positions[v as usize]);
    let through = |bone: &Bone, [a, b]: [Point3<f32>; 2]| crosses(bone, &[center, a, b]);
    bones.iter().any(|bone| (0..rim.len()).any(|i| through(bone, side(i))))
}
