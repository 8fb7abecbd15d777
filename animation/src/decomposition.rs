//! Helper joints: layers that move by themselves, played by skinning alone.
//!
//! A player of glTF files knows joints and at most four weights a vertex. Smooth skinning decomposition with rigid bones (Le and Deng
//! 2012) finds both from moving vertices. Here the skeleton's joints are given and stay; helpers are added where they do not
//! suffice, for all layers from one budget.
//!
//! 1. [`sample_frames`] says which frames of a motion are to be looked at; [`decompose`] takes the layers in these frames:
//! 2. `clusters`: rigid parts, split where the error is largest, from layer to layer as needed;
//! 3. `weights`: at most four a vertex, not negative, of sum 1, by least squares;
//! 4. `transforms`: all helpers of a layer in a frame at once, by Gauss–Newton; 3 and 4 in turn;
//! 5. [`LayerHelpers::solve`] gives the helpers' transforms of any frame, one frame at a time and each by itself, so that a motion of
//!    any length can be written as it is computed.
//!
//! Results do not depend on the number of threads.

mod clusters;
mod layer;
mod rigid_fit;
mod samples;
mod simplex;
mod transforms;
mod weights;

pub use layer::{DecompositionSettings, LayerMotion};

use nalgebra::{Isometry3, Point3};
use toile_character::SkinWeights;

use crate::AnimationError;
use samples::Sampled;

/// At most so many frames are looked at: each costs 12 bytes a vertex, and a cloth's shapes repeat after some seconds.
const MOST_FRAMES: usize = 60;

/// How often weights and transforms are improved in turn. From then on the errors of a swinging skirt (`tests/decomposition.rs`) fall by less than
/// 2 % a turn.
const TURNS: usize = 8;

/// The helper joints of a layer and the weights of its vertices.
#[derive(Debug, Clone)]
pub struct LayerHelpers {
    /// At most four influences a vertex: the skeleton's joints, and helpers from `first` on.
    pub weights: SkinWeights,
    /// Index of the layer's first helper joint.
    pub first: usize,
    /// Where each helper rests, metres: amid the vertices that it moves. Its rest axes are the frame's own.
    pub centers: Vec<Point3<f64>>,
    /// The vertices that transforms are found from.
    samples: samples::Weighted,
}

/// The frames, of `count`, that a decomposition should be made from: the first, the last, and others evenly between them.
pub fn sample_frames(count: usize) -> Vec<usize> {
    if count <= MOST_FRAMES {
        return (0..count).collect();
    }
    (0..MOST_FRAMES).map(|k| k * (count - 1) / (MOST_FRAMES - 1)).collect()
}

/// Finds helper joints and weights by which skinning follows the `layers`. `joints` holds `posed_from_rest` of the skeleton's joints in each
/// frame; helpers are numbered behind them, layer by layer. A layer that its skin follows already keeps its weights and gets no helper.
///
/// # Errors
/// [`AnimationError::Setting`] for settings out of range; [`AnimationError::Motion`] where layers, joints and frames do not fit
/// together or a vertex is not finite.
pub fn decompose(
    layers: &[LayerMotion<'_>],
    joints: &[Vec<Isometry3<f64>>],
    settings: &DecompositionSettings,
) -> Result<Vec<LayerHelpers>, AnimationError> {
    check(layers, joints, settings)?;
    let sampled: Vec<Sampled> = layers.iter().map(|layer| Sampled::new(layer, joints)).collect();
    let parts = clusters::find(&sampled, settings);
    let mut first = joints[0].len();
    let mut found = Vec::with_capacity(layers.len());
    for ((layer, sampled), mut helpers) in layers.iter().zip(&sampled).zip(parts) {
        let centers = clusters::centers(sampled, &helpers);
        for _ in 0..if helpers.is_empty() { 0 } else { TURNS } {
            let weighted = weights::of_samples(sampled, joints, &helpers, &centers);
            transforms::improve(&weighted, sampled, joints, &mut helpers);
        }
        let weights = weights::of_layer(layer, joints, &helpers, &centers, first);
        let samples = samples::Weighted::new(layer.rest, &sampled.vertices, &weights, first);
        first += helpers.len();
        found.push(LayerHelpers { weights, first: first - helpers.len(), centers, samples });
    }
    Ok(found)
}

impl LayerHelpers {
    /// `posed_from_rest` of the layer's helpers in one frame: those by which its vertices come nearest to `positions`, the skeleton's
    /// joints moved by `joints`. Each frame by itself: the same whatever came before.
    ///
    /// # Errors
    /// [`AnimationError::Motion`] where the number of positions or joints is not that of the decomposition, or a position is not finite.
    pub fn solve(
        &self,
        joints: &[Isometry3<f64>],
        positions: &[Point3<f32>],
    ) -> Result<Vec<Isometry3<f64>>, AnimationError> {
        if positions.len() != self.weights.len() {
            let (given, had) = (positions.len(), self.weights.len());
            return Err(AnimationError::Motion(format!("a frame has {given} vertices, but the decomposition {had}")));
        }
        if self.samples.joints > joints.len() {
            let (given, last) = (joints.len(), self.samples.joints - 1);
            return Err(AnimationError::Motion(format!("a frame has {given} joints, but weights for joint {last}")));
        }
        finite(positions).map_err(AnimationError::Motion)?;
        let targets = self.samples.targets(positions);
        Ok(transforms::from_scratch(&self.samples, joints, &targets, self.centers.len()))
    }
}

fn check(
    layers: &[LayerMotion<'_>],
    joints: &[Vec<Isometry3<f64>>],
    settings: &DecompositionSettings,
) -> Result<(), AnimationError> {
    let wrong = |reason: String| Err(AnimationError::Motion(reason));
    if settings.helpers > 200 {
        let value = settings.helpers as f64;
        return Err(AnimationError::Setting { name: "helpers", value, range: "from 0 to 200" });
    }
    if settings.tolerance.is_nan() || settings.tolerance <= 0.0 {
        return Err(AnimationError::Setting { name: "tolerance", value: settings.tolerance, range: "above 0" });
    }
    let Some(first) = joints.first() else { return wrong("no frame to find helper joints from".into()) };
    if joints.iter().any(|frame| frame.len() != first.len()) || first.len() + settings.helpers > 256 {
        return wrong(format!("{} joints in the first frame; all need as many, with helpers at most 256", first.len()));
    }
    for (l, layer) in layers.iter().enumerate() {
        let (vertices, weighted) = (layer.rest.len(), layer.weights.len());
        let last = (0..weighted).flat_map(|v| layer.weights.of(v)).map(|i| usize::from(i.0)).max();
        if vertices != weighted || last.is_some_and(|j| j >= first.len()) {
            return wrong(format!("layer {l}: {vertices} vertices, weights for {weighted}, joints up to {last:?}"));
        }
        if layer.frames.len() != joints.len() || layer.frames.iter().any(|f| f.len() != vertices) {
            return wrong(format!(
                "layer {l}: its {} frames are not {} of {vertices} vertices",
                layer.frames.len(),
                joints.len()
            ));
        }
        for (f, frame) in layer.frames.iter().enumerate() {
            finite(frame).map_err(|reason| AnimationError::Motion(format!("layer {l}, frame {f}: {reason}")))?;
        }
    }
    Ok(())
}

fn finite(positions: &[Point3<f32>]) -> Result<(), String> {
    match positions.iter().position(|p| !p.coords.iter().all(|c| c.is_finite())) {
        Some(v) => Err(format!("vertex {v} is not finite")),
        None => Ok(()),
    }
}
