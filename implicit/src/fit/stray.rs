//! Primitives that went astray: what sticks out between the rays that held it.

use nalgebra::Point3;
use rayon::prelude::*;
use toile_character::Pose;

use super::samples::Samples;
use crate::{
    body::ImplicitBody,
    field::Field,
    surface::{Ray, Surface},
};

/// A ray that leaves the primitives so much farther out than the body shows one that sticks out, metres.
const ASTRAY: f64 = 0.012;

/// Indices of the primitives that make a ray at rest leave far outside of the body and lie outside of it themselves, ascending.
pub(super) fn stray(body: &ImplicitBody, samples: &Samples) -> Vec<usize> {
    let field = Field::new(body, &Pose::identity());
    let guilty = |s: &super::samples::Sample| {
        let origin = s.point - s.direction * s.depth;
        let ray = Ray { group: s.group, origin, direction: s.direction, reach: s.reach };
        let depth = field.outermost(&ray)?;
        (depth > s.depth + ASTRAY).then(|| strongest(body, &field, &ray, depth)).flatten()
    };
    let is_outside = |k: &usize| lies_outside(body, samples, *k);
    let mut found: Vec<usize> = samples.rest().par_iter().filter_map(guilty).filter(is_outside).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// Whether a primitive's centre lies beyond the skin, as the nearest sample at rest that its groups see has it.
fn lies_outside(body: &ImplicitBody, samples: &Samples, k: usize) -> bool {
    let primitive = &body.primitives[k];
    let center = body.skeleton.position(primitive.joint) + primitive.state.center;
    let seen = samples.rest().iter().filter(|s| primitive.groups.contains(s.group));
    let distance = |s: &&super::samples::Sample| (s.point - center).norm_squared();
    let nearest = seen.min_by(|a, b| distance(a).total_cmp(&distance(b)));
    nearest.is_some_and(|s| (center - s.point).dot(&s.direction) > 0.0)
}

/// The primitive that gives most where a ray leaves.
fn strongest(body: &ImplicitBody, field: &Field, ray: &Ray, depth: f64) -> Option<usize> {
    let at: Point3<f64> = ray.at(depth);
    let share = |k: &usize| field.share(&body.primitives[*k], body, &at);
    let seen = (0..body.primitives.len()).filter(|&k| body.primitives[k].groups.contains(ray.group));
    seen.max_by(|a, b| share(a).total_cmp(&share(b)).then(b.cmp(a)))
}
