//! A polyline, and what lies near it.

use nalgebra::{Point3, Vector3};

/// The path of a stroke or a hem line: one point or more.
pub(super) struct Line {
    points: Vec<Point3<f32>>,
    closed: bool,
}

/// The place of a polyline that is closest to a point.
pub(super) struct OnLine {
    pub point: Point3<f32>,
    pub distance: f32,
    /// Direction of the line there.
    pub along: Vector3<f32>,
    /// False where the point lies beyond an end.
    pub within: bool,
}

impl Line {
    pub fn new(points: &[[f32; 3]]) -> Self {
        let closed = points.len() > 3 && points.first() == points.last();
        Self { points: points.iter().map(|&p| Point3::from(p)).collect(), closed }
    }

    pub fn closest(&self, p: &Point3<f32>) -> OnLine {
        let start = self.points[0];
        let mut best = OnLine { point: start, distance: (p - start).norm(), along: Vector3::zeros(), within: false };
        let last = self.points.len().saturating_sub(2);
        for (k, pair) in self.points.windows(2).enumerate() {
            let along = pair[1] - pair[0];
            let t = (p - pair[0]).dot(&along) / along.norm_squared().max(1e-12);
            let point = pair[0] + along * t.clamp(0.0, 1.0);
            let distance = (p - point).norm();
            if distance <= best.distance {
                let beyond = !self.closed && ((k == 0 && t < 0.0) || (k == last && t > 1.0));
                best = OnLine { point, distance, along, within: !beyond };
            }
        }
        best
    }
}
