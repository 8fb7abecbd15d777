//! Global mapping by landmarks (Volino et al.'s V-Man, paper 004 §2.1.1): radial basis functions carry the landmarks of
//! the model to those of the scan and everything else smoothly along. As in the paper these are landmarks set by hand: those
//! that are found come from the same surface that the body was fitted to and tell nothing new (they were tried: crown and
//! hands, which follow from their surroundings, got worse).
//!
//! Distances are those of the body at rest, where limbs lie apart: a wrist beside the hip does not move the hip.

use nalgebra::{DMatrix, Point3, Vector3};
use rayon::prelude::*;
use toile_character::BodyModel;

use crate::landmarks::ScanLandmark;

/// Distance over which a landmark takes its surroundings along, metres.
const SUPPORT: f64 = 0.30;
/// Keeps the system solvable where two landmarks coincide.
const RIDGE: f64 = 1e-6;

/// Points of the posed template moved by the landmarks. `rest` are the same vertices at rest.
pub(crate) fn mapped(
    model: &BodyModel,
    rest: &[Point3<f32>],
    posed: &[Point3<f32>],
    landmarks: &[ScanLandmark],
) -> Vec<Point3<f32>> {
    let known: Vec<(&ScanLandmark, usize)> = landmarks
        .iter()
        .filter(|l| l.by_hand)
        .filter_map(|l| model.landmark(&l.name).map(|v| (l, v as usize)))
        .collect();
    let n = known.len();
    let between = |a: usize, b: usize| wendland(f64::from((rest[a] - rest[b]).norm()) / SUPPORT);
    let matrix = DMatrix::from_fn(n, n, |i, j| between(known[i].1, known[j].1) + if i == j { RIDGE } else { 0.0 });
    let moves = DMatrix::from_fn(n, 3, |i, k| known[i].0.position[k] - f64::from(posed[known[i].1][k]));
    let Some(factor) = matrix.cholesky() else { return posed.to_vec() };
    let weights = factor.solve(&moves);
    let shift = |v: usize| -> Vector3<f32> {
        let sum = (0..n).fold(Vector3::zeros(), |s, i| {
            let w = between(v, known[i].1);
            s + Vector3::new(weights[(i, 0)], weights[(i, 1)], weights[(i, 2)]) * w
        });
        sum.cast()
    };
    (0..posed.len()).into_par_iter().with_min_len(512).map(|v| posed[v] + shift(v)).collect()
}

/// Wendland's C2 function: positive definite in space, zero from 1 on.
fn wendland(r: f64) -> f64 {
    let t = (1.0 - r).max(0.0);
    t.powi(4) * (4.0 * r + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_landmark_set_by_hand_is_met_and_far_skin_stays() {
        let model = BodyModel::load_default().unwrap();
        let navel = model.landmark("navel").unwrap() as usize;
        let to = model.mean[navel].cast::<f64>() + Vector3::new(0.02, 0.01, 0.03);
        let set = ScanLandmark { name: "navel".into(), position: to.into(), seen: 1.0, moved_mm: 0.0, by_hand: true };
        let moved = mapped(&model, &model.mean, &model.mean, &[set]);
        assert!((moved[navel].cast::<f64>() - to).norm() < 1e-5);
        let head = model.landmark("vertex").unwrap() as usize;
        assert_eq!(moved[head], model.mean[head]);
        assert_eq!(mapped(&model, &model.mean, &model.mean, &[]), model.mean);
    }
}
