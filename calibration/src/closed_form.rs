//! First values of intrinsics and board poses from homographies (Zhang 2000), without lens distortion and skew.

use nalgebra::{DMatrix, Matrix3, Rotation3, UnitQuaternion, Vector3};
use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::homography::smallest_direction;

/// Squares of focal lengths that cameras have, in units of half the picture's longer side: 0.15 to 7 times that side.
const SQUARES: std::ops::Range<f64> = 0.09..200.0;

/// The camera that the homographies of a plane (metres to pixels) agree on; `None` where they do not determine it.
pub(crate) fn intrinsics(maps: &[Matrix3<f64>], width: u32, height: u32) -> Option<PinholeCamera> {
    // In units of half the picture about its middle all numbers are about 1.
    let (cx, cy) = (0.5 * (f64::from(width) - 1.0), 0.5 * (f64::from(height) - 1.0));
    let unit = 0.5 * f64::from(width.max(height));
    let center = Matrix3::new(1.0 / unit, 0.0, -cx / unit, 0.0, 1.0 / unit, -cy / unit, 0.0, 0.0, 1.0);
    let maps: Vec<Matrix3<f64>> = maps.iter().map(|h| center * h).collect();
    let [fx, fy, x, y] = from_many(&maps).or_else(|| with_centred_axis(&maps))?;
    Some(PinholeCamera::ideal(width, height, fx * unit, fy * unit, cx + x * unit, cy + y * unit))
}

/// The row that the entries of B = K⁻ᵀ K⁻¹ (B11, B22, B13, B23, B33; no skew) have for hᵢᵀ B hⱼ.
fn row(h: &Matrix3<f64>, i: usize, j: usize) -> [f64; 5] {
    let (a, b) = (h.column(i), h.column(j));
    [a[0] * b[0], a[1] * b[1], a[0] * b[2] + a[2] * b[0], a[1] * b[2] + a[2] * b[1], a[2] * b[2]]
}

/// Both constraints of a plane: its axes are square to each other and equally long.
fn constraints(h: &Matrix3<f64>) -> [[f64; 5]; 2] {
    let scale = 1.0 / h.column(0).norm().max(1e-12);
    let h = h * scale;
    let (a, b) = (row(&h, 0, 0), row(&h, 1, 1));
    [row(&h, 0, 1), std::array::from_fn(|k| a[k] - b[k])]
}

fn from_many(maps: &[Matrix3<f64>]) -> Option<[f64; 4]> {
    if maps.len() < 3 {
        return None;
    }
    let rows: Vec<[f64; 5]> = maps.iter().flat_map(constraints).collect();
    let b = smallest_direction(DMatrix::from_fn(rows.len(), 5, |i, j| rows[i][j]))?;
    let [b11, b22, b13, b23, b33] = b[..] else { return None };
    let (x, y) = (-b13 / b11, -b23 / b22);
    let scale = b33 - b13 * b13 / b11 - b23 * b23 / b22;
    let (fx2, fy2) = (scale / b11, scale / b22);
    let is_plausible = SQUARES.contains(&fx2)
        && SQUARES.contains(&fy2)
        && (0.25..4.0).contains(&(fx2 / fy2))
        && x.abs() < 1.0
        && y.abs() < 1.0;
    is_plausible.then(|| [fx2.sqrt(), fy2.sqrt(), x, y])
}

/// The same with the principal point in the picture's middle and one focal length: the median over all constraints.
fn with_centred_axis(maps: &[Matrix3<f64>]) -> Option<[f64; 4]> {
    // B is proportional to diag(1, 1, f²).
    let square = |c: [f64; 5]| -(c[0] + c[1]) / c[4];
    let mut all: Vec<f64> = maps.iter().flat_map(constraints).map(square).filter(|f| SQUARES.contains(f)).collect();
    let f = toile_geometry::statistics::median(&mut all)?.sqrt();
    Some([f, f, 0.0, 0.0])
}

/// Where the plane of a homography lies before a camera.
pub(crate) fn camera_from_plane(map: &Matrix3<f64>, camera: &PinholeCamera) -> Option<Rigid> {
    let k = Matrix3::new(camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0);
    let m = k.try_inverse()? * map;
    let scale = 2.0 / (m.column(0).norm() + m.column(1).norm());
    // The board lies before the camera.
    let m = if m[(2, 2)] < 0.0 { m * -scale } else { m * scale };
    let (x, y): (Vector3<f64>, Vector3<f64>) = (m.column(0).into(), m.column(1).into());
    let svd = Matrix3::from_columns(&[x, y, x.cross(&y)]).svd(true, true);
    let rotation = Rotation3::from_matrix_unchecked(svd.u? * svd.v_t?);
    let at: Vector3<f64> = m.column(2).into();
    let pose = Rigid::from_parts(at.into(), UnitQuaternion::from_rotation_matrix(&rotation));
    pose.translation.vector.iter().all(|v| v.is_finite()).then_some(pose)
}
