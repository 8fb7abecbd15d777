//! The camera's calibration tables to cameras.
//!
//! Layout: `table_header`, `ds_rect_resolutions` of librealsense `src/ds/ds-private.h`; `d400_coefficients_table`,
//! `d400_rgb_calibration_table` of `src/ds/d400/d400-private.h`; what their numbers mean: `d400-private.cpp`.

use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use toile_driver_transport::video::VideoNode;
use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::{RealsenseError, monitor};

/// Numbers of the tables (`d400_calibration_table_id`).
const COEFFICIENTS: u16 = 25;
const COLOR: u16 = 32;
/// Bytes before a table's body.
const HEADER: usize = 16;
/// Where the coefficient table's body has the baseline and the rectified cameras, and how long it is.
const BASELINE_AT: usize = 4 * 36;
const RECTIFIED_AT: usize = BASELINE_AT + 4 + 4 + 88;
const COEFFICIENT_BYTES: usize = RECTIFIED_AT + 16 * 16 + 64;
/// Where the colour table's body has distortion, calibrated size, rotation and translation, and how long it is.
const DISTORTION_AT: usize = 36;
const SIZE_AT: usize = 36 + 20 + 24 + 48;
const ROTATION_AT: usize = SIZE_AT + 4 + 36;
const TRANSLATION_AT: usize = ROTATION_AT + 36;
const COLOR_BYTES: usize = TRANSLATION_AT + 12 + 24;
/// Sizes of the rectified cameras, by their place in the table.
const SIZES: [(u32, u32, usize); 14] = [
    (1920, 1080, 0),
    (1280, 720, 1),
    (640, 480, 2),
    (848, 480, 3),
    (640, 360, 4),
    (424, 240, 5),
    (320, 240, 6),
    (480, 270, 7),
    (1280, 800, 8),
    (960, 540, 9),
    (640, 400, 12),
    (576, 576, 13),
    (720, 720, 14),
    (1152, 1152, 15),
];

/// The tables, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    coefficients: Vec<u8>,
    color: Option<Vec<u8>>,
}

impl Calibration {
    /// Reads the tables of a camera; without colour where it has none.
    ///
    /// # Errors
    /// [`RealsenseError`] where the firmware does not answer as it should or a table is damaged.
    pub fn read(node: &mut dyn VideoNode, has_color: bool) -> Result<Self, RealsenseError> {
        let coefficients = monitor::ask(node, monitor::TABLE, COEFFICIENTS.into())?;
        let color = has_color.then(|| monitor::ask(node, monitor::TABLE, COLOR.into())).transpose()?;
        Self::new(&coefficients, color.as_deref())
    }

    /// Takes the bytes of the tables.
    ///
    /// # Errors
    /// [`RealsenseError::Calibration`] where a table is short, another one, or its checksum is wrong.
    pub fn new(coefficients: &[u8], color: Option<&[u8]>) -> Result<Self, RealsenseError> {
        let checked = |bytes, kind, length| table(bytes, kind, length).map_err(RealsenseError::Calibration);
        let color = color.map(|bytes| checked(bytes, COLOR, COLOR_BYTES)).transpose()?;
        Ok(Self { coefficients: checked(coefficients, COEFFICIENTS, COEFFICIENT_BYTES)?, color })
    }

    /// The camera of depth and infrared (which is rectified) for pictures of a size.
    ///
    /// # Errors
    /// [`RealsenseError::Calibration`] where its numbers are impossible.
    pub fn depth_camera(&self, width: u32, height: u32) -> Result<PinholeCamera, RealsenseError> {
        let place = SIZES.iter().find(|(w, h, _)| (*w, *h) == (width, height)).map(|(.., place)| *place);
        // A size that is not in the table is a share of the whole sensor (`get_d400_intrinsic_by_resolution_...`).
        let (place, scale) = match place {
            Some(place) => (place, [1.0; 2]),
            None => (0, [f64::from(width) / 1920.0, f64::from(height) / 1080.0]),
        };
        let stated: [f64; 4] = std::array::from_fn(|i| float(&self.coefficients, RECTIFIED_AT + 16 * place + 4 * i));
        let [fx, fy, cx, cy] = [stated[0] * scale[0], stated[1] * scale[1], stated[2] * scale[0], stated[3] * scale[1]];
        checked(PinholeCamera::ideal(width, height, fx, fy, cx, cy), "depth")
    }

    /// From the left infrared camera, where depth is measured, to the right one along +X, metres.
    ///
    /// # Errors
    /// [`RealsenseError::Calibration`] where it is impossible.
    pub fn baseline(&self) -> Result<f64, RealsenseError> {
        // Stated in millimetres, and below zero.
        let metres = float(&self.coefficients, BASELINE_AT).abs() * 1e-3;
        if (1e-3..1.0).contains(&metres) {
            return Ok(metres);
        }
        Err(RealsenseError::Calibration(format!("its two infrared cameras are {metres} m apart")))
    }

    /// The colour camera for pictures of a size; `None` where there is none.
    ///
    /// # Errors
    /// [`RealsenseError::Calibration`] where its numbers are impossible.
    pub fn color_camera(&self, width: u32, height: u32) -> Result<Option<PinholeCamera>, RealsenseError> {
        let Some(table) = &self.color else { return Ok(None) };
        // Focal lengths and centre for an image from -1 to 1 in the calibrated size, whose longer side is kept.
        let [fx, fy, cx, cy] = [0, 4, 2, 5].map(|i| float(table, 4 * i));
        let stated = [short(table, SIZE_AT), short(table, SIZE_AT + 2)];
        let calibrated = if stated.contains(&0.0) { 9.0 / 16.0 } else { stated[1] / stated[0] };
        let (w, h) = (f64::from(width), f64::from(height));
        let ratio = h / w / calibrated;
        let (across, down) = if ratio < 1.0 { (1.0, 1.0 / ratio) } else { (ratio, 1.0) };
        let (fx, fy) = (fx * across * w / 2.0, fy * down * h / 2.0);
        let (cx, cy) = ((1.0 + cx * across) * w / 2.0, (1.0 + cy * down) * h / 2.0);
        let distortion: [f64; 5] = std::array::from_fn(|i| float(table, DISTORTION_AT + 4 * i));
        if distortion.iter().any(|k| *k != 0.0) {
            // They undo distortion where a camera's make it; factory calibrations have none.
            tracing::warn!("RealSense: the colour lens' coefficients {distortion:?} are left out");
        }
        checked(PinholeCamera::ideal(width, height, fx, fy, cx, cy), "colour").map(Some)
    }

    /// Where the depth camera stands in the colour camera's frame; identity where there is no colour camera.
    ///
    /// # Errors
    /// [`RealsenseError::Calibration`] where its rotation is not one.
    pub fn color_from_depth(&self) -> Result<Rigid, RealsenseError> {
        let Some(table) = &self.color else { return Ok(Rigid::identity()) };
        // Stated the other way round (`get_d400_color_stream_extrinsic`): columns one after another; millimetres, negated.
        let stated = Matrix3::from_iterator((0..9).map(|i| float(table, ROTATION_AT + 4 * i)));
        let place = Vector3::from_iterator((0..3).map(|i| float(table, TRANSLATION_AT + 4 * i) * -1e-3));
        let is_rotation = (stated * stated.transpose() - Matrix3::identity()).abs().max() < MAX_SKEW
            && stated.determinant() > 0.0
            && place.norm() < 1.0;
        if !is_rotation {
            return Err(RealsenseError::Calibration("the colour camera's place is impossible".into()));
        }
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&stated));
        Ok(Rigid::from_parts(Translation3::from(place), rotation).inverse())
    }
}

/// A rotation stated in single precision is orthogonal to this much.
const MAX_SKEW: f64 = 1e-3;

/// The body of a table whose header and checksum are right.
fn table(bytes: &[u8], kind: u16, length: usize) -> Result<Vec<u8>, String> {
    let Some((header, rest)) = bytes.split_at_checked(HEADER) else {
        return Err(format!("table {kind} has {} bytes", bytes.len()));
    };
    let stated = u16::from_le_bytes([header[2], header[3]]);
    if stated != kind {
        return Err(format!("table {stated} came where table {kind} was asked for"));
    }
    let size = u32::from_le_bytes([header[4], header[5], header[6], header[7]]) as usize;
    let Some(body) = rest.get(..size).filter(|body| body.len() >= length) else {
        return Err(format!("table {kind} says that it has {size} bytes; {} came and {length} are needed", rest.len()));
    };
    let (said, is) = (u32::from_le_bytes([header[12], header[13], header[14], header[15]]), crc32fast::hash(body));
    if said != is {
        return Err(format!("table {kind} has the checksum {is:08x} and says {said:08x}"));
    }
    Ok(body.to_vec())
}

fn checked(camera: PinholeCamera, what: &str) -> Result<PinholeCamera, RealsenseError> {
    if camera.is_valid() {
        return Ok(camera);
    }
    let PinholeCamera { fx, fy, cx, cy, .. } = camera;
    let reason = format!("the {what} camera's focal lengths {fx}, {fy} and centre {cx}, {cy} are impossible");
    Err(RealsenseError::Calibration(reason))
}

/// Bodies are checked to be long enough; NaN otherwise.
fn float(body: &[u8], at: usize) -> f64 {
    body.get(at..at + 4).map_or(f64::NAN, |b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]).into())
}

fn short(body: &[u8], at: usize) -> f64 {
    body.get(at..at + 2).map_or(0.0, |b| u16::from_le_bytes([b[0], b[1]]).into())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn bytes(kind: u16, body: &[u8]) -> Vec<u8> {
        let mut bytes = vec![3, 0];
        bytes.extend(kind.to_le_bytes());
        bytes.extend((body.len() as u32).to_le_bytes());
        bytes.extend([0; 4]);
        bytes.extend(crc32fast::hash(body).to_le_bytes());
        bytes.extend(body);
        bytes
    }

    #[test]
    fn the_checksum_is_that_of_the_check_value() {
        // CRC-32 of ISO 3309, whose table librealsense's `rsutils/number/crc32` has.
        assert_eq!(crc32fast::hash(b"123456789"), 0xcbf4_3926);
    }

    #[test]
    fn every_turned_bit_is_noticed() {
        let good = bytes(COEFFICIENTS, &[7; COEFFICIENT_BYTES]);
        assert!(Calibration::new(&good, None).is_ok());
        for bit in (0..8 * good.len()).filter(|bit| !matches!(bit / 8, 0..2 | 8..12)).step_by(13) {
            let mut bad = good.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            assert!(Calibration::new(&bad, None).is_err(), "bit {bit}");
        }
        assert!(Calibration::new(&good[..good.len() - 1], None).is_err());
    }

    proptest! {
        #[test]
        fn no_table_makes_it_panic(body in proptest::collection::vec(any::<u8>(), 0..600), color in any::<bool>()) {
            let (first, second) = (bytes(COEFFICIENTS, &body), bytes(COLOR, &body));
            if let Ok(tables) = Calibration::new(&first, color.then_some(&second[..])) {
                let _ = (tables.depth_camera(640, 480), tables.depth_camera(7, 9), tables.baseline());
                let _ = (tables.color_camera(640, 480), tables.color_from_depth());
            }
        }
    }
}
