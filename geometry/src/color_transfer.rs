//! Vertex colours carried from one surface to another.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::{Mesh, bvh::Bvh};

/// A source triangle counts as facing the same way above this cosine between the normals.
const MIN_COSINE: f32 = 0.2;
/// Source vertices with an attribute `filled` above this were never seen, and give no colour where another is near.
const SEEN: f32 = 0.5;
/// How much farther than the nearest a better (seen, facing) triangle may be, metres.
const DETOUR: f32 = 0.05;

/// sRGB colours for `targets` (with unit `normals`, zero where unknown) from the closest triangle of `source`, by
/// barycentric coordinates; triangles that were seen and face the same way come first. Empty where `source` has no
/// colour or no triangle. Same frame and pose for both. Parallel, deterministic.
pub fn closest_colors(source: &Mesh, targets: &[Point3<f32>], normals: &[Vector3<f32>]) -> Vec<[u8; 3]> {
    if source.colors.is_empty() || source.is_empty() {
        return Vec::new();
    }
    let bvh = Bvh::new(&source.positions, &source.triangles);
    let source_normals = source.triangle_normals();
    let filled = source.attributes.get("filled");
    let seen = |t: u32| filled.is_none_or(|f| source.triangles[t as usize].iter().all(|&v| f[v as usize] < SEEN));
    let color = |(p, n): (&Point3<f32>, &Vector3<f32>)| {
        let fits = |t: u32| seen(t) && (*n == Vector3::zeros() || source_normals[t as usize].dot(n) > MIN_COSINE);
        let nearest = bvh.closest(p, f32::INFINITY)?;
        let reach = nearest.distance + DETOUR;
        let hit = if fits(nearest.triangle) { nearest } else { bvh.closest_where(p, reach, fits).unwrap_or(nearest) };
        let corners = source.triangles[hit.triangle as usize].map(|v| source.colors[v as usize]);
        Some(std::array::from_fn(|k| {
            let mixed: f32 = corners.iter().zip(hit.barycentric).map(|(c, w)| f32::from(c[k]) * w).sum();
            (mixed + 0.5).clamp(0.0, 255.0) as u8
        }))
    };
    targets.par_iter().zip(normals).map(|pair| color(pair).unwrap_or_default()).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    /// Two sheets 10 mm apart that face away from each other: the lower one red, the upper one blue.
    fn sheets() -> Mesh {
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let at = |z: f32| corners.map(move |[x, y]| Point3::new(x, y, z));
        Mesh {
            positions: [at(0.0), at(0.01)].concat(),
            triangles: vec![[0, 2, 1], [3, 4, 5]],
            colors: [[[200, 0, 0]; 3], [[0, 0, 200]; 3]].concat(),
            ..Mesh::default()
        }
    }

    #[test]
    fn the_side_that_faces_the_same_way_gives_the_colour() {
        let p = [Point3::new(0.2, 0.2, 0.009)];
        assert_eq!(closest_colors(&sheets(), &p, &[Vector3::z()]), [[0, 0, 200]]);
        assert_eq!(closest_colors(&sheets(), &p, &[-Vector3::z()]), [[200, 0, 0]]);
        assert_eq!(closest_colors(&sheets(), &p, &[Vector3::zeros()]), [[0, 0, 200]]);
    }

    #[test]
    fn what_was_not_seen_gives_way_to_what_was() {
        let mut mesh = sheets();
        mesh.triangles[0] = [0, 1, 2];
        mesh.attributes = BTreeMap::from([("filled".to_string(), vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0])]);
        assert_eq!(closest_colors(&mesh, &[Point3::new(0.2, 0.2, 0.01)], &[Vector3::z()]), [[200, 0, 0]]);
    }

    #[test]
    fn missing_colours_stay_missing() {
        let bare = Mesh { colors: Vec::new(), ..sheets() };
        assert!(closest_colors(&bare, &[Point3::origin()], &[Vector3::z()]).is_empty());
    }
}
