//! Transforms of all helpers of a layer in a frame, weights given: Gauss–Newton over all of them at once.

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::{
    rigid_fit::{Pair, rigid_fit},
    samples::{Sampled, Weighted},
    weights::Motion,
};

/// Steps from a rigid fit of each helper by itself, and from the transforms of other weights.
const STEPS_FROM_SCRATCH: usize = 4;
const STEPS_TO_IMPROVE: usize = 2;

/// Share of a helper's own curvature that is added to it: helpers that move the same vertices in the same shares stay near where
/// each of them alone would be.
const DAMPING: f64 = 1e-3;

/// Moves each helper in every sampled frame to where the weighted vertices want it.
pub(super) fn improve(weighted: &Weighted, sampled: &Sampled, joints: &[Motion], helpers: &mut [Motion]) {
    let of_frame = |f: usize| {
        let mut transforms: Vec<Isometry3<f64>> = helpers.iter().map(|h| h[f]).collect();
        let residuals = without_skeleton(weighted, &joints[f], &sampled.frames[f]);
        (0..STEPS_TO_IMPROVE).for_each(|_| step(weighted, &residuals, &mut transforms));
        transforms
    };
    let found: Vec<Vec<Isometry3<f64>>> = (0..joints.len()).into_par_iter().map(of_frame).collect();
    for (f, transforms) in found.into_iter().enumerate() {
        transforms.into_iter().zip(helpers.iter_mut()).for_each(|(t, helper)| helper[f] = t);
    }
}

/// The helpers' transforms in a frame of which nothing is known but where the vertices are.
pub(super) fn from_scratch(
    weighted: &Weighted,
    joints: &[Isometry3<f64>],
    targets: &[Point3<f64>],
    count: usize,
) -> Vec<Isometry3<f64>> {
    let mut moved: Vec<Vec<Pair>> = vec![Vec::new(); count];
    for (k, influences) in weighted.helpers.iter().enumerate() {
        for &(helper, weight) in influences {
            moved[helper].push((weighted.rest[k], targets[k], weight * weight));
        }
    }
    let alone = |pairs: &Vec<Pair>| rigid_fit(pairs.iter().copied()).unwrap_or_else(Isometry3::identity);
    let mut transforms: Vec<Isometry3<f64>> = moved.iter().map(alone).collect();
    let residuals = without_skeleton(weighted, joints, targets);
    (0..STEPS_FROM_SCRATCH).for_each(|_| step(weighted, &residuals, &mut transforms));
    transforms
}

/// What is left of each vertex's place for the helpers: less what the skeleton's joints give.
fn without_skeleton(weighted: &Weighted, joints: &[Isometry3<f64>], targets: &[Point3<f64>]) -> Vec<Vector3<f64>> {
    let given = |k: usize| -> Vector3<f64> {
        weighted.skeleton[k].iter().map(|&(j, w)| w * (joints[usize::from(j)] * weighted.rest[k]).coords).sum()
    };
    targets.iter().enumerate().map(|(k, target)| target.coords - given(k)).collect()
}

/// One step of Gauss–Newton: each helper turns by ω about the mean of its vertices and shifts by u, all together.
fn step(weighted: &Weighted, wanted: &[Vector3<f64>], transforms: &mut [Isometry3<f64>]) {
    let count = transforms.len();
    let pivots = pivots(weighted, transforms);
    let (mut curvature, mut slope) = (DMatrix::<f64>::zeros(6 * count, 6 * count), DVector::<f64>::zeros(6 * count));
    let mut arms: Vec<(usize, f64, Vector3<f64>)> = Vec::with_capacity(4);
    for (k, influences) in weighted.helpers.iter().enumerate() {
        let mut miss = wanted[k];
        arms.clear();
        for &(helper, weight) in influences {
            let place = transforms[helper] * weighted.rest[k];
            miss -= weight * place.coords;
            arms.push((helper, weight, place - pivots[helper]));
        }
        for &(a, w, y) in &arms {
            add(&mut slope, 6 * a, w * y.cross(&miss));
            add(&mut slope, 6 * a + 3, w * miss);
            for &(b, v, z) in arms.iter().filter(|other| other.0 <= a) {
                add_block(&mut curvature, [6 * a, 6 * b], w * v, &y, &z);
            }
        }
    }
    for i in 0..6 * count {
        // What moves no vertex stays.
        curvature[(i, i)] = curvature[(i, i)] * (1.0 + DAMPING) + 1e-12;
    }
    let Some(solved) = curvature.cholesky().map(|c| c.solve(&slope)) else { return };
    for (h, transform) in transforms.iter_mut().enumerate() {
        let part = |at: usize| Vector3::new(solved[at], solved[at + 1], solved[at + 2]);
        let turn = UnitQuaternion::from_scaled_axis(part(6 * h));
        let about =
            Translation3::from(pivots[h].coords + part(6 * h + 3)) * turn * Translation3::from(-pivots[h].coords);
        *transform = about * *transform;
    }
}

/// Where the middle of each helper's vertices is now.
fn pivots(weighted: &Weighted, transforms: &[Isometry3<f64>]) -> Vec<Point3<f64>> {
    let mut sums = vec![(Vector3::zeros(), 0.0); transforms.len()];
    for (rest, influences) in weighted.rest.iter().zip(&weighted.helpers) {
        for &(helper, weight) in influences {
            sums[helper].0 += weight * weight * rest.coords;
            sums[helper].1 += weight * weight;
        }
    }
    let middle = |(sum, weight): &(Vector3<f64>, f64)| Point3::from(sum / weight.max(1e-12));
    sums.iter().zip(transforms).map(|(s, t)| t * middle(s)).collect()
}

fn add(vector: &mut DVector<f64>, at: usize, value: Vector3<f64>) {
    (0..3).for_each(|i| vector[at + i] += value[i]);
}

/// Adds the product of two helpers' derivatives, by turn and shift, of one vertex with lever arms y and z; the lower triangle counts.
fn add_block(matrix: &mut DMatrix<f64>, at: [usize; 2], weight: f64, y: &Vector3<f64>, z: &Vector3<f64>) {
    let turns = Matrix3::from_diagonal_element(y.dot(z)) - z * y.transpose();
    let (mixed, across) = (y.cross_matrix(), -z.cross_matrix());
    for i in 0..3 {
        matrix[(at[0] + 3 + i, at[1] + 3 + i)] += weight;
        for j in 0..3 {
            matrix[(at[0] + i, at[1] + j)] += weight * turns[(i, j)];
            matrix[(at[0] + i, at[1] + 3 + j)] += weight * mixed[(i, j)];
            matrix[(at[0] + 3 + i, at[1] + j)] += weight * across[(i, j)];
        }
    }
}
