//! The calibration of the modelled camera: as truth in metres, and as the numbers that the camera states.
//!
//! The stated numbers are libfreenect's (`src/registration.c`): depth is z = 10·r·e / (e − m) millimetres with the zero
//! plane's distance r (mm / 10), the emitter's distance e (cm) and m = ((raw / 4 − c) − 0.375)·p. A registered column
//! is ⌊u + dx(u, v) + 1 + s·(z − 10 r) / z + 0.375⌋, a row ⌊v + dy(u, v) + 1⌋, with s = b·10 / (2 p·10) pixels and
//! polynomials dx, dy stated as differences in fixed point. A whole number n there is the pixel from n to n + 1, so with
//! pixel centres at integers 0.5 is taken off.

use toile_geometry::camera::PinholeCamera;

/// Emitter to depth camera, centimetres.
pub(super) const EMITTER_CM: f32 = 7.5;
/// Depth to colour camera as the camera states it, centimetres; libfreenect says that 2.4 is the true one.
pub(super) const TOLD_COLOR_CM: f32 = 2.3;
/// Reference distance of the zero plane, tens of millimetres.
pub(super) const REFERENCE: f32 = 120.0;
/// Size of a pixel at the reference distance, of the sensor's 1280 columns.
pub(super) const PIXEL: f32 = 0.1042;
/// Constant shift.
pub(super) const CONST_SHIFT: u16 = 200;

/// True optics of one camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optics {
    /// The depth camera: focal length r / 2p.
    pub depth: PinholeCamera,
    /// The colour camera.
    pub color: PinholeCamera,
    /// Colour camera's place in the depth camera's frame along +X, metres.
    pub baseline: f64,
}

impl Default for Optics {
    /// Both cameras alike, so that one scene can be rendered for both.
    fn default() -> Self {
        Self::new(f64::from(REFERENCE / (2.0 * PIXEL)), [319.5, 239.5])
    }
}

impl Optics {
    /// Optics with another colour camera: its focal length and centre, pixels.
    pub fn new(color_focal: f64, center: [f64; 2]) -> Self {
        let focal = f64::from(REFERENCE / (2.0 * PIXEL));
        Self {
            depth: PinholeCamera::ideal(640, 480, focal, focal, 319.5, 239.5),
            color: PinholeCamera::ideal(640, 480, color_focal, color_focal, center[0], center[1]),
            // The stated shift is that of 24 mm behind the depth camera's focal length.
            baseline: 0.024 * focal / color_focal,
        }
    }

    /// Raw depth of a distance along +Z in millimetres; [`super::NO_DEPTH`] where the camera sees none.
    pub fn raw_from_mm(&self, mm: f64) -> u16 {
        if !(400.0..9_000.0).contains(&mm) {
            return super::NO_DEPTH;
        }
        let m = f64::from(EMITTER_CM) * (1.0 - 10.0 * f64::from(REFERENCE) / mm);
        let raw = 4.0 * (m / f64::from(PIXEL) + 0.375 + f64::from(CONST_SHIFT));
        if (0.0..1084.0).contains(&raw) { raw.round() as u16 } else { super::NO_DEPTH }
    }

    /// Where the colour camera sees what depth pixel (`u`, `v`) has at `z` metres.
    pub fn color_pixel(&self, u: f64, v: f64, z: f64) -> [f64; 2] {
        let (depth, color) = (&self.depth, &self.color);
        let x = (u - depth.cx) / depth.fx * z - self.baseline;
        let y = (v - depth.cy) / depth.fy * z;
        [color.fx * x / z + color.cx, color.fy * y / z + color.cy]
    }

    /// The registration's numbers in the order of libfreenect's `freenect_reg_info`.
    pub(super) fn registration(&self) -> [i32; 29] {
        let (depth, color) = (&self.depth, &self.color);
        let scale = color.fx / depth.fx;
        // At the reference distance the shift is 0.375, and 0.5 is the half pixel of whole numbers.
        let at_reference = color.cx - scale * depth.cx - color.fx * self.baseline / (0.01 * f64::from(REFERENCE));
        let (dx, dy) = (at_reference - 0.375 - 1.0 + 0.5, color.cy - scale * depth.cy - 1.0 + 0.5);
        let mut stated = [0; 29];
        // dx_start and dy_start in 1/256 pixel; dxdx_start and dydy_start in 1/32768 pixel a pixel. The device takes a
        // row's step before the row, so the first row has taken one already.
        let slope = ((scale - 1.0) * 32_768.0).round();
        stated[5] = (dx * 256.0).round() as i32;
        stated[10] = ((dy - slope / 32_768.0) * 256.0).round() as i32;
        stated[17] = slope as i32;
        stated[20] = slope as i32;
        stated
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn raw_depth_grows_with_the_distance_and_ends_where_the_sensor_does() {
        let optics = Optics::default();
        let raw: Vec<u16> = (500..8000).map(|mm| optics.raw_from_mm(f64::from(mm))).collect();
        assert!(raw.is_sorted() && raw[0] < 500 && *raw.last().unwrap() < 1084);
        // At the zero plane nothing is shifted but the constants: 4 · (200 + 0.375).
        assert_eq!(optics.raw_from_mm(1200.0), 802);
        assert_eq!([optics.raw_from_mm(399.0), optics.raw_from_mm(f64::NAN)], [super::super::NO_DEPTH; 2]);
    }
}
