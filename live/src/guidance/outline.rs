//! Where the subject is in one depth image: counts on a grid of heights and places to the side.

use nalgebra::Point3;
use serde::Serialize;
use toile_capture::{DepthImage, Sensor};
use toile_fusion::SubjectVolume;
use toile_geometry::camera::PinholeCamera;

/// Edge of the grid's cells, metres.
pub const CELL: f64 = 0.02;
/// Columns and rows of the grid: 2.4 m to the sides, 2.4 m up.
pub const SIDE: usize = 120;
/// Every such pixel of a row, and every such row, is looked at.
const STRIDE: usize = 2;
/// A border of the image is touched by at least this many of the looked-at pixels where the subject leaves the picture.
const TOUCHING: usize = 4;
/// So many of the looked-at pixels are somebody, as a share of all.
const SOMEBODY: f64 = 0.004;

/// Share of the pixels within the subject's outline that have no depth, by region of the body; `None` where nothing is seen
/// of a region.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Dropout {
    /// Above the shoulders.
    pub head: Option<f64>,
    /// Shoulders to waist.
    pub chest: Option<f64>,
    /// Waist to crotch.
    pub hips: Option<f64>,
    /// Below the crotch.
    pub legs: Option<f64>,
}

/// The subject in one depth image.
#[derive(Debug, Clone)]
pub struct Outline {
    /// Which pixels show the subject.
    pub is_subject: Vec<bool>,
    /// Median depth of the subject, metres.
    pub distance_m: f64,
    /// Height of its highest point over the ground, metres.
    pub height_m: f64,
    /// It touches no border of the image.
    pub is_whole: bool,
    /// Looked-at pixels of the subject and pixels without depth, by row (from the ground) and column.
    measured: Vec<u16>,
    missing: Vec<u16>,
}

impl Outline {
    /// The subject in `volume` before `sensor`; `None` where nobody is there. The lens's distortion is passed over: it moves
    /// points by less than a cell.
    pub fn new(sensor: &Sensor, depth: &DepthImage, volume: &SubjectVolume) -> Option<Self> {
        let camera = sensor.depth.undistorted();
        if depth.width != camera.width || depth.height != camera.height {
            return None;
        }
        let metres: Vec<f32> = depth.values.iter().map(|v| (f64::from(*v) * sensor.depth_scale) as f32).collect();
        let cut = volume.cut(&camera, &metres);
        let mut distances: Vec<f32> = cut.iter().step_by(7).copied().filter(|d| *d > 0.0).collect();
        if (distances.len() as f64) < SOMEBODY * (cut.len() / 7) as f64 {
            return None;
        }
        let middle = distances.len() / 2;
        let distance = *distances.select_nth_unstable_by(middle, f32::total_cmp).1;
        let mut outline = Self {
            is_subject: cut.iter().map(|d| *d > 0.0).collect(),
            distance_m: f64::from(distance),
            height_m: 0.0,
            is_whole: true,
            measured: vec![0; SIDE * SIDE],
            missing: vec![0; SIDE * SIDE],
        };
        outline.count(&camera, &metres, &cut, volume);
        Some(outline)
    }

    fn count(&mut self, camera: &PinholeCamera, metres: &[f32], cut: &[f32], volume: &SubjectVolume) {
        let (width, height) = (camera.width as usize, camera.height as usize);
        let mut touching = [0; 4];
        for v in (0..height).step_by(STRIDE) {
            for u in (0..width).step_by(STRIDE) {
                let k = v * width + u;
                let (counts, depth) = match (cut[k] > 0.0, metres[k] > 0.0) {
                    (true, _) => (&mut self.measured, f64::from(cut[k])),
                    (false, false) => (&mut self.missing, self.distance_m),
                    (false, true) => continue,
                };
                let point = unprojected(camera, [u as f64, v as f64], depth);
                if let Some(cell) = cell_of(&(volume.model_from_camera * point)) {
                    counts[cell] = counts[cell].saturating_add(1);
                }
                if cut[k] > 0.0 {
                    let at = [u < STRIDE, u + STRIDE >= width, v < STRIDE, v + STRIDE >= height];
                    touching.iter_mut().zip(at).for_each(|(count, is)| *count += usize::from(is));
                }
            }
        }
        self.is_whole = touching.iter().all(|count| *count < TOUCHING);
        // Single pixels fly over a head.
        let top = (0..SIDE).rev().find(|row| self.row(*row).iter().map(|n| usize::from(*n)).sum::<usize>() >= 3);
        self.height_m = top.map_or(0.0, |row| (row + 1) as f64 * CELL);
    }

    fn row(&self, row: usize) -> &[u16] {
        &self.measured[row * SIDE..(row + 1) * SIDE]
    }

    /// The rows from share `low` to share `high` of the height.
    pub fn rows(&self, low: f64, high: f64) -> std::ops::Range<usize> {
        let row = |share: f64| ((share * self.height_m / CELL) as usize).min(SIDE);
        row(low)..row(high)
    }

    /// First and last column of a row that show the subject.
    pub fn extent(&self, row: usize) -> Option<(usize, usize)> {
        let counts = self.row(row);
        Some((counts.iter().position(|n| *n > 0)?, counts.iter().rposition(|n| *n > 0)?))
    }

    /// Pieces of the subject beside one another in a row, with at least `gap` empty columns between them.
    pub fn pieces(&self, row: usize, gap: usize) -> usize {
        let (mut pieces, mut empty) = (0, gap);
        for count in self.row(row) {
            if *count == 0 {
                empty += 1;
            } else {
                pieces += usize::from(empty >= gap);
                empty = 0;
            }
        }
        pieces
    }

    /// Share of the pixels in these rows that lie between the outline's sides and have no depth; `None` where there is nobody.
    pub fn dropout(&self, rows: std::ops::Range<usize>) -> Option<f64> {
        let (mut measured, mut missing) = (0.0, 0.0);
        for row in rows {
            let Some((first, last)) = self.extent(row) else { continue };
            let cells = row * SIDE + first..=row * SIDE + last;
            measured += cells.clone().map(|k| f64::from(self.measured[k])).sum::<f64>();
            missing += cells.map(|k| f64::from(self.missing[k])).sum::<f64>();
        }
        (measured > 0.0).then(|| missing / (measured + missing))
    }

    /// By region. Levels as shares of the stature, as they are on the mean of the body model: shoulders 0.82, waist 0.62,
    /// crotch 0.47.
    pub fn dropouts(&self) -> Dropout {
        let of = |low, high| self.dropout(self.rows(low, high));
        Dropout { head: of(0.84, 1.0), chest: of(0.62, 0.84), hips: of(0.47, 0.62), legs: of(0.02, 0.47) }
    }
}

fn unprojected(camera: &PinholeCamera, [u, v]: [f64; 2], depth: f64) -> Point3<f64> {
    Point3::new((u - camera.cx) / camera.fx * depth, (v - camera.cy) / camera.fy * depth, depth)
}

/// The cell of a point in the model's frame: by its height and its place to the side.
fn cell_of(point: &Point3<f64>) -> Option<usize> {
    let column = (point.x / CELL).floor() as i64 + SIDE as i64 / 2;
    let row = (point.y / CELL).floor() as i64;
    let is_inside = |n: i64| (0..SIDE as i64).contains(&n);
    (is_inside(column) && is_inside(row)).then(|| row as usize * SIDE + column as usize)
}

#[cfg(test)]
pub mod drawn {
    //! Depth images of boxes before a camera, for tests.

    use toile_capture::DeviceIdentity;
    use toile_geometry::Rigid;

    use super::*;

    /// A sensor of 320 × 240 pixels, 1.2 m over the ground.
    pub fn sensor() -> Sensor {
        Sensor {
            name: "front".into(),
            identity: DeviceIdentity::default(),
            depth: PinholeCamera::ideal(320, 240, 220.0, 220.0, 159.5, 119.5),
            depth_scale: 0.001,
            color: None,
            color_from_depth: Rigid::identity(),
            rig_from_depth: Rigid::identity(),
            fps: 30.0,
        }
    }

    /// The volume before it: axis 2.5 m away.
    pub fn volume() -> SubjectVolume {
        use nalgebra::{Rotation3, Translation3, UnitQuaternion, Vector3};
        let flip = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let rotation = UnitQuaternion::from_rotation_matrix(&flip);
        let model_from_camera = Rigid::from_parts(Translation3::new(0.0, 1.2, 2.5), rotation);
        SubjectVolume {
            model_from_camera,
            radius: 1.0,
            bottom: Some(0.01),
            floor: None,
            image_up: toile_fusion::ImageSide::Top,
        }
    }

    /// Boxes (left, right, bottom, top; metres at the axis) before a wall at 4 m.
    pub fn boxes(boxes: &[[f64; 4]]) -> DepthImage {
        let (sensor, volume) = (sensor(), volume());
        let value = |k: u32| {
            let at = [f64::from(k % 320), f64::from(k / 320)];
            let p = volume.model_from_camera * unprojected(&sensor.depth, at, 2.5);
            let is_in = |b: &[f64; 4]| (b[0]..b[1]).contains(&p.x) && (b[2]..b[3]).contains(&p.y);
            if boxes.iter().any(is_in) { 2500 } else { 4000 }
        };
        DepthImage { width: 320, height: 240, values: (0..320 * 240).map(value).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::{drawn::*, *};

    #[test]
    fn distance_height_borders_and_dropout_are_those_of_the_picture() {
        let body = [-0.2, 0.2, 0.0, 1.7];
        let outline = Outline::new(&sensor(), &boxes(&[body]), &volume()).unwrap();
        assert!((outline.distance_m - 2.5).abs() < 0.01, "{}", outline.distance_m);
        assert!((outline.height_m - 1.7).abs() < 0.04, "{}", outline.height_m);
        assert!(outline.is_whole);
        assert_eq!(outline.dropouts().chest, Some(0.0));
        // The head leaves the picture at 2.56 m.
        let tall = Outline::new(&sensor(), &boxes(&[[-0.2, 0.2, 0.0, 2.6]]), &volume()).unwrap();
        assert!(!tall.is_whole);
        let mut holed = boxes(&[body]);
        holed.values.iter_mut().enumerate().filter(|(k, v)| k % 4 == 0 && **v == 2500).for_each(|(_, v)| *v = 0);
        let holed = Outline::new(&sensor(), &holed, &volume()).unwrap().dropouts();
        let chest = holed.chest.unwrap();
        assert!((0.4..0.6).contains(&chest), "every other looked-at pixel: {chest}");
        assert!(Outline::new(&sensor(), &boxes(&[]), &volume()).is_none(), "nobody");
    }
}
