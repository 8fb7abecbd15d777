//! The seed's own way out of a lower layer: Hu et al. 2017, eq. 7.

use nalgebra::Point3;
use rayon::prelude::*;

use super::layer::Layer;
use crate::settings::StackSettings;

/// Pushes each vertex that lies inside a lower layer out along its own normal, v' = v + (k + d) · norm(v), where d is its
/// distance from the closest point of that layer and k is [`StackSettings::push_beyond`]. Layers go inside to outside, and
/// each meets the layers below it in the same order, once. The body stays.
///
/// The seed looks for vertices inside the naked body. Here all layers below count: a vertex is inside one where it lies
/// behind its nearest triangle, within reach and not beyond a rim.
pub(super) fn push_along_normals(layers: &mut [Layer], settings: &StackSettings) {
    for upper in 1..layers.len() {
        for lower in 0..upper {
            let pushed = pushed_out(&layers[upper], &layers[lower], settings);
            layers[upper].surface.mesh.positions = pushed;
            layers[upper].surface.refresh();
        }
    }
}

/// Positions of the upper layer's vertices, outside the lower one.
fn pushed_out(upper: &Layer, lower: &Layer, settings: &StackSettings) -> Vec<Point3<f32>> {
    let (positions, normals) = (&upper.mesh().positions, &upper.surface.normals);
    let push = |(p, normal): (&Point3<f32>, _)| match lower.surface.height(p, settings.reach) {
        Some(height) if height < 0.0 => p + normal * (settings.push_beyond - height),
        _ => *p,
    };
    positions.par_iter().zip(normals).map(push).collect()
}

#[cfg(test)]
mod tests {
    use toile_geometry::Mesh;

    use super::*;

    /// A flat sheet of 10 mm squares at the heights that `z` gives, facing +Z.
    fn sheet(z: impl Fn(f32) -> f32) -> Layer {
        let n = 11u32;
        let at = |i: u32| {
            let (x, y) = ((i % n) as f32 * 0.01, (i / n) as f32 * 0.01);
            Point3::new(x, y, z(x))
        };
        let squares = (0..n - 1).flat_map(|j| (0..n - 1).map(move |i| j * n + i));
        let triangles = squares.flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]).collect();
        Layer::new(&Mesh::new((0..n * n).map(at).collect(), triangles), 0.0015)
    }

    #[test]
    fn what_is_inside_goes_out_by_its_depth_and_k_and_the_rest_stays() {
        let settings = StackSettings { push_beyond: 0.002, ..StackSettings::default() };
        let mut layers = [sheet(|_| 0.0), sheet(|x| if x < 0.045 { -0.004 } else { 0.003 })];
        push_along_normals(&mut layers, &settings);
        for p in layers[1].mesh().positions.iter().filter(|p| (p.x - 0.045).abs() > 0.02) {
            let expected = if p.x < 0.045 { 0.002 } else { 0.003 };
            assert!((p.z - expected).abs() < 1e-6, "{p}");
        }
    }
}
