//! Weights of each vertex on the skeleton's joints and on helpers.

use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use toile_character::{SkinWeights, skin::INFLUENCES};

use super::{
    layer::LayerMotion,
    samples::{Sampled, Weighted},
    simplex::{CANDIDATES, Gram, on_simplex},
};

/// Helpers that rest nearest to a vertex and are looked at; the best of them are weighed.
const NEAREST: usize = 12;

/// Added to each candidate's own squared error, metres² a frame: what a depth sensor cannot resolve need not be followed. It
/// keeps weights of neighbours alike where several joints would do.
const INDIFFERENCE: f64 = 1e-4 * 1e-4;

/// The motion of a helper over the frames.
pub(super) type Motion = Vec<Isometry3<f64>>;

/// A vertex over the frames.
struct Track<'a> {
    rest: Point3<f64>,
    /// Where it is in each frame.
    places: &'a [Point3<f64>],
    /// Joints of the skeleton that move it by skinning.
    joints: &'a [u8],
}

/// An influence: a joint of the skeleton or a helper.
#[derive(Clone, Copy)]
enum Source {
    Joint(u8),
    Helper(usize),
}

/// Weights of the sampled vertices.
pub(super) fn of_samples(
    sampled: &Sampled,
    joints: &[Motion],
    helpers: &[Motion],
    centers: &[Point3<f64>],
) -> Weighted {
    let found: Vec<Vec<(Source, f64)>> = (0..sampled.rest.len())
        .into_par_iter()
        .map(|k| {
            let places: Vec<Point3<f64>> = sampled.frames.iter().map(|f| f[k]).collect();
            let track = Track { rest: sampled.rest[k], places: &places, joints: &sampled.joints[k] };
            influences(&track, joints, helpers, centers)
        })
        .collect();
    let first = joints[0].len();
    let mut weights = SkinWeights::default();
    found.iter().for_each(|v| weights.push(&numbered(v, first)));
    let rest: Vec<Point3<f32>> = sampled.rest.iter().map(|p| p.cast::<f32>()).collect();
    let all: Vec<u32> = (0..rest.len() as u32).collect();
    Weighted::new(&rest, &all, &weights, first)
}

/// Weights of all vertices of a layer, helpers numbered from `first` on; without helpers, those that it has.
pub(super) fn of_layer(
    layer: &LayerMotion<'_>,
    joints: &[Motion],
    helpers: &[Motion],
    centers: &[Point3<f64>],
    first: usize,
) -> SkinWeights {
    if helpers.is_empty() {
        return layer.weights.clone();
    }
    let found: Vec<Vec<(Source, f64)>> = (0..layer.rest.len())
        .into_par_iter()
        .map(|v| {
            let places: Vec<Point3<f64>> = layer.frames.iter().map(|f| f[v].cast::<f64>()).collect();
            let own: Vec<u8> = layer.weights.of(v).map(|i| i.0).collect();
            influences(&Track { rest: layer.rest[v].cast(), places: &places, joints: &own }, joints, helpers, centers)
        })
        .collect();
    let mut weights = SkinWeights::default();
    found.iter().for_each(|v| weights.push(&numbered(v, first)));
    weights
}

fn numbered(influences: &[(Source, f64)], first: usize) -> Vec<(u8, f32)> {
    let number = |&(source, weight): &(Source, f64)| match source {
        Source::Joint(j) => (j, weight as f32),
        Source::Helper(h) => ((first + h) as u8, weight as f32),
    };
    influences.iter().map(number).collect()
}

/// The vertex's own joints and the helpers near it, weighed against each other.
fn influences(track: &Track<'_>, joints: &[Motion], helpers: &[Motion], centers: &[Point3<f64>]) -> Vec<(Source, f64)> {
    let mut candidates: Vec<(Source, Vec<Vector3<f64>>)> = Vec::with_capacity(CANDIDATES);
    for &joint in track.joints.iter().take(INFLUENCES) {
        let miss = |(place, frame): (&Point3<f64>, &Motion)| frame[usize::from(joint)] * track.rest - place;
        candidates.push((Source::Joint(joint), track.places.iter().zip(joints).map(miss).collect()));
    }
    let mut near: Vec<usize> = (0..helpers.len()).collect();
    let away = |h: &usize| (centers[*h] - track.rest).norm_squared();
    near.sort_by(|a, b| away(a).total_cmp(&away(b)).then(a.cmp(b)));
    near.truncate(NEAREST);
    let misses = |h: usize| -> Vec<Vector3<f64>> {
        track.places.iter().zip(&helpers[h]).map(|(place, moved)| moved * track.rest - place).collect()
    };
    let mut near: Vec<(usize, Vec<Vector3<f64>>)> = near.into_iter().map(|h| (h, misses(h))).collect();
    near.sort_by(|a, b| squared(&a.1).total_cmp(&squared(&b.1)).then(a.0.cmp(&b.0)));
    near.truncate(CANDIDATES - candidates.len());
    candidates.extend(near.into_iter().map(|(h, misses)| (Source::Helper(h), misses)));
    let count = candidates.len();
    let indifference = INDIFFERENCE * track.places.len() as f64;
    let product = |a: &[Vector3<f64>], b: &[Vector3<f64>]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
    let mut gram = Gram::zeros();
    for i in 0..count {
        for j in 0..=i {
            gram[(i, j)] = product(&candidates[i].1, &candidates[j].1);
            gram[(j, i)] = gram[(i, j)];
        }
        gram[(i, i)] += indifference;
    }
    let weights = on_simplex(&gram, count, INFLUENCES);
    candidates.iter().zip(weights.iter()).filter(|(_, w)| **w > 0.0).map(|(c, w)| (c.0, *w)).collect()
}

fn squared(misses: &[Vector3<f64>]) -> f64 {
    misses.iter().map(Vector3::norm_squared).sum()
}
