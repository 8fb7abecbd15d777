//! Primitives fitted to a person's body by themselves.
//!
//! - `samples`: the contours' own rays leave the body at points; there the field shall be at its threshold, farther out below it;
//! - `start`: first primitives, spread over the body by how thick it is, beside the muscles;
//! - `solve`: Gauss–Newton steps on all parameters at once, sparse;
//! - `stray`: what went outside is taken away;
//! - `add`: more primitives where the error is largest, until it is small enough.

mod add;
mod samples;
mod solve;
mod start;
mod stray;

use toile_character::{BodyModel, Pose, SkinnedMesh};

use self::{samples::Samples, solve::Problem};
use crate::{
    ImplicitError, body::ImplicitBody, envelope::Envelope, field_function::FieldFunction, level::LEVELS,
    muscles::name_muscles,
};

/// How primitives are fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitSettings {
    /// The field function.
    pub field: FieldFunction,
    /// No more primitives than these.
    pub most: usize,
    /// Primitives are added until the mean distance is below this, metres.
    pub mean: f64,
    /// And 95 % of the distances below this, metres.
    pub p95: f64,
}

impl Default for FitSettings {
    /// A millimetre and a half on average, which is what the body's own fit to a scan leaves; 200 primitives make a file of 25 kB.
    fn default() -> Self {
        Self { field: FieldFunction::Wyvill, most: 200, mean: 0.0015, p95: 0.004 }
    }
}

/// Distances between primitives and body with a number of primitives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitStep {
    /// Number of primitives.
    pub primitives: usize,
    /// Mean distance at rest, metres.
    pub mean: f64,
    /// 95 % of the distances are below this, metres.
    pub p95: f64,
}

/// A fitted body and the way to it.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// The primitives.
    pub body: ImplicitBody,
    /// Error over number of primitives, in the order in which they were added.
    pub steps: Vec<FitStep>,
}

/// Fits primitives to `body` (its own shape at rest) as its skin moves in `poses`, with head, hands and feet by `beta`.
///
/// The first primitives are spread by themselves; more are added where the error is largest. The same input gives the same
/// primitives for any number of threads.
///
/// # Errors
/// [`ImplicitError`] where contours cannot be planned on the body.
pub fn fit(
    model: &BodyModel,
    body: &SkinnedMesh,
    beta: &[f64],
    name: &str,
    poses: &[Pose],
    settings: &FitSettings,
) -> Result<Fitted, ImplicitError> {
    let (name, skeleton, beta) = (name.to_string(), body.skeleton.clone(), beta.to_vec());
    let mut fitted = ImplicitBody { name, field: settings.field, skeleton, beta, scale: 1.0, primitives: Vec::new() };
    let envelope = Envelope::new(model, &fitted, LEVELS[0])?;
    let samples = Samples::new(&envelope, &fitted, body, poses);
    fitted.primitives = start::primitives(&fitted, &samples);
    let mut steps = Vec::new();
    let mut iterations = FIRST_ITERATIONS;
    for _ in 0..=MOST_BATCHES {
        let errors = settle(&mut fitted, &samples, iterations);
        let step = summary(fitted.primitives.len(), &errors);
        steps.push(step);
        let is_done = step.mean <= settings.mean && step.p95 <= settings.p95;
        let room = settings.most.saturating_sub(fitted.primitives.len());
        if is_done || room == 0 {
            break;
        }
        let batch = (fitted.primitives.len() / BATCH).clamp(1, room);
        fitted.primitives.extend(add::primitives(&fitted, &samples, &errors, batch));
        iterations = NEXT_ITERATIONS;
    }
    name_muscles(&mut fitted);
    Ok(Fitted { body: fitted, steps })
}

/// Moves the primitives into place and takes away those that went astray; returns the distances at rest.
fn settle(fitted: &mut ImplicitBody, samples: &Samples, iterations: usize) -> Vec<f64> {
    let mut errors = descended(fitted, samples, iterations);
    for _ in 0..CLEANINGS {
        let stray = stray::stray(fitted, samples);
        if stray.is_empty() {
            break;
        }
        let mut k = 0;
        fitted.primitives.retain(|_| {
            k += 1;
            stray.binary_search(&(k - 1)).is_err()
        });
        errors = descended(fitted, samples, NEXT_ITERATIONS / 2);
    }
    errors
}

fn descended(fitted: &mut ImplicitBody, samples: &Samples, iterations: usize) -> Vec<f64> {
    let mut problem = Problem::new(fitted, samples);
    problem.descend(iterations);
    let (primitives, errors) = (problem.primitives(), problem.errors());
    fitted.primitives = primitives;
    errors
}

/// How often what went astray is looked for.
const CLEANINGS: usize = 2;
/// Steps with the first primitives, and after more were added; by then they are nearly in place.
const FIRST_ITERATIONS: usize = 16;
const NEXT_ITERATIONS: usize = 8;
/// Batches are added at most so often: what goes astray is taken away again, so that their number alone would not end.
const MOST_BATCHES: usize = 5;
/// A batch of added primitives is this part of those that are there.
const BATCH: usize = 4;

fn summary(primitives: usize, errors: &[f64]) -> FitStep {
    let mut sorted: Vec<f64> = errors.iter().map(|e| e.abs()).collect();
    sorted.sort_by(f64::total_cmp);
    let mean = sorted.iter().sum::<f64>() / sorted.len().max(1) as f64;
    let p95 = sorted.get(sorted.len() * 95 / 100).copied().unwrap_or(0.0);
    FitStep { primitives, mean, p95 }
}
