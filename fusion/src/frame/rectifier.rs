//! Depth images as an ideal camera sees them.

use toile_capture::{DepthImage, Sensor};
use toile_geometry::camera::PinholeCamera;

/// Depths of four neighbours are blended where they differ by at most this many pixel widths: by more, they lie on two
/// surfaces, and a blend of them would fly between. The same slope makes an edge in the depth filter.
const ONE_SURFACE: f64 = 8.3;

/// Brings depth images of one sensor to metres as an ideal camera of the same focal lengths sees them.
///
/// A pixel of the ideal camera falls between four of the sensor's. Taking the nearest one shifts the surface sideways by up
/// to half a pixel, by the same amount in every frame, so that it does not average out: the rest of that shift on slanted
/// surfaces was most of the error of scans with a bent lens. So depth is blended between the four where they see one surface.
#[derive(Debug, Clone)]
pub struct Rectifier {
    /// The ideal camera.
    pub camera: PinholeCamera,
    scale: f32,
    max_depth: f32,
    /// Largest difference of blended depths, as a share of the depth.
    slope: f32,
    /// Where each pixel lies in the sensor's image; empty where the lens is ideal already.
    map: Vec<Source>,
}

/// A place in the sensor's image.
#[derive(Debug, Clone, Copy)]
struct Source {
    /// Index of the pixel to the upper left (`u32::MAX`: outside).
    corner: u32,
    /// How far right of that pixel and below it, 0..1.
    aside: [f32; 2],
}

impl Rectifier {
    /// For a sensor; depth beyond `max_depth` metres counts as missing.
    pub fn new(sensor: &Sensor, max_depth: f64) -> Self {
        let camera = sensor.depth.undistorted();
        let distorted = sensor.depth.is_distorted();
        let map =
            if distorted { camera.rays().into_iter().map(|r| source(&sensor.depth, r)).collect() } else { vec![] };
        Self {
            camera,
            scale: sensor.depth_scale as f32,
            max_depth: max_depth as f32,
            slope: (ONE_SURFACE / camera.fx) as f32,
            map,
        }
    }

    /// Depth in metres, blended between the sensor's pixels where they see one surface, else the nearest one's; 0 where
    /// missing, saturated or too far.
    pub fn rectify(&self, image: &DepthImage) -> Vec<f32> {
        let meters = |v: u16| {
            let d = f32::from(v) * self.scale;
            if v == u16::MAX || d > self.max_depth { 0.0 } else { d }
        };
        let told: Vec<f32> = image.values.iter().map(|v| meters(*v)).collect();
        if self.map.is_empty() {
            return told;
        }
        let width = image.width as usize;
        self.map.iter().map(|source| self.depth_at(&told, width, source)).collect()
    }

    fn depth_at(&self, depth: &[f32], width: usize, source: &Source) -> f32 {
        let (i, [f, g]) = (source.corner as usize, source.aside);
        // The last column and row have no neighbours beyond them: there the offsets are 0.
        let (right, below) = (usize::from(f > 0.0), if g > 0.0 { width } else { 0 });
        let Some(&a) = depth.get(i) else { return 0.0 };
        let (b, c, d) = (depth[i + right], depth[i + below], depth[i + below + right]);
        let (near, far) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        if near > 0.0 && far - near <= self.slope * near {
            return (a * (1.0 - f) + b * f) * (1.0 - g) + (c * (1.0 - f) + d * f) * g;
        }
        match (f < 0.5, g < 0.5) {
            (true, true) => a,
            (false, true) => b,
            (true, false) => c,
            (false, false) => d,
        }
    }
}

/// Where a bent lens sees a ray of unit depth.
fn source(lens: &PinholeCamera, ray: [f32; 2]) -> Source {
    let outside = Source { corner: u32::MAX, aside: [0.0; 2] };
    let ahead = nalgebra::Point3::new(f64::from(ray[0]), f64::from(ray[1]), 1.0);
    let Some(q) = lens.project(&ahead) else { return outside };
    let last = [f64::from(lens.width) - 1.0, f64::from(lens.height) - 1.0];
    if !(q.x >= 0.0 && q.y >= 0.0 && q.x <= last[0] && q.y <= last[1]) {
        return outside;
    }
    let (u, v) = (q.x, q.y);
    Source { corner: v as u32 * lens.width + u as u32, aside: [u.fract() as f32, v.fract() as f32] }
}

#[cfg(test)]
mod tests {
    use toile_capture::DeviceIdentity;
    use toile_geometry::Rigid;

    use super::*;

    fn bent() -> Sensor {
        let mut depth = PinholeCamera::ideal(160, 120, 110.0, 110.0, 79.5, 59.5);
        depth.distortion = [0.09, -0.27, 0.001, -0.001, 0.095];
        Sensor {
            name: "bent".into(),
            identity: DeviceIdentity::default(),
            depth,
            depth_scale: 0.0001,
            color: None,
            color_from_depth: Rigid::identity(),
            rig_from_depth: Rigid::identity(),
            fps: 5.0,
        }
    }

    /// A steep plane before a far wall, seen through a bent lens, is where the ideal camera sees it: the nearest pixels'
    /// depths are 2.5 mm off and more.
    #[test]
    fn a_slanted_plane_behind_a_bent_lens_is_where_it_is() {
        let sensor = bent();
        let plane = |x: f64, y: f64| 2.0 / (1.0 - 1.2 * x - 0.5 * y);
        let seen = |[x, y]: [f32; 2]| if x < 0.2 { plane(f64::from(x), f64::from(y)) } else { 5.0 };
        let values = sensor.depth.rays().into_iter().map(|r| (seen(r) / 0.0001).round() as u16).collect();
        let image = DepthImage { width: 160, height: 120, values };
        let rectifier = Rectifier::new(&sensor, 6.0);
        let (rays, depth) = (rectifier.camera.rays(), rectifier.rectify(&image));
        let mut compared = 0;
        for ([x, y], d) in rays.into_iter().zip(depth).filter(|([x, _], d)| *x < 0.18 && *d > 0.0) {
            let off = f64::from(d) - plane(f64::from(x), f64::from(y));
            assert!(off.abs() < 1e-3, "{off} m at {x} {y}");
            compared += 1;
        }
        assert!(compared > 9000, "{compared}");
        // Nothing flies between the plane and the wall.
        let (rays, depth) = (rectifier.camera.rays(), rectifier.rectify(&image));
        let flies = |([x, y], d): &([f32; 2], f32)| {
            *d > 0.0 && (d - 5.0).abs() > 0.01 && (f64::from(*d) - plane(f64::from(*x), f64::from(*y))).abs() > 0.1
        };
        let flying = rays.into_iter().zip(depth).filter(flies).count();
        assert_eq!(flying, 0);
    }
}
