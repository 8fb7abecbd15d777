//! Where a skirt or dress hangs free of the body: Hu et al. 2017, §6.2, divide such garments in two for the animation.

use toile_geometry::{Mesh, bvh::Bvh, surface_solve::SurfaceSystem};

/// Cloth further from the body than this hangs free, metres.
const CLOSE: f32 = 0.02;
/// The border between the parts is smoothed over this length, metres.
const SMOOTHING: f32 = 0.04;

/// Marks each vertex of `garment` 1 where it hangs free of `body` (both in one pose and frame), else 0.
pub fn mark_free(body: &Mesh, garment: &Mesh) -> Vec<f32> {
    let bvh = Bvh::new(&body.positions, &body.triangles);
    let free = |p| f32::from(u8::from(bvh.closest(p, CLOSE).is_none()));
    let values: Vec<f32> = garment.positions.iter().map(free).collect();
    let anchors = vec![1.0 / (SMOOTHING * SMOOTHING); values.len()];
    let smooth = SurfaceSystem::new(garment).smoothed(&values, &anchors);
    smooth.into_iter().map(|x| f32::from(u8::from(x > 0.5))).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    /// A cone of 60 × 40 vertices with radius `radius(y)` from y = 0 up to 0.4.
    fn cone(radius: impl Fn(f32) -> f32) -> Mesh {
        let (around, rows) = (60u32, 40u32);
        let at = |i: u32| {
            let (y, a) = (0.01 * (i / around) as f32, (i % around) as f32 / around as f32 * std::f32::consts::TAU);
            Point3::new(radius(y) * a.sin(), y, radius(y) * a.cos())
        };
        let triangles = (0..rows)
            .flat_map(|r| (0..around).map(move |i| (r * around + i, r * around + (i + 1) % around)))
            .flat_map(|(a, b)| [[a, b, b + around], [a, b + around, a + around]])
            .collect();
        Mesh::new((0..(rows + 1) * around).map(at).collect(), triangles)
    }

    #[test]
    fn a_flared_skirt_is_free_below() {
        let (body, skirt) = (cone(|_| 0.1), cone(|y| 0.105 + 0.2 * (0.3 - y).max(0.0)));
        for (p, free) in skirt.positions.iter().zip(mark_free(&body, &skirt)) {
            // 20 mm off the body at y = 0.225.
            assert!((p.y - 0.225).abs() < 0.03 || (free == 1.0) == (p.y < 0.225), "{p} {free}");
        }
    }
}
