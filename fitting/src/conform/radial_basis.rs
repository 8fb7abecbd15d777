//! Maps by landmarks (the conformation of the V-Man project, §2.1.1): radial basis functions carry the landmarks of the model
//! to those of the scan, and everything else smoothly along.
//!
//! [`radial_basis_map`] is the paper's map of the whole body. [`carried`], the default, acts around landmarks that were
//! set by hand: found landmarks come from the surface that the body was fitted to and add nothing (crown and hands,
//! which follow from their surroundings, got worse). Its distances are those of the body at rest, where limbs lie
//! apart: a wrist beside the hip does not move the hip.

use nalgebra::{DMatrix, Point3, Vector3};
use rayon::prelude::*;
use toile_character::BodyModel;

use super::landmarks::ScanLandmark;
use crate::LandmarkMap;

/// Distance over which a landmark set by hand carries its surroundings along, metres: about a hand's length on each
/// side.
const SUPPORT: f64 = 0.30;
/// Keeps the system solvable where two landmarks coincide.
const RIDGE: f64 = 1e-6;
/// Smallest share of its surroundings that was seen of a found landmark that the map follows.
const SEEN: f64 = 0.5;

/// The posed template as the chosen map leaves it: where conformation starts. `rest` are the same vertices at rest.
pub(crate) fn mapped(
    model: &BodyModel,
    rest: &[Point3<f32>],
    posed: &[Point3<f32>],
    landmarks: &[ScanLandmark],
    map: LandmarkMap,
) -> Vec<Point3<f32>> {
    let used = |l: &&ScanLandmark| l.by_hand || (map == LandmarkMap::WholeBody && l.seen > SEEN);
    let known = landmarks.iter().filter(used).filter_map(|l| Some((model.landmark(&l.name)? as usize, l.position)));
    let known: Vec<(usize, Point3<f64>)> = known.map(|(v, p)| (v, p.into())).collect();
    let moved = match map {
        LandmarkMap::ByHand => carried(rest, posed, &known),
        LandmarkMap::WholeBody => {
            let from: Vec<Point3<f64>> = known.iter().map(|k| posed[k.0].cast()).collect();
            let to: Vec<Point3<f64>> = known.iter().map(|k| k.1).collect();
            radial_basis_map(&from, &to, posed)
        }
    };
    moved.unwrap_or_else(|| posed.to_vec())
}

/// `points` moved by the map that takes each point of `from` exactly to its counterpart in `to`: radial basis functions
/// φ(r) = r with an affine part, which of all maps that do so bends least in space (biharmonic spline). An affine motion
/// of the landmarks moves everything by that motion.
///
/// Metres, one frame; `from` and `to` have the same length. `None` where `from` has fewer than four points, lies in a
/// plane, or has a point twice. O(n³ + n m) for n landmarks and m points.
pub(crate) fn radial_basis_map(
    from: &[Point3<f64>],
    to: &[Point3<f64>],
    points: &[Point3<f32>],
) -> Option<Vec<Point3<f32>>> {
    let n = from.len();
    let affine = |p: &Point3<f64>, k: usize| if k == 0 { 1.0 } else { p[k - 1] };
    let matrix = DMatrix::from_fn(n + 4, n + 4, |i, j| match (i < n, j < n) {
        (true, true) => (from[i] - from[j]).norm(),
        (true, false) => affine(&from[i], j - n),
        (false, true) => affine(&from[j], i - n),
        (false, false) => 0.0,
    });
    let moves = DMatrix::from_fn(n + 4, 3, |i, k| if i < n { to[i][k] - from[i][k] } else { 0.0 });
    let weights = matrix.lu().solve(&moves).filter(|w| w.iter().all(|x| x.is_finite()))?;
    let weight = |i: usize| Vector3::new(weights[(i, 0)], weights[(i, 1)], weights[(i, 2)]);
    let moved = |p: &Point3<f32>| {
        let at: Point3<f64> = p.cast();
        let bent = (0..n).fold(Vector3::zeros(), |sum, i| sum + weight(i) * (at - from[i]).norm());
        (at + (0..4).fold(bent, |sum, k| sum + weight(n + k) * affine(&at, k))).cast()
    };
    Some(points.par_iter().with_min_len(512).map(moved).collect())
}

/// The posed template with the vertices `known` moved to where they belong, and their surroundings with them.
fn carried(rest: &[Point3<f32>], posed: &[Point3<f32>], known: &[(usize, Point3<f64>)]) -> Option<Vec<Point3<f32>>> {
    let n = known.len();
    let between = |a: usize, b: usize| wendland(f64::from((rest[a] - rest[b]).norm()) / SUPPORT);
    let matrix = DMatrix::from_fn(n, n, |i, j| between(known[i].0, known[j].0) + if i == j { RIDGE } else { 0.0 });
    let moves = DMatrix::from_fn(n, 3, |i, k| known[i].1[k] - f64::from(posed[known[i].0][k]));
    let weights = matrix.cholesky()?.solve(&moves);
    let shift = |v: usize| -> Vector3<f32> {
        let sum = (0..n).fold(Vector3::zeros(), |s, i| {
            let w = between(v, known[i].0);
            s + Vector3::new(weights[(i, 0)], weights[(i, 1)], weights[(i, 2)]) * w
        });
        sum.cast()
    };
    Some((0..posed.len()).into_par_iter().with_min_len(512).map(|v| posed[v] + shift(v)).collect())
}

/// Wendland's C2 function: positive definite in space, zero from 1 on.
fn wendland(r: f64) -> f64 {
    let t = (1.0 - r).max(0.0);
    t.powi(4) * (4.0 * r + 1.0)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, UnitQuaternion};

    use super::*;

    #[test]
    fn a_landmark_set_by_hand_is_met_and_far_skin_stays() {
        let model = BodyModel::load_default().unwrap();
        let navel = model.landmark("navel").unwrap() as usize;
        let to = model.mean[navel].cast::<f64>() + Vector3::new(0.02, 0.01, 0.03);
        let set = ScanLandmark { name: "navel".into(), position: to.into(), seen: 1.0, moved_mm: 0.0, by_hand: true };
        let moved = mapped(&model, &model.mean, &model.mean, &[set], LandmarkMap::ByHand);
        assert!((moved[navel].cast::<f64>() - to).norm() < 1e-5);
        let head = model.landmark("vertex").unwrap() as usize;
        assert_eq!(moved[head], model.mean[head]);
        assert_eq!(mapped(&model, &model.mean, &model.mean, &[], LandmarkMap::ByHand), model.mean);
    }

    fn corners() -> Vec<Point3<f64>> {
        (0..8).map(|i| Point3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))).collect()
    }

    #[test]
    fn an_affine_motion_of_the_landmarks_moves_everything_by_it() {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -1.0, 0.4)).to_rotation_matrix().into_inner();
        let stretch = turn * Matrix3::from_diagonal(&Vector3::new(1.1, 0.8, 1.3));
        let motion = |p: &Point3<f64>| stretch * p + Vector3::new(0.4, -2.0, 0.1);
        let to: Vec<Point3<f64>> = corners().iter().map(motion).collect();
        let points = [Point3::new(0.3, 0.9, -0.4), Point3::new(2.0, -1.5, 0.2)];
        let moved = radial_basis_map(&corners(), &to, &points).unwrap();
        for (p, q) in points.iter().zip(&moved) {
            assert!((q.cast::<f64>() - motion(&p.cast())).norm() < 1e-5, "{p} → {q}");
        }
    }

    #[test]
    fn landmarks_are_met_exactly_and_what_lies_between_follows() {
        let mut to = corners();
        to[7] += Vector3::new(0.2, -0.1, 0.3);
        let points: Vec<Point3<f32>> = corners().iter().map(|p| p.cast()).collect();
        let moved = radial_basis_map(&corners(), &to, &points).unwrap();
        assert!(moved.iter().zip(&to).all(|(q, t)| (q.cast::<f64>() - t).norm() < 1e-6), "{moved:?}");
        let middle = Point3::new(0.9, 0.9, 0.9);
        let follows = radial_basis_map(&corners(), &to, &[middle]).unwrap()[0] - middle;
        assert!(follows.norm() > 0.1 && follows.norm() < 0.4, "{follows}");
    }

    #[test]
    fn landmarks_that_determine_nothing_are_refused() {
        let flat: Vec<Point3<f64>> = corners().into_iter().take(4).collect();
        assert!(radial_basis_map(&flat, &flat, &[]).is_none());
        assert!(radial_basis_map(&corners()[..3], &corners()[..3], &[]).is_none());
    }
}
