//! The filtered depth of one frame, compact enough to keep a whole take.

use toile_geometry::camera::PinholeCamera;

use super::view::DepthView;

/// Filtered depth of the used part of an image, compact enough to keep a whole take.
#[derive(Debug, Clone, PartialEq)]
pub struct CutDepth {
    /// Ideal pinhole camera of the part.
    pub camera: PinholeCamera,
    /// Metres a unit.
    pub scale: f32,
    /// Row by row; 0 missing.
    pub values: Vec<u16>,
}

impl CutDepth {
    /// The part of `depth` (metres, 0 missing) that holds measured pixels, with an unmeasured border, which may lie
    /// outside the image.
    pub fn new(camera: &PinholeCamera, depth: &[f32], scale: f32) -> Self {
        let (w, h) = (camera.width as usize, camera.height as usize);
        let (mut x0, mut x1, mut y0, mut y1) = (w, 0, h, 0);
        for (y, row) in depth.chunks(w.max(1)).enumerate().filter(|(_, row)| holds_any(row)) {
            let first = row.iter().position(|d| *d > 0.0).unwrap_or(w);
            let last = row.iter().rposition(|d| *d > 0.0).unwrap_or(0);
            (x0, x1, y0, y1) = (x0.min(first), x1.max(last + 1), y0.min(y), y + 1);
        }
        if x0 >= x1 {
            (x0, x1, y0, y1) = (0, 0, 0, 0);
        }
        let mut cut = *camera;
        (cut.width, cut.height) = ((x1 - x0 + 2) as u32, (y1 - y0 + 2) as u32);
        (cut.cx, cut.cy) = (camera.cx - x0 as f64 + 1.0, camera.cy - y0 as f64 + 1.0);
        let mut values = vec![0; cut.width as usize * cut.height as usize];
        for (row, y) in values.chunks_mut(x1 - x0 + 2).skip(1).zip(y0..y1) {
            for (value, d) in row[1..].iter_mut().zip(&depth[y * w + x0..y * w + x1]) {
                *value = (d / scale + 0.5).min(f32::from(u16::MAX)) as u16;
            }
        }
        Self { camera: cut, scale, values }
    }

    /// Pixels with a measurement.
    pub fn count(&self) -> usize {
        self.values.iter().filter(|v| **v != 0).count()
    }

    /// Depth in metres.
    pub fn meters(&self) -> Vec<f32> {
        self.values.iter().map(|v| f32::from(*v) * self.scale).collect()
    }

    /// Surface elements from normals averaged over `window` pixels to each side, without colour.
    pub fn view(&self, window: usize) -> DepthView {
        DepthView::new(&self.camera, &self.meters(), window)
    }
}

/// True where any pixel is measured.
fn holds_any(row: &[f32]) -> bool {
    row.chunks(64).any(|c| c.iter().fold(0.0, |m, &d| if d > m { d } else { m }) > 0.0)
}
