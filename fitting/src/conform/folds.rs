//! Triangles of the template that turned over while it was deformed.

use nalgebra::Point3;
use toile_character::BodyModel;
use toile_geometry::mesh::triangle_normals;

/// A triangle that turned by more than this cosine (78°) is taken for folded.
const FOLD_COS: f32 = 0.2;
/// A corner of a fold follows the scan by this share of what it did.
const RELEASED: f64 = 0.1;
/// Rounds of going back; each halves the way that is left.
const ROUNDS: usize = 8;

/// Corners of triangles that turned over no longer follow the scan.
pub(crate) fn release_folds(model: &BodyModel, start: &[Point3<f32>], points: &[Point3<f32>], freedom: &mut [f64]) {
    for t in folded(model, start, points) {
        for v in model.triangles[t] {
            freedom[v as usize] *= RELEASED;
        }
    }
}

fn folded(model: &BodyModel, start: &[Point3<f32>], points: &[Point3<f32>]) -> Vec<usize> {
    let before = triangle_normals(start, &model.triangles);
    let after = triangle_normals(points, &model.triangles);
    (0..before.len()).filter(|&t| before[t].dot(&after[t]) < FOLD_COS).collect()
}

/// The points with folded triangles taken back towards `start`, step by step.
pub(crate) fn unfolded(model: &BodyModel, start: &[Point3<f32>], mut points: Vec<Point3<f32>>) -> Vec<Point3<f32>> {
    for _ in 0..ROUNDS {
        let folds = folded(model, start, &points);
        if folds.is_empty() {
            break;
        }
        let mut back = vec![false; points.len()];
        folds.iter().for_each(|&t| model.triangles[t].iter().for_each(|&v| back[v as usize] = true));
        for (v, _) in back.iter().enumerate().filter(|b| *b.1) {
            points[v] = nalgebra::center(&points[v], &start[v]);
        }
    }
    points
}
