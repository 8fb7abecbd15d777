//! Draws the rectified view out of a camera's image.

use nalgebra::Vector2;
use rayon::prelude::*;
use toile_capture::RgbImage;
use toile_geometry::camera::PinholeCamera;

use crate::RectifiedView;

/// For every pixel of a rectified view, where in the camera's image it comes from. Made once, used for every frame.
#[derive(Debug, Clone)]
pub struct Remap {
    width: u32,
    height: u32,
    places: Vec<Corners>,
}

/// Four pixels of the source and their weights.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Corners {
    /// Upper left one; [`OUTSIDE`] where the camera does not see.
    index: u32,
    /// Weight of the right ones, of the lower ones: 0 to 256.
    right: u16,
    lower: u16,
}

const OUTSIDE: u32 = u32::MAX;

/// One, as a weight.
const ONE: u32 = 256;

impl Remap {
    /// The map of `view` through the rectified `camera`; source and view have the same size.
    pub fn new(view: &RectifiedView, camera: &PinholeCamera) -> Self {
        let (width, height) = (camera.width, camera.height);
        let place = |i: u32| {
            let (u, v) = (f64::from(i % width), f64::from(i / width));
            let ray = Vector2::new((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy);
            view.source(ray)
                .map_or(Corners { index: OUTSIDE, right: 0, lower: 0 }, |p| corners(p.x, p.y, width, height))
        };
        Self { width, height, places: (0..width * height).into_par_iter().map(place).collect() }
    }

    /// True where the camera sees the pixel at this index.
    pub fn is_seen(&self, index: usize) -> bool {
        self.places.get(index).is_some_and(|p| p.index != OUTSIDE)
    }

    /// The rectified image by bilinear interpolation; black where the camera does not see. `None` where the image has
    /// another size than the map was made for.
    pub fn rgb(&self, image: &RgbImage) -> Option<RgbImage> {
        if (image.width, image.height) != (self.width, self.height) || image.pixels.len() != self.places.len() {
            return None;
        }
        let stride = self.width as usize;
        let pixels = self.places.par_iter().map(|p| p.sample(&image.pixels, stride)).collect();
        Some(RgbImage { width: self.width, height: self.height, pixels })
    }
}

fn corners(x: f64, y: f64, width: u32, height: u32) -> Corners {
    // Half a pixel beyond the outer centres still belongs to the image.
    let inside = (-0.5..=f64::from(width) - 0.5).contains(&x) && (-0.5..=f64::from(height) - 0.5).contains(&y);
    if !inside || width < 2 || height < 2 {
        return Corners { index: OUTSIDE, right: 0, lower: 0 };
    }
    let axis = |at: f64, size: u32| {
        let first = at.floor().clamp(0.0, f64::from(size - 2));
        (first as u32, ((at - first).clamp(0.0, 1.0) * f64::from(ONE)).round() as u16)
    };
    let ((u, right), (v, lower)) = (axis(x, width), axis(y, height));
    Corners { index: v * width + u, right, lower }
}

impl Corners {
    fn sample(self, pixels: &[[u8; 3]], stride: usize) -> [u8; 3] {
        if self.index == OUTSIDE {
            return [0; 3];
        }
        let i = self.index as usize;
        let (a, b, c, d) = (pixels[i], pixels[i + 1], pixels[i + stride], pixels[i + stride + 1]);
        let (right, lower) = (u32::from(self.right), u32::from(self.lower));
        let mut out = [0; 3];
        for (k, out) in out.iter_mut().enumerate() {
            let upper = u32::from(a[k]) * (ONE - right) + u32::from(b[k]) * right;
            let below = u32::from(c[k]) * (ONE - right) + u32::from(d[k]) * right;
            *out = ((upper * (ONE - lower) + below * lower + ONE * ONE / 2) / (ONE * ONE)) as u8;
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::Lens;

    fn view(cx: f64) -> RectifiedView {
        let lens = Lens { fx: 10.0, fy: 10.0, cx, cy: 1.5, distortion: [0.0; 8] };
        RectifiedView { lens, rectified_from_camera: Matrix3::identity() }
    }

    fn ramp() -> RgbImage {
        let pixels = (0..24).map(|i| [(i % 6) as u8 * 40, (i / 6) as u8 * 40, 7]).collect();
        RgbImage { width: 6, height: 4, pixels }
    }

    #[test]
    fn the_same_camera_changes_nothing_and_a_shift_interpolates() {
        let camera = PinholeCamera::ideal(6, 4, 10.0, 10.0, 2.5, 1.5);
        let same = Remap::new(&view(2.5), &camera);
        assert_eq!(same.rgb(&ramp()).unwrap(), ramp());
        let shifted = Remap::new(&view(3.0), &camera);
        let image = shifted.rgb(&ramp()).unwrap();
        assert_eq!(image.pixels[8], [100, 40, 7]);
        let gone = Remap::new(&view(4.5), &camera);
        assert_eq!((gone.is_seen(3), gone.is_seen(4), gone.rgb(&ramp()).unwrap().pixels[4]), (true, false, [0; 3]));
    }

    #[test]
    fn an_image_of_another_size_is_refused() {
        let camera = PinholeCamera::ideal(6, 4, 10.0, 10.0, 2.5, 1.5);
        let map = Remap::new(&view(2.5), &camera);
        assert!(map.rgb(&RgbImage { width: 4, height: 6, ..ramp() }).is_none());
        assert!(map.rgb(&RgbImage { pixels: vec![[0; 3]; 23], ..ramp() }).is_none());
    }
}
