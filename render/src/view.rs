//! Viewpoints of pictures.

use nalgebra::{Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use toile_geometry::{Rigid, camera::PinholeCamera, raster::Camera};

/// Share of the picture that stays free around what is shown.
const MARGIN: f64 = 0.04;

/// A direction to look from; the camera steps back until everything fits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Radians around +Y: 0 looks at the front (from +Z), π/2 from +X (the subject's left), π at the back.
    pub heading: f64,
    /// Radians above the horizon that the camera stands at.
    pub elevation: f64,
    /// Vertical field of view, radians.
    pub field: f64,
    /// World box (lowest, highest corner) to fit instead of the meshes: the same scale in several pictures.
    pub bounds: Option<(Point3<f32>, Point3<f32>)>,
}

impl Default for View {
    fn default() -> Self {
        Self::front()
    }
}

impl View {
    /// From the front, level, with a long lens.
    pub fn front() -> Self {
        Self { heading: 0.0, elevation: 0.0, field: 20f64.to_radians(), bounds: None }
    }

    /// From `heading` radians around +Y and `elevation` radians above the horizon.
    pub fn around(heading: f64, elevation: f64) -> Self {
        Self { heading, elevation, ..Self::front() }
    }

    /// The same view fitted to a box.
    pub fn fitted(self, bounds: (Point3<f32>, Point3<f32>)) -> Self {
        Self { bounds: Some(bounds), ..self }
    }

    /// The camera of `width` × `height` pixels that sees all `points` (or [`View::bounds`]) as large as possible.
    pub fn camera(&self, points: impl Iterator<Item = Point3<f32>>, width: u32, height: u32) -> Camera {
        let focal = 0.5 * f64::from(height) / (0.5 * self.field.clamp(0.01, 3.0)).tan();
        let lens = PinholeCamera::ideal(
            width,
            height,
            focal,
            focal,
            0.5 * (f64::from(width) - 1.0),
            0.5 * (f64::from(height) - 1.0),
        );
        let rotation = self.rotation();
        let turned: Vec<Vector3<f64>> = match self.bounds {
            Some((lo, hi)) => corners(lo, hi).iter().map(|p| rotation * p.coords.cast::<f64>()).collect(),
            None => points.map(|p| rotation * p.coords.cast::<f64>()).collect(),
        };
        let translation = Translation3::from(step_back(&turned, &lens));
        Camera { lens, camera_from_world: Rigid::from_parts(translation, rotation) }
    }

    /// Rotation of `camera_from_world`.
    fn rotation(&self) -> UnitQuaternion<f64> {
        let (sin_h, cos_h) = self.heading.sin_cos();
        let (sin_e, cos_e) = self.elevation.sin_cos();
        let back = Vector3::new(sin_h * cos_e, sin_e, cos_h * cos_e);
        let right = Vector3::new(cos_h, 0.0, -sin_h);
        let down = right.cross(&back);
        let rows = Matrix3::from_rows(&[right.transpose(), down.transpose(), -back.transpose()]);
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows))
    }
}

fn corners(lo: Point3<f32>, hi: Point3<f32>) -> [Point3<f32>; 8] {
    std::array::from_fn(|i| {
        let pick = |k: usize| if i >> k & 1 == 0 { lo[k] } else { hi[k] };
        Point3::new(pick(0), pick(1), pick(2))
    })
}

/// The translation of `camera_from_world` that centres turned points and moves them away until they fit.
fn step_back(turned: &[Vector3<f64>], lens: &PinholeCamera) -> Vector3<f64> {
    let Some(first) = turned.first() else { return Vector3::new(0.0, 0.0, 1.0) };
    let (lo, hi) = turned.iter().fold((*first, *first), |(lo, hi), p| (lo.inf(p), hi.sup(p)));
    let centre = (lo + hi) * 0.5;
    let half = [0.5 * f64::from(lens.width) * (1.0 - MARGIN), 0.5 * f64::from(lens.height) * (1.0 - MARGIN)];
    let distance = turned
        .iter()
        .map(|p| p - centre)
        .fold(0.02_f64, |d, p| d.max(p.x.abs() * lens.fx / half[0] - p.z).max(p.y.abs() * lens.fy / half[1] - p.z));
    Vector3::new(-centre.x, -centre.y, distance - centre.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_fits_and_left_is_on_the_right_from_the_front() {
        let points = [Point3::new(0.5, 0.0, 0.0), Point3::new(-0.4, 1.8, 0.2), Point3::new(0.0, 1.0, -0.3)];
        for heading in [0.0, 1.0, 3.0] {
            let camera = View::around(heading, 0.3).camera(points.into_iter(), 300, 400);
            for p in &points {
                let pixel = camera.lens.project(&(camera.camera_from_world * p.cast::<f64>())).unwrap();
                assert!((0.0..300.0).contains(&pixel.x) && (0.0..400.0).contains(&pixel.y), "{pixel}");
            }
        }
        let camera = View::front().camera(points.into_iter(), 300, 400);
        let pixel = |p: Point3<f32>| camera.lens.project(&(camera.camera_from_world * p.cast::<f64>())).unwrap();
        assert!(pixel(points[0]).x > pixel(points[1]).x, "+X, the subject's left, is on the picture's right");
        assert!(pixel(points[0]).y > pixel(points[1]).y, "+Y is up");
    }
}
