//! Surface elements of a depth image: depth and normal of every pixel.

use toile_geometry::{
    camera::PinholeCamera,
    element::Element,
    lanes::floats::{Kernel, LANES, Lanes, dispatch, group, put_group},
};

/// Elements that follow the image's, all empty: whoever looks up pixels can take a slice of this length anywhere.
pub(crate) const PAGE: usize = 1 << 16;
/// Neighbours farther than this many pixel widths in depth do not smooth each other.
const SMOOTH_SLOPE: f32 = 4.0;
/// A normal closer than this to the viewing ray's plane is not trusted (cosine).
const MIN_COSINE: f32 = 0.05;
/// Neighbours farther than this many pixel widths in depth belong to another surface.
const JUMP_SLOPE: f32 = 16.0;
/// Widest averaging, half width in pixels.
const MAX_WINDOW: usize = 8;

/// Elements with unit normals towards the camera from central (beside unmeasured pixels one-sided) differences of
/// range-gated, averaged depth; empty where a direction has no neighbour or the surface is seen edge-on, and along the
/// image's border. `window` is the averaging's half width, pixels. Row by row, then empty ones up to at least
/// 2¹⁶. O(pixels · window).
pub fn surface_elements(camera: &PinholeCamera, depth: &[f32], window: usize) -> Vec<Element> {
    dispatch(SurfaceElements { camera, depth, window: window.min(MAX_WINDOW) })
}

struct SurfaceElements<'a> {
    camera: &'a PinholeCamera,
    depth: &'a [f32],
    window: usize,
}

impl Kernel for SurfaceElements<'_> {
    type Output = Vec<Element>;

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) -> Vec<Element> {
        let (width, height) = (self.camera.width as usize, self.camera.height as usize);
        let depth = Padded::new(width, height, self.depth);
        let slope = SMOOTH_SLOPE / self.camera.fx as f32;
        let along = gated_mean(l, &depth, self.window, 1, slope);
        let stride = along.stride;
        let smooth = gated_mean(l, &along, self.window, stride, slope);
        let rays = Rays::new(self.camera);
        let mut elements = vec![Element::EMPTY; (width * height).max(PAGE)];
        for y in 1..height.saturating_sub(1) {
            let row = &mut elements[y * width..(y + 1) * width];
            for x in (0..width).step_by(LANES) {
                let at = smooth.at(x, y);
                if l.any(l.gt(l.load(&group(&smooth.values, at)), l.splat(0.0))) {
                    let [slant, nx, ny] = normals(l, &smooth, at, &rays, x, y);
                    let measured = l.load(&group(&depth.values, at));
                    let depth = l.keep(l.gt(l.splat(0.0), slant), measured);
                    put_group(row, x, l.pack([depth, slant, nx, ny]));
                }
            }
            if let [first, .., last] = row {
                (*first, *last) = (Element::EMPTY, Element::EMPTY);
            }
        }
        elements
    }
}

/// An image with unmeasured pixels around it, so that neighbours need no care.
struct Padded {
    width: usize,
    height: usize,
    stride: usize,
    values: Vec<f32>,
}

impl Padded {
    fn new(width: usize, height: usize, values: &[f32]) -> Self {
        let mut padded = Self::empty(width, height);
        for (y, row) in values.chunks(width.max(1)).enumerate() {
            let at = padded.at(0, y);
            padded.values[at..at + width].copy_from_slice(row);
        }
        padded
    }

    fn empty(width: usize, height: usize) -> Self {
        let stride = width.next_multiple_of(LANES) + LANES;
        Self { width, height, stride, values: vec![0.0; stride * (height + 2 * MAX_WINDOW) + 2 * LANES] }
    }

    /// Index of a pixel.
    #[inline(always)]
    fn at(&self, x: usize, y: usize) -> usize {
        (y + MAX_WINDOW) * self.stride + LANES + x
    }
}

/// Mean over symmetric pairs i ± k·step whose two ends are both near the centre plane: pairs keep slopes unbiased.
#[inline(always)]
fn gated_mean<L: Lanes>(l: L, image: &Padded, window: usize, step: usize, slope: f32) -> Padded {
    let mut means = Padded::empty(image.width, image.height);
    let zero = l.splat(0.0);
    for y in 0..image.height {
        for x in (0..image.width).step_by(LANES) {
            let at = image.at(x, y);
            let d = l.load(&group(&image.values, at));
            let measured = l.gt(d, zero);
            if !l.any(measured) {
                continue;
            }
            let (mut sum, mut count) = (d, l.splat(1.0));
            for k in 1..=window {
                let a = l.load(&group(&image.values, at - k * step));
                let b = l.load(&group(&image.values, at + k * step));
                let both = l.add(a, b);
                let gate = l.mul(d, l.splat(slope * k as f32));
                let off = l.abs(l.sub(l.mul(both, l.splat(0.5)), d));
                let apart = l.abs(l.sub(a, b));
                let near = l.and(l.gt(gate, off), l.gt(l.mul(gate, l.splat(4.0)), apart));
                let near = l.and(near, l.and(l.gt(a, zero), l.gt(b, zero)));
                sum = l.add(sum, l.keep(near, both));
                count = l.add(count, l.keep(near, l.splat(2.0)));
            }
            let mean = l.keep(measured, l.div(sum, count));
            put_group(&mut means.values[..at + (image.width - x).min(LANES)], at, l.store(mean));
        }
    }
    means
}

/// Rays of unit depth by column and row.
struct Rays {
    columns: Vec<f32>,
    rows: Vec<f32>,
    pitch: [f32; 2],
}

impl Rays {
    fn new(camera: &PinholeCamera) -> Self {
        let pitch = [1.0 / camera.fx as f32, 1.0 / camera.fy as f32];
        let ray = |k: u32, center: f64, pitch: f32| (k as f32 - center as f32) * pitch;
        Self {
            columns: (0..camera.width).map(|u| ray(u, camera.cx, pitch[0])).collect(),
            rows: (0..camera.height).map(|v| ray(v, camera.cy, pitch[1])).collect(),
            pitch,
        }
    }
}

/// Facing, x and y of the normals of a group of pixels; 0 where there is none.
#[inline(always)]
fn normals<L: Lanes>(l: L, smooth: &Padded, at: usize, rays: &Rays, x: usize, y: usize) -> [L::F; 3] {
    let d = l.load(&group(&smooth.values, at));
    let (rx, ry, one) = (l.load(&group(&rays.columns, x)), l.splat(rays.rows[y]), l.splat(1.0));
    let gate = l.mul(d, l.splat(JUMP_SLOPE * rays.pitch[0]));
    let (across, has_across) = difference(l, smooth, [at - 1, at + 1], d, gate, rx, rays.pitch[0]);
    let (down, has_down) = difference(l, smooth, [at - smooth.stride, at + smooth.stride], d, gate, ry, rays.pitch[1]);
    // Differences of points, which are ray · depth.
    let du = [across[0], l.mul(ry, across[1]), across[1]];
    let dv = [l.mul(rx, down[1]), down[0], down[1]];
    let n = cross(l, dv, du);
    let length = l.sqrt(squared(l, n));
    let inverse = l.div(one, l.max(length, l.splat(1e-12)));
    let slant = l.mul(l.add(l.add(l.mul(n[0], rx), l.mul(n[1], ry)), n[2]), inverse);
    let cosine = l.mul(l.sqrt(squared(l, [rx, ry, one])), l.splat(-MIN_COSINE));
    let spans = l.and(l.and(has_across, has_down), l.gt(d, l.splat(0.0)));
    let good = l.and(spans, l.and(l.ge(cosine, slant), l.gt(length, l.splat(1e-12))));
    // Elements hold facings down to −2: rays of more than 60° aside do not count for more.
    let slant = l.max(slant, l.splat(-2.0));
    [l.keep(good, slant), l.keep(good, l.mul(n[0], inverse)), l.keep(good, l.mul(n[1], inverse))]
}

/// Differences of (ray · depth, depth) between the neighbours on two sides, where a neighbour on another surface
/// is replaced by the pixel itself; and where at least one is.
#[inline(always)]
fn difference<L: Lanes>(
    l: L,
    smooth: &Padded,
    sides: [usize; 2],
    d: L::F,
    gate: L::F,
    ray: L::F,
    pitch: f32,
) -> ([L::F; 2], L::M) {
    let (a, b) = (l.load(&group(&smooth.values, sides[0])), l.load(&group(&smooth.values, sides[1])));
    let (has_a, has_b) = (linked(l, a, d, gate), linked(l, b, d, gate));
    let (a, b) = (l.select(has_a, a, d), l.select(has_b, b, d));
    let ray_a = l.sub(ray, l.keep(has_a, l.splat(pitch)));
    let ray_b = l.add(ray, l.keep(has_b, l.splat(pitch)));
    ([l.sub(l.mul(ray_b, b), l.mul(ray_a, a)), l.sub(b, a)], l.or(has_a, has_b))
}

#[inline(always)]
fn linked<L: Lanes>(l: L, neighbor: L::F, d: L::F, gate: L::F) -> L::M {
    l.and(l.gt(neighbor, l.splat(0.0)), l.gt(gate, l.abs(l.sub(neighbor, d))))
}

#[inline(always)]
fn cross<L: Lanes>(l: L, a: [L::F; 3], b: [L::F; 3]) -> [L::F; 3] {
    [
        l.sub(l.mul(a[1], b[2]), l.mul(a[2], b[1])),
        l.sub(l.mul(a[2], b[0]), l.mul(a[0], b[2])),
        l.sub(l.mul(a[0], b[1]), l.mul(a[1], b[0])),
    ]
}

#[inline(always)]
fn squared<L: Lanes>(l: L, v: [L::F; 3]) -> L::F {
    l.add(l.add(l.mul(v[0], v[0]), l.mul(v[1], v[1])), l.mul(v[2], v[2]))
}

/// The averaging window (half width, pixels) at which the differences of depth with noise `sigma` (metres) at
/// `depth` metres still make normals: the noisier against the pixel's width, the wider.
pub fn window_for(camera: &PinholeCamera, sigma: f64, depth: f64) -> usize {
    let pitch = depth / camera.fx;
    (1.0 + 4.0 * sigma / pitch.max(1e-6)).round().clamp(2.0, 8.0) as usize
}

/// Dot product.
#[inline]
pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::unproject;

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
        let elements = surface_elements(&camera, &depth, 2);
        for (i, element) in elements[..1200].iter().enumerate() {
            let (x, y) = (i % 40, i / 40);
            if [0, 39].contains(&x) || [0, 29].contains(&y) {
                assert_eq!(*element, Element::EMPTY, "the border at {x} {y}");
            } else if x > 2 && x < 37 && y > 2 && y < 27 {
                let r = unproject(&camera, x as f32, y as f32, 1.0);
                let m = element.normal(r[0], r[1]);
                assert!(dot(m, [n.x, n.y, n.z]) > 0.9999, "at {x} {y}: {m:?}");
                assert_eq!(element.depth(), depth[i]);
            }
        }
    }

    /// A sphere around the camera is faced everywhere; its rays of unit depth are longer at the rim than elements can hold.
    #[test]
    fn what_lies_far_aside_is_faced_no_less_than_what_lies_ahead() {
        let camera = PinholeCamera::ideal(201, 21, 30.0, 30.0, 100.0, 10.0);
        let ray = |i: usize| unproject(&camera, (i % 201) as f32, (i / 201) as f32, 1.0);
        let depth: Vec<f32> = (0..201 * 21).map(|i| 2.0 / dot(ray(i), ray(i)).sqrt()).collect();
        let elements = surface_elements(&camera, &depth, 2);
        let mut beyond = 0;
        for i in (5 * 201..16 * 201).filter(|i| (4..197).contains(&(i % 201)) && elements[*i].is_some()) {
            let length = dot(ray(i), ray(i)).sqrt();
            let slant = elements[i].parts()[1];
            assert!((slant + length.min(2.0)).abs() < 0.02, "pixel {i}: {slant}, {length}");
            beyond += usize::from(length > 2.05);
        }
        assert!(beyond > 500, "{beyond}");
    }

    #[test]
    fn lanes_of_any_kind_give_the_same_elements() {
        let camera = PinholeCamera::ideal(53, 21, 90.0, 92.0, 26.0, 10.0);
        let mut seed = 3u32;
        let depth: Vec<f32> = (0..53 * 21)
            .map(|i| {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let noise = (seed >> 16) as f32 * 2e-7;
                if seed >> 28 == 0 { 0.0 } else { 1.5 + 0.01 * (i % 53) as f32 + noise }
            })
            .collect();
        let plain =
            SurfaceElements { camera: &camera, depth: &depth, window: 3 }.run(toile_geometry::lanes::floats::Scalar);
        assert_eq!(surface_elements(&camera, &depth, 3), plain);
        assert!(plain.iter().filter(|e| e.is_some()).count() > 500);
    }
}
