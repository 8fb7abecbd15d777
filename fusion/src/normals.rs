//! Normals of a depth image.

use toile_geometry::camera::PinholeCamera;

use crate::view::{is_measured, unproject};

/// Neighbours farther than this many pixel widths in depth do not smooth each other.
const SMOOTH_SLOPE: f32 = 4.0;
/// A normal closer than this to the viewing ray's plane is not trusted (cosine).
const MIN_COSINE: f32 = 0.05;
/// Neighbours farther than this many pixel widths in depth are no common surface.
const JUMP_SLOPE: f32 = 16.0;

/// Unit normals towards the camera from central (at borders one-sided) differences of range-gated, averaged depth; zero
/// where a direction has no neighbour or the surface is seen edge-on. `window` is the averaging's half width, pixels.
/// O(pixels · window).
pub fn normals_from_depth(camera: &PinholeCamera, depth: &[f32], window: usize) -> Vec<[f32; 3]> {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let smooth = smoothed(camera, depth, window);
    let point = |x: usize, y: usize| unproject(camera, x as f32, y as f32, smooth[y * w + x]);
    let mut normals = vec![[0.0; 3]; depth.len()];
    for y in 0..h {
        for x in 0..w {
            let i = y * w + x;
            if !is_measured(smooth[i]) {
                continue;
            }
            let gate = JUMP_SLOPE / camera.fx as f32 * smooth[i];
            let linked = |j: usize| is_measured(smooth[j]) && (smooth[j] - smooth[i]).abs() < gate;
            let left = if x > 0 && linked(i - 1) { x - 1 } else { x };
            let right = if x + 1 < w && linked(i + 1) { x + 1 } else { x };
            let above = if y > 0 && linked(i - w) { y - 1 } else { y };
            let below = if y + 1 < h && linked(i + w) { y + 1 } else { y };
            if left < right && above < below {
                let (du, dv) = (sub(point(right, y), point(left, y)), sub(point(x, below), point(x, above)));
                normals[i] = facing(cross(dv, du), point(x, y));
            }
        }
    }
    normals
}

fn facing(n: [f32; 3], p: [f32; 3]) -> [f32; 3] {
    let length = dot(n, n).sqrt();
    let range = dot(p, p).sqrt();
    if length < 1e-12 || range < 1e-6 {
        return [0.0; 3];
    }
    let cosine = -dot(n, p) / (length * range);
    if cosine < MIN_COSINE { [0.0; 3] } else { n.map(|c| c / length) }
}

/// Separable range-gated mean over (2 window + 1)² pixels.
fn smoothed(camera: &PinholeCamera, depth: &[f32], window: usize) -> Vec<f32> {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let slope = SMOOTH_SLOPE / camera.fx as f32;
    let mut rows = vec![0.0; depth.len()];
    for y in 0..h {
        for x in 0..w {
            let inner = x.min(w - 1 - x).min(window);
            rows[y * w + x] = gated_mean(depth, y * w + x, inner, 1, slope);
        }
    }
    let mut out = vec![0.0; depth.len()];
    for y in 0..h {
        let inner = y.min(h - 1 - y).min(window);
        for x in 0..w {
            out[y * w + x] = gated_mean(&rows, y * w + x, inner, w, slope);
        }
    }
    out
}

/// Mean over symmetric pairs i ± k·step whose two ends are both near the centre plane: pairs keep slopes unbiased.
#[inline]
fn gated_mean(depth: &[f32], i: usize, reach: usize, step: usize, slope: f32) -> f32 {
    let d = depth[i];
    if !is_measured(d) {
        return 0.0;
    }
    let (mut sum, mut count) = (d, 1.0);
    for k in 1..=reach {
        let (a, b) = (depth[i - k * step], depth[i + k * step]);
        let mean = 0.5 * (a + b);
        let gate = slope * d * k as f32;
        if is_measured(a) && is_measured(b) && (mean - d).abs() < gate && (a - b).abs() < 4.0 * gate {
            sum += a + b;
            count += 2.0;
        }
    }
    sum / count
}

/// The averaging window (half width, pixels) at which the differences of depth with noise `sigma` (metres) at
/// `depth` metres still make normals: the noisier against the pixel's width, the wider.
pub fn window_for(camera: &PinholeCamera, sigma: f64, depth: f64) -> usize {
    let pitch = depth / camera.fx;
    (1.0 + 4.0 * sigma / pitch.max(1e-6)).round().clamp(2.0, 8.0) as usize
}

/// Difference of two vectors.
#[inline]
pub(crate) fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Dot product.
#[inline]
pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Cross product.
#[inline]
pub(crate) fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tilted_plane_has_its_normal_everywhere_inside() {
        let camera = PinholeCamera::ideal(40, 30, 100.0, 100.0, 20.0, 15.0);
        let n = nalgebra::Vector3::new(0.3f32, -0.2, -0.9).normalize();
        let depth: Vec<f32> = (0..1200)
            .map(|i| {
                let r = unproject(&camera, (i % 40) as f32, (i / 40) as f32, 1.0);
                (n.z * 2.0) / dot(r, [n.x, n.y, n.z])
            })
            .collect();
        let normals = normals_from_depth(&camera, &depth, 2);
        for y in 3..27 {
            for x in 3..37 {
                let m = normals[y * 40 + x];
                assert!(dot(m, [n.x, n.y, n.z]) > 0.9999, "at {x} {y}: {m:?}");
            }
        }
    }
}
