//! Parts of layers that move rigidly: the helpers to start from.

use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;

use super::{layer::DecompositionSettings, rigid_fit::rigid_fit, samples::Sampled, weights::Motion};

/// Fewest sampled vertices that a new helper is fitted to.
const FEWEST: usize = 8;

/// How often vertices choose their part and parts are fitted to their vertices, after each round of new parts.
const PASSES: usize = 2;

/// The parts of one layer.
struct Parts {
    helpers: Vec<Motion>,
    /// Which part each vertex belongs to: 0 the skin, else a helper and one.
    homes: Vec<usize>,
    /// Mean over the frames of each vertex's squared distance from where its part has it, metres².
    errors: Vec<f64>,
}

/// Rigid parts for all layers: in rounds in which their number doubles at most, those with the largest sums of squared errors are split at their worst
/// vertex, until the budget is spent or all parts are within the tolerance (Le and Deng 2012, section 4.2, the skin being
/// a part that is there from the start).
pub(super) fn find(layers: &[Sampled], settings: &DecompositionSettings) -> Vec<Vec<Motion>> {
    let mut all: Vec<Parts> = layers.iter().map(Parts::new).collect();
    loop {
        let total: usize = all.iter().map(|p| p.helpers.len()).sum();
        let wanted = total.max(4).min(settings.helpers - total);
        let seeds = worst(&all, layers, wanted, settings.tolerance * settings.tolerance);
        if seeds.is_empty() {
            return all.into_iter().map(|p| p.helpers).collect();
        }
        for (parts, (l, layer)) in all.iter_mut().zip(layers.iter().enumerate()) {
            let new: Vec<Motion> = seeds.iter().filter(|s| s.0 == l).map(|s| fitted(layer, &s.1)).collect();
            if !new.is_empty() {
                parts.helpers.extend(new);
                (0..PASSES).for_each(|_| parts.settle(layer));
            }
        }
    }
}

/// Where helpers rest: the mean of the vertices that each fits best among them.
pub(super) fn centers(layer: &Sampled, helpers: &[Motion]) -> Vec<Point3<f64>> {
    let mut sums = vec![(Vector3::zeros(), 0.0); helpers.len()];
    let best = |k: usize| nearest(layer, helpers, k).map(|(h, _)| h);
    let best: Vec<Option<usize>> = (0..layer.rest.len()).into_par_iter().map(best).collect();
    for (rest, home) in layer.rest.iter().zip(best) {
        if let Some(h) = home {
            sums[h].0 += rest.coords;
            sums[h].1 += 1.0;
        }
    }
    sums.iter().map(|(sum, count)| Point3::from(sum / f64::max(*count, 1.0))).collect()
}

impl Parts {
    fn new(layer: &Sampled) -> Self {
        Self { helpers: Vec::new(), homes: vec![0; layer.rest.len()], errors: layer.skin_errors.clone() }
    }

    /// Every vertex joins the part that moves as it does; every helper is fitted to its vertices.
    fn settle(&mut self, layer: &Sampled) {
        let choose = |k: usize| match nearest(layer, &self.helpers, k) {
            Some((h, error)) if error < layer.skin_errors[k] => (h + 1, error),
            _ => (0, layer.skin_errors[k]),
        };
        (self.homes, self.errors) = (0..layer.rest.len()).into_par_iter().map(choose).unzip();
        for (h, helper) in self.helpers.iter_mut().enumerate() {
            let members: Vec<usize> = (0..self.homes.len()).filter(|&k| self.homes[k] == h + 1).collect();
            if members.len() >= FEWEST {
                *helper = fitted(layer, &members);
            }
        }
    }
}

/// The helper that a vertex follows best, and its mean squared error.
fn nearest(layer: &Sampled, helpers: &[Motion], k: usize) -> Option<(usize, f64)> {
    let error = |helper: &Motion| {
        let miss = |(frame, t): (&Vec<Point3<f64>>, &Isometry3<f64>)| (t * layer.rest[k] - frame[k]).norm_squared();
        layer.frames.iter().zip(helper).map(miss).sum::<f64>() / layer.frames.len() as f64
    };
    helpers.iter().map(error).enumerate().min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The rigid motion of some vertices.
fn fitted(layer: &Sampled, members: &[usize]) -> Motion {
    let of_frame = |frame: &Vec<Point3<f64>>| {
        let pairs = members.iter().map(|&k| (layer.rest[k], frame[k], 1.0));
        rigid_fit(pairs).unwrap_or_else(Isometry3::identity)
    };
    layer.frames.par_iter().map(of_frame).collect()
}

/// At most `wanted` places where a new helper pays most: the layer, and the vertices to fit it to. Each is the worst vertex of the part with the
/// largest sum of squared errors, with its nearest neighbours in the part; then that part counts half.
fn worst(all: &[Parts], layers: &[Sampled], wanted: usize, tolerance: f64) -> Vec<(usize, Vec<usize>)> {
    let mut open: Vec<OpenPart> = Vec::new();
    for (l, parts) in all.iter().enumerate() {
        for home in 0..=parts.helpers.len() {
            let members: Vec<usize> = (0..parts.homes.len()).filter(|&k| parts.homes[k] == home).collect();
            // Layers of few vertices count as much as they have: a sample stands for as many as it was drawn from.
            let share = layers[l].vertices.last().map_or(1.0, |&v| f64::from(v + 1)) / parts.homes.len() as f64;
            let sum = members.iter().map(|&k| parts.errors[k]).sum::<f64>();
            if members.len() >= FEWEST && sum > tolerance * members.len() as f64 {
                open.push(OpenPart { layer: l, members, sum: share * sum });
            }
        }
    }
    let mut seeds = Vec::with_capacity(wanted);
    while seeds.len() < wanted {
        let largest = (0..open.len()).max_by(|&a, &b| open[a].sum.total_cmp(&open[b].sum).then(b.cmp(&a)));
        let Some(part) = largest.map(|i| &mut open[i]).filter(|p| p.sum > 0.0) else { break };
        let layer = part.layer;
        match part.split(&layers[layer], &all[layer].errors) {
            Some(members) => seeds.push((layer, members)),
            None => part.sum = 0.0,
        }
    }
    seeds
}

/// A part that may be split.
struct OpenPart {
    layer: usize,
    /// Vertices that no new helper was fitted to yet.
    members: Vec<usize>,
    /// What is left to gain, metres².
    sum: f64,
}

impl OpenPart {
    /// Takes the worst vertex and those around it out; `None` where too few are left.
    fn split(&mut self, layer: &Sampled, errors: &[f64]) -> Option<Vec<usize>> {
        let all = self.members.len();
        let &seed = self.members.iter().max_by(|&&a, &&b| errors[a].total_cmp(&errors[b]).then(b.cmp(&a)))?;
        let away = |k: &usize| (layer.rest[*k] - layer.rest[seed]).norm_squared();
        self.members.sort_by(|a, b| away(a).total_cmp(&away(b)).then(a.cmp(b)));
        let taken = (all / 4).max(FEWEST);
        if all < taken {
            return None;
        }
        let rest = self.members.split_off(taken);
        self.sum *= 0.5;
        Some(std::mem::replace(&mut self.members, rest))
    }
}
