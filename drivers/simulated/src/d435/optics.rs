//! The calibration of the modelled camera, and the tables that state it.
//!
//! Layout of the tables: `d400_coefficients_table` and `d400_rgb_calibration_table` of librealsense
//! `src/ds/d400/d400-private.h`, each behind `table_header` of `src/ds/ds-private.h`.

use nalgebra::{Matrix3, Vector3};

/// Sizes in the order of the coefficient table's rectified cameras (`ds_rect_resolutions`); the two without a name are
/// reserved.
const SIZES: [(u16, u16); 16] = [
    (1920, 1080),
    (1280, 720),
    (640, 480),
    (848, 480),
    (640, 360),
    (424, 240),
    (320, 240),
    (480, 270),
    (1280, 800),
    (960, 540),
    (0, 0),
    (0, 0),
    (640, 400),
    (576, 576),
    (720, 720),
    (1152, 1152),
];

/// True optics of one camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optics {
    /// Focal length of depth and infrared in 640×480, pixels.
    pub focal: f64,
    /// Their centre in 640×480.
    pub center: [f64; 2],
    /// From the left infrared camera to the right one along +X, metres.
    pub baseline: f64,
    /// Focal length of colour in 640×480.
    pub color_focal: f64,
    /// Its centre in 640×480.
    pub color_center: [f64; 2],
    /// Its distortion k1, k2, p1, p2, k3.
    pub color_distortion: [f64; 5],
    /// How colour sees a point of the depth camera's frame: rotation ...
    pub color_from_depth_rotation: Matrix3<f64>,
    /// ... and translation, metres.
    pub color_from_depth_translation: Vector3<f64>,
}

impl Default for Optics {
    fn default() -> Self {
        let (sin, cos) = 0.01_f64.sin_cos();
        Self {
            focal: 385.25,
            center: [319.25, 241.5],
            baseline: 0.05,
            color_focal: 615.5,
            color_center: [322.75, 236.25],
            color_distortion: [0.0; 5],
            color_from_depth_rotation: Matrix3::new(cos, 0.0, sin, 0.0, 1.0, 0.0, -sin, 0.0, cos),
            color_from_depth_translation: Vector3::new(0.0147, 0.0002, 0.0003),
        }
    }
}

impl Optics {
    /// Table 25: rectified cameras of all sizes, and the baseline.
    pub(super) fn coefficients(&self) -> Vec<u8> {
        let mut body = floats([0.0; 4 * 9]);
        body.extend(floats([(self.baseline * -1000.0) as f32]));
        body.extend(0u32.to_le_bytes());
        body.extend([0; 88]);
        SIZES.into_iter().for_each(|size| body.extend(floats(self.rectified(size))));
        body.extend([0; 64]);
        table(25, body)
    }

    /// Columns, rows and camera of every size, without a header.
    pub(super) fn cameras(&self) -> Vec<u8> {
        let sizes = SIZES.into_iter().filter(|(width, _)| *width > 0);
        let item = |size: (u16, u16)| {
            let mut bytes = [size.0, size.1].map(u16::to_le_bytes).as_flattened().to_vec();
            bytes.extend(floats(self.rectified(size)));
            bytes
        };
        sizes.flat_map(item).collect()
    }

    /// Focal lengths and centre: the narrower view of the same sensor, scaled by the columns, cut in the rows.
    fn rectified(&self, (width, height): (u16, u16)) -> [f32; 4] {
        let scale = f64::from(width) / 640.0;
        let rows = (f64::from(height) - 480.0 * scale) / 2.0;
        let [cx, cy] = self.center;
        [self.focal * scale, self.focal * scale, cx * scale, cy * scale + rows].map(|v| v as f32)
    }

    /// Table 32: the colour camera, calibrated in 1920×1080.
    pub(super) fn color(&self) -> Vec<u8> {
        // Normalised to -1..1 of the 16:9 image, of which 640×480 is the middle.
        let wide = 480.0 * 16.0 / 9.0;
        let [cx, cy] = self.color_center;
        let intrinsic = [
            [2.0 * self.color_focal / wide, 0.0, (2.0 * cx - 640.0) / wide],
            [0.0, 2.0 * self.color_focal / 480.0, 2.0 * cy / 480.0 - 1.0],
            [0.0, 0.0, 1.0],
        ];
        let mut body = floats(intrinsic.as_flattened().iter().map(|v| *v as f32));
        body.extend(floats(self.color_distortion.map(|v| v as f32)));
        body.extend(floats([0.0; 3 + 3 + 12]));
        body.extend([1920u16, 1080].map(u16::to_le_bytes).as_flattened());
        body.extend(floats(Matrix3::<f32>::identity().iter().copied()));
        // The table says how depth sees the colour camera's frame: its columns one after another, and the place in
        // millimetres with the sign that `get_d400_color_stream_extrinsic` turns around.
        let back = self.color_from_depth_rotation.transpose();
        let place = -(back * self.color_from_depth_translation);
        body.extend(floats(back.iter().map(|v| *v as f32)));
        body.extend(floats(place.iter().map(|v| (v * -1000.0) as f32)));
        body.extend([0; 24]);
        table(32, body)
    }
}

fn floats(values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    values.into_iter().flat_map(f32::to_le_bytes).collect()
}

/// Version (big-endian), type, size, a parameter and the checksum of the body.
fn table(kind: u16, body: Vec<u8>) -> Vec<u8> {
    let mut bytes = vec![3, 0];
    bytes.extend(kind.to_le_bytes());
    bytes.extend((body.len() as u32).to_le_bytes());
    bytes.extend([0; 4]);
    bytes.extend(crc32fast::hash(&body).to_le_bytes());
    bytes.extend(body);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_as_long_as_librealsense_has_them() {
        // sizeof(d400_coefficients_table) and sizeof(d400_rgb_calibration_table).
        assert_eq!(Optics::default().coefficients().len(), 16 + 4 * 36 + 4 + 4 + 88 + 256 + 64);
        assert_eq!(Optics::default().color().len(), 16 + 36 + 20 + 24 + 48 + 4 + 36 + 36 + 12 + 24);
    }
}
