//! Calibration of two cameras, as OpenCV's `stereo_calib` writes it.

use std::path::Path;

use nalgebra::{Matrix3, Matrix3x4, Rotation3, Translation3, UnitQuaternion, Vector3};
use toile_capture::files::read_text;
use toile_geometry::Rigid;

use crate::{
    Lens, StereoError,
    file_storage::{self, FileStorage, Matrix},
};

/// Two cameras and where they stand.
#[derive(Debug, Clone, PartialEq)]
pub struct StereoCalibration {
    /// The left camera.
    pub left: Lens,
    /// The right camera.
    pub right: Lens,
    /// Where the left camera stands in the right camera's frame, metres.
    pub right_from_left: Rigid,
    /// The rectification that came with the calibration.
    pub rectified: Option<GivenRectification>,
    /// Columns and rows of the images it was made with, where the file says.
    pub image_size: Option<(u32, u32)>,
}

/// Rectification made by `cv::stereoRectify`.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenRectification {
    /// R1, R2: rectified_from_left and rectified_from_right.
    pub rotations: [Matrix3<f64>; 2],
    /// P1, P2: pixels from rectified rays; P2's fourth column is in metres.
    pub projections: [Matrix3x4<f64>; 2],
}

/// How far a rotation matrix of a file may be from a rotation, as the largest difference of R Rᵀ from 1: files round to
/// at least six digits.
const ROTATION_TOLERANCE: f64 = 1e-4;

/// Reads a calibration from one file, or from several that hold parts (`intrinsics.yml` with M1 D1 M2 D2,
/// `extrinsics.yml` with R T and perhaps R1 R2 P1 P2). `metres_per_unit` is the unit of the chessboard's squares that
/// the calibration was made with: 0.001 for millimetres.
///
/// # Errors
/// [`StereoError::Calibration`] names the file, the line and the matrix that is missing or wrong.
pub fn read_calibration<P: AsRef<Path>>(paths: &[P], metres_per_unit: f64) -> Result<StereoCalibration, StereoError> {
    let place = paths.iter().map(|p| p.as_ref().display().to_string()).collect::<Vec<_>>().join(", ");
    let wrong = |place: &str, reason: String| StereoError::Calibration { place: place.to_string(), reason };
    let mut all = FileStorage::default();
    for path in paths {
        let name = path.as_ref().display().to_string();
        let text = read_text(path.as_ref()).map_err(|e| wrong(&name, e.reason()))?;
        let part = file_storage::parse(&text).map_err(|e| wrong(&name, e))?;
        all.matrices.extend(part.matrices);
        all.numbers.extend(part.numbers);
    }
    calibration_of(&all, metres_per_unit).map_err(|e| wrong(&place, e))
}

/// The calibration that a file's matrices make up.
///
/// # Errors
/// A sentence that names the matrix.
pub fn calibration_of(storage: &FileStorage, metres_per_unit: f64) -> Result<StereoCalibration, String> {
    if !(metres_per_unit.is_finite() && metres_per_unit > 0.0) {
        return Err(format!("the unit must be a positive length in metres, not {metres_per_unit}"));
    }
    let rotation = rotation(storage, "R", "rotation from the left to the right camera")?;
    let t = matrix(storage, "T", "translation from the left to the right camera")?;
    let [x, y, z] = t.data[..] else { return Err(format!("T is {}x{}, it must have 3 numbers", t.rows, t.cols)) };
    let translation = Translation3::from(Vector3::new(x, y, z) * metres_per_unit);
    Ok(StereoCalibration {
        left: lens(storage, "M1", "D1")?,
        right: lens(storage, "M2", "D2")?,
        right_from_left: Rigid::from_parts(translation, rotation),
        rectified: given(storage, metres_per_unit)?,
        image_size: image_size(storage),
    })
}

fn matrix<'a>(storage: &'a FileStorage, name: &str, what: &str) -> Result<&'a Matrix, String> {
    storage.matrices.get(name).ok_or_else(|| {
        let names: Vec<&str> = storage.matrices.keys().map(String::as_str).collect();
        let has = if names.is_empty() { "none".into() } else { names.join(", ") };
        format!("matrix {name} ({what}) is missing; the file has {has}. Give both files where stereo_calib wrote two")
    })
}

fn lens(storage: &FileStorage, camera: &str, distortion: &str) -> Result<Lens, String> {
    let m = sized(storage, camera, "camera matrix", 3, 3)?;
    let [fx, skew, cx, zero, fy, cy, ..] = m.data[..] else { return Err(format!("{camera} is not a 3x3 matrix")) };
    if !(fx > 0.0 && fy > 0.0) || skew != 0.0 || zero != 0.0 {
        return Err(format!("{camera} is not a camera matrix: focal lengths {fx} and {fy}, skew {skew}"));
    }
    let given = &matrix(storage, distortion, "lens distortion")?.data;
    // 4, 5, 8, 12 or 14 coefficients (docs.opencv.org, calib3d): beyond eight come thin prism and tilt.
    if given.len() > 14 || given.iter().skip(8).any(|&k| k != 0.0) {
        return Err(format!("{distortion} has {} coefficients; calibrate with at most 8", given.len()));
    }
    let mut coefficients = [0.0; 8];
    coefficients.iter_mut().zip(given).for_each(|(to, from)| *to = *from);
    Ok(Lens { fx, fy, cx, cy, distortion: coefficients })
}

fn sized<'a>(storage: &'a FileStorage, name: &str, what: &str, rows: usize, cols: usize) -> Result<&'a Matrix, String> {
    let m = matrix(storage, name, what)?;
    if (m.rows, m.cols) != (rows, cols) {
        return Err(format!("{name} ({what}) is {}x{}, it must be {rows}x{cols}", m.rows, m.cols));
    }
    Ok(m)
}

/// R as a matrix, or as the rotation vector that older programs write.
fn rotation(storage: &FileStorage, name: &str, what: &str) -> Result<UnitQuaternion<f64>, String> {
    let m = matrix(storage, name, what)?;
    if let [x, y, z] = m.data[..] {
        return Ok(UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z)));
    }
    Ok(UnitQuaternion::from_rotation_matrix(&rotation_matrix(storage, name, what)?))
}

fn rotation_matrix(storage: &FileStorage, name: &str, what: &str) -> Result<Rotation3<f64>, String> {
    let m = Matrix3::from_row_slice(&sized(storage, name, what, 3, 3)?.data);
    let off = (m * m.transpose() - Matrix3::identity()).amax();
    if !(off <= ROTATION_TOLERANCE && m.determinant() > 0.0) {
        return Err(format!("{name} ({what}) is not a rotation: R Rᵀ is off by {off:.1e}"));
    }
    Ok(Rotation3::from_matrix_unchecked(m))
}

/// R1 R2 P1 P2, where all are there.
fn given(storage: &FileStorage, metres_per_unit: f64) -> Result<Option<GivenRectification>, String> {
    if !["R1", "R2", "P1", "P2"].iter().all(|name| storage.matrices.contains_key(*name)) {
        return Ok(None);
    }
    let projection = |name: &str| -> Result<Matrix3x4<f64>, String> {
        let mut p = Matrix3x4::from_row_slice(&sized(storage, name, "rectified projection", 3, 4)?.data);
        if !(p[(0, 0)] > 0.0 && p[(1, 1)] > 0.0) {
            return Err(format!("{name} has no positive focal length"));
        }
        p.set_column(3, &(p.column(3) * metres_per_unit));
        Ok(p)
    };
    let turn = |name: &str| rotation_matrix(storage, name, "rectifying rotation").map(Rotation3::into_inner);
    Ok(Some(GivenRectification {
        rotations: [turn("R1")?, turn("R2")?],
        projections: [projection("P1")?, projection("P2")?],
    }))
}

fn image_size(storage: &FileStorage) -> Option<(u32, u32)> {
    let whole =
        |name: &str| storage.numbers.get(name).copied().filter(|n| (1.0..=65535.0).contains(n)).map(|n| n as u32);
    Some((whole("image_width")?, whole("image_height")?))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn what_is_no_regular_file_is_refused_without_waiting() {
        let told = read_calibration(&["/dev/null"], 1.0).unwrap_err().to_string();
        assert!(told.contains("not a regular file"), "{told}");
    }

    pub(super) fn matrix_text(name: &str, rows: usize, data: &[f64]) -> String {
        let list: Vec<String> = data.iter().map(|x| format!("{x:e}")).collect();
        let cols = data.len() / rows;
        format!(
            "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: [ {} ]\n",
            list.join(", ")
        )
    }

    fn good() -> String {
        let m = [500.0, 0.0, 320.0, 0.0, 505.0, 240.0, 0.0, 0.0, 1.0];
        let parts = [
            matrix_text("M1", 3, &m),
            matrix_text("D1", 1, &[0.1, -0.2, 0.0, 0.0, 0.05]),
            matrix_text("M2", 3, &m),
            matrix_text("D2", 8, &[0.1, -0.2, 0.0, 0.0, 0.05, 0.01, 0.02, 0.03]),
            matrix_text("R", 3, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]),
            matrix_text("T", 3, &[-120.0, 0.0, 0.0]),
        ];
        format!("%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n{}", parts.concat())
    }

    fn read(text: &str) -> Result<StereoCalibration, String> {
        calibration_of(&file_storage::parse(text)?, 0.001)
    }

    #[test]
    fn a_calibration_is_read_in_metres() {
        let c = read(&good()).unwrap();
        assert_eq!((c.left.fx, c.left.cy, c.right.distortion[7]), (500.0, 240.0, 0.03));
        assert!((c.right_from_left.translation.vector - Vector3::new(-0.12, 0.0, 0.0)).norm() < 1e-12);
        assert_eq!((c.image_size, c.rectified), (Some((640, 480)), None));
    }

    #[test]
    fn parts_may_lie_in_two_files_and_a_missing_one_is_named() {
        let folder = std::env::temp_dir().join(format!("toile-calibration-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let (inner, outer) = (folder.join("intrinsics.yml"), folder.join("extrinsics.yml"));
        let text = good();
        let cut = text.find("R: !!").unwrap();
        std::fs::write(&inner, &text[..cut]).unwrap();
        std::fs::write(&outer, format!("%YAML:1.0\n---\n{}", &text[cut..])).unwrap();
        let both = read_calibration(&[&inner, &outer], 0.001).unwrap();
        assert_eq!(both, read(&text).unwrap());
        let error = read_calibration(&[&inner], 0.001).unwrap_err().to_string();
        assert!(error.contains("intrinsics.yml") && error.contains("matrix R "), "{error}");
        let error = read_calibration(&[folder.join("none.yml")], 0.001).unwrap_err().to_string();
        assert!(error.contains("none.yml"), "{error}");
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn matrices_that_cannot_be_are_named() {
        for (from, to, word) in [
            ("M2: !!", "N2: !!", "matrix M2 "),
            ("D1: !!", "E1: !!", "matrix D1 "),
            ("[ 5e2, 0e0, 3.2e2", "[ -5e2, 0e0, 3.2e2", "M1"),
            ("[ 5e2, 0e0, 3.2e2", "[ 5e2, 3e0, 3.2e2", "skew"),
            ("[ 1e0, 0e0, 0e0, 0e0, 1e0", "[ 1e0, 0e0, 0e0, 0e0, 2e0", "not a rotation"),
            (
                "rows: 3\n   cols: 1\n   dt: d\n   data: [ -1.2e2, 0e0, 0e0 ]",
                "rows: 2\n   cols: 1\n   dt: d\n   data: [ 1, 2 ]",
                "T is 2x1",
            ),
        ] {
            let error = read(&good().replacen(from, to, 1)).unwrap_err();
            assert!(error.contains(word), "{word}: {error}");
        }
        let tilted = good() + &matrix_text("D2", 14, &[0.1; 14]);
        assert!(read(&tilted).unwrap_err().contains("at most 8"));
        assert!(calibration_of(&file_storage::parse(&good()).unwrap(), 0.0).unwrap_err().contains("unit"));
    }

    #[test]
    fn a_rotation_vector_is_a_rotation_too() {
        let text = good() + &matrix_text("R", 3, &[0.0, 0.1, 0.0]);
        let angle = read(&text).unwrap().right_from_left.rotation.angle();
        assert!((angle - 0.1).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn no_number_makes_it_panic(at in 0usize..30, value in any::<f64>(), cut in 0usize..900) {
            let text = good();
            let mut words: Vec<String> = text.split(' ').map(String::from).collect();
            let at = words.len() - 1 - at;
            words[at] = format!("{value:e},");
            let text = words.join(" ");
            let _ = read(&text);
            let _ = read(&text[..cut.min(text.len())]);
        }
    }
}
