//! More primitives where the error is largest.

use super::{
    samples::Samples,
    start::{self, SIZES},
};
use crate::{body::ImplicitBody, primitive::Primitive};

/// Errors are averaged over this distance, metres: the size of a small muscle.
const AROUND: f64 = 0.03;
/// Added primitives lie at least so far apart, metres.
const APART: f64 = 0.06;

/// `count` primitives at the places of the samples at rest with the largest errors.
pub(super) fn primitives(body: &ImplicitBody, samples: &Samples, errors: &[f64], count: usize) -> Vec<Primitive> {
    let rest = samples.rest();
    let around = |k: usize| -> f64 {
        let near = (0..rest.len()).filter(|&j| {
            rest[j].group.meets(rest[k].group) && (rest[j].point - rest[k].point).norm_squared() < AROUND * AROUND
        });
        let (sum, number) = near.fold((0.0, 0.0), |(s, n), j| (s + errors[j] * errors[j], n + 1.0));
        sum / f64::max(number, 1.0)
    };
    let local: Vec<f64> = (0..rest.len()).map(around).collect();
    let mut order: Vec<usize> = (0..rest.len()).collect();
    order.sort_by(|&a, &b| local[b].total_cmp(&local[a]).then(a.cmp(&b)));
    let mut chosen: Vec<usize> = Vec::new();
    for k in order {
        if chosen.len() == count {
            break;
        }
        if chosen.iter().all(|&c| (rest[c].point - rest[k].point).norm() > APART) {
            chosen.push(k);
        }
    }
    let size = |k: usize| (0.35 * rest[k].depth).clamp(SIZES.0, 0.04);
    chosen
        .into_iter()
        .map(|k| start::primitive(body, &rest[k], rest[k].depth - 0.8 * size(k), 0.6 * size(k), size(k)))
        .collect()
}
