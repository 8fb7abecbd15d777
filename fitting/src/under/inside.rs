//! Which vertices lie outside a scan, however far: by the winding number of its triangles.

use nalgebra::Point3;
use rayon::prelude::*;
use toile_geometry::{Mesh, bvh::Bvh};

/// A vertex is outside where it lies farther than this from the scan, on its outer side, metres: about the noise of a
/// fused scan.
pub(crate) const OUTSIDE: f32 = 0.002;

/// The inside of a scan.
pub(crate) struct Inside {
    bvh: Bvh,
}

impl Inside {
    /// The scan should be closed but for holes much smaller than a limb.
    pub fn new(scan: &Mesh) -> Self {
        Self { bvh: Bvh::new(&scan.positions, &scan.triangles) }
    }

    /// The hierarchy over the scan's triangles.
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// Distance of a point from the scan where it lies outside, else 0; metres.
    pub fn depth_outside(&self, p: &Point3<f32>) -> f32 {
        if self.bvh.contains(p) {
            0.0
        } else {
            self.bvh.closest(p, f32::INFINITY).map_or(f32::INFINITY, |h| h.distance)
        }
    }

    /// Whether a point lies outside, farther than `reach` metres from the scan.
    pub fn is_far_outside(&self, p: &Point3<f32>, reach: f32) -> bool {
        self.bvh.closest(p, reach).is_none() && !self.bvh.contains(p)
    }

    /// Which points lie more than [`OUTSIDE`] outside.
    pub fn is_outside(&self, points: &[Point3<f32>]) -> Vec<bool> {
        // Near the surface the search ends early, so it comes first.
        let is_outside = |p: &Point3<f32>| self.bvh.closest(p, OUTSIDE).is_none() && !self.bvh.contains(p);
        points.par_iter().with_min_len(64).map(is_outside).collect()
    }
}

#[cfg(test)]
mod tests {
    use toile_character::BodyModel;

    use super::*;

    #[test]
    fn points_far_outside_are_found_too() {
        let model = BodyModel::load_default().unwrap();
        let inside = Inside::new(&Mesh::new(model.mean.clone(), model.triangles.clone()));
        let navel = model.mean[model.landmark("navel").unwrap() as usize];
        let at = |z: f32| navel + nalgebra::Vector3::z() * z;
        let points = [at(-0.05), at(0.001), at(0.004), at(0.3), Point3::new(5.0, 0.0, 0.0)];
        assert_eq!(inside.is_outside(&points), [false, false, true, true, true]);
        assert_eq!(inside.depth_outside(&points[0]), 0.0);
        assert!((inside.depth_outside(&points[3]) - 0.3).abs() < 0.01);
    }
}
