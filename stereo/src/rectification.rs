//! Rectification: turns both cameras until rows correspond.

use nalgebra::{Matrix3, Point2, Rotation3, Vector2, Vector3};
use toile_geometry::camera::PinholeCamera;

use crate::{GivenRectification, Lens, StereoCalibration, StereoError};

/// Two rectified views: the same ideal camera at two places, so that points at infinity have disparity 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Rectification {
    /// The camera of both rectified views.
    pub camera: PinholeCamera,
    /// Distance of the two views, metres.
    pub baseline: f64,
    /// How the rectified left view looks into the left camera.
    pub left: RectifiedView,
    /// How the rectified right view looks into the right camera.
    pub right: RectifiedView,
}

/// One rectified view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RectifiedView {
    /// The camera it takes its pixels from.
    pub lens: Lens,
    /// Turns a ray of that camera into the rectified frame.
    pub rectified_from_camera: Matrix3<f64>,
}

/// Points along an edge of the image by which [`rectify`] decides how much of it is kept; OpenCV's number.
const GRID: usize = 9;

/// Rectifies images of `size` (columns, rows).
///
/// Where the calibration brings its own rectification, that is used (the right view's principal point is moved to the
/// left one's, so that infinity has disparity 0). Else Bouguet's method as `cv::stereoRectify` has it, with zero
/// disparity at infinity: each camera is turned half of the way, then both until the baseline lies along the rows.
/// `alpha` 0 zooms in until every pixel is seen by the camera, 1 zooms out until every pixel of the camera is shown, in
/// between are views in between, `None` keeps the mean focal length.
///
/// # Errors
/// [`StereoError::Rectification`] where the cameras stand above each other, in the wrong order, or at one place, and
/// where the calibration was made for another size.
pub fn rectify(
    calibration: &StereoCalibration,
    size: (u32, u32),
    alpha: Option<f64>,
) -> Result<Rectification, StereoError> {
    if let Some(made_for) = calibration.image_size.filter(|&made_for| made_for != size) {
        let reason = format!("the calibration is for {made_for:?} pixels, the images have {size:?}");
        return Err(StereoError::Rectification(reason));
    }
    let made = match &calibration.rectified {
        Some(given) => from_given(calibration, given, size),
        None => bouguet(calibration, size, alpha),
    };
    let made = made.map_err(StereoError::Rectification)?;
    if !(made.camera.is_valid() && made.baseline.is_finite()) {
        return Err(StereoError::Rectification(
            "the view that follows from its numbers is not finite; calibrate again".into(),
        ));
    }
    Ok(made)
}

fn from_given(c: &StereoCalibration, given: &GivenRectification, (w, h): (u32, u32)) -> Result<Rectification, String> {
    let [p1, p2] = &given.projections;
    let baseline = -p2[(0, 3)] / p2[(0, 0)];
    check_baseline(Vector3::new(-baseline, p2[(1, 3)] / p2[(1, 1)], 0.0))?;
    let [left, right] = given.rotations;
    Ok(Rectification {
        camera: PinholeCamera::ideal(w, h, p1[(0, 0)], p1[(1, 1)], p1[(0, 2)], p1[(1, 2)]),
        baseline,
        left: RectifiedView { lens: c.left, rectified_from_camera: left },
        right: RectifiedView { lens: c.right, rectified_from_camera: right },
    })
}

fn bouguet(c: &StereoCalibration, size: (u32, u32), alpha: Option<f64>) -> Result<Rectification, String> {
    let half = Rotation3::from_scaled_axis(c.right_from_left.rotation.scaled_axis() * -0.5);
    let t = half * c.right_from_left.translation.vector;
    check_baseline(t)?;
    // The rotation that lays t onto the rows.
    let axis = t.cross(&Vector3::new(t.x.signum(), 0.0, 0.0));
    let angle = (t.x.abs() / t.norm()).min(1.0).acos();
    let level = axis.try_normalize(0.0).map_or(Rotation3::identity(), |a| Rotation3::from_scaled_axis(a * angle));
    let left = RectifiedView { lens: c.left, rectified_from_camera: (level * half.inverse()).into_inner() };
    let right = RectifiedView { lens: c.right, rectified_from_camera: (level * half).into_inner() };
    let camera = common_camera([&left, &right], size, alpha);
    Ok(Rectification { camera, baseline: (level * t).x.abs(), left, right })
}

/// `t` is the left camera's place in the right camera's frame, turned half of the way.
fn check_baseline(t: Vector3<f64>) -> Result<(), String> {
    if t.y.abs() > t.x.abs() {
        return Err("the cameras are above each other; turn both images by 90 degrees and calibrate again".into());
    }
    if t.x >= 0.0 || !t.x.is_finite() {
        return Err(format!(
            "the right camera stands {:.3} m to the right of the left one; exchange left and right, or calibrate again",
            -t.x
        ));
    }
    Ok(())
}

/// The camera that both views share.
fn common_camera(views: [&RectifiedView; 2], (w, h): (u32, u32), alpha: Option<f64>) -> PinholeCamera {
    let f = f64::midpoint(views[0].lens.fy, views[1].lens.fy);
    let (right, bottom) = (f64::from(w) - 1.0, f64::from(h) - 1.0);
    let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)];
    let mean = |view: &RectifiedView| corners.iter().map(|&(u, v)| view.ray(u, v)).sum::<Vector2<f64>>() / 4.0;
    let middle = (mean(views[0]) + mean(views[1])) / 2.0 * f;
    let (cx, cy) = (right / 2.0 - middle.x, bottom / 2.0 - middle.y);
    let zoom = alpha.map_or(1.0, |alpha| zoom(views, (w, h), (cx / f, cy / f), f, alpha.clamp(0.0, 1.0)));
    PinholeCamera::ideal(w, h, f * zoom, f * zoom, cx, cy)
}

/// By how much to enlarge the view: between the rectangle that every ray of the border reaches beyond (`alpha` 0) and
/// the one that contains all rays (1).
fn zoom(views: [&RectifiedView; 2], (w, h): (u32, u32), (left, top): (f64, f64), f: f64, alpha: f64) -> f64 {
    let (right, bottom) = ((f64::from(w) - 1.0) / f - left, (f64::from(h) - 1.0) / f - top);
    let (mut inner, mut outer) = (0.0f64, f64::INFINITY);
    for view in views {
        let (i, o) = view.rectangles(w, h);
        let scales = |r: [f64; 4]| [left / -r[0], top / -r[1], right / r[2], bottom / r[3]];
        inner = scales(i).into_iter().fold(inner, f64::max);
        outer = scales(o).into_iter().fold(outer, f64::min);
    }
    inner * (1.0 - alpha) + outer * alpha
}

impl RectifiedView {
    /// The camera's pixel that the rectified ray (x, y, 1) comes from; `None` where the ray runs backwards.
    pub fn source(&self, ray: Vector2<f64>) -> Option<Point2<f64>> {
        let in_camera = self.rectified_from_camera.transpose() * Vector3::new(ray.x, ray.y, 1.0);
        (in_camera.z > 0.0).then(|| self.lens.pixel(in_camera.xy() / in_camera.z))
    }

    /// The rectified ray of the camera's pixel, approximately ([`Lens::normalized`]).
    fn ray(&self, u: f64, v: f64) -> Vector2<f64> {
        let ray = self.lens.normalized(Point2::new(u, v));
        let turned = self.rectified_from_camera * Vector3::new(ray.x, ray.y, 1.0);
        turned.xy() / turned.z
    }

    /// Left, top, right and bottom of the largest rectangle of rays inside the image and of the smallest around it.
    fn rectangles(&self, w: u32, h: u32) -> ([f64; 4], [f64; 4]) {
        let mut inner = [f64::NEG_INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::INFINITY];
        let mut outer = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        let share = |k: usize, size: u32| k as f64 * (f64::from(size) - 1.0) / (GRID - 1) as f64;
        for (row, column) in (0..GRID).flat_map(|row| (0..GRID).map(move |column| (row, column))) {
            let ray = self.ray(share(column, w), share(row, h));
            outer = [outer[0].min(ray.x), outer[1].min(ray.y), outer[2].max(ray.x), outer[3].max(ray.y)];
            if column == 0 {
                inner[0] = inner[0].max(ray.x);
            }
            if row == 0 {
                inner[1] = inner[1].max(ray.y);
            }
            if column == GRID - 1 {
                inner[2] = inner[2].min(ray.x);
            }
            if row == GRID - 1 {
                inner[3] = inner[3].min(ray.y);
            }
        }
        (inner, outer)
    }
}
