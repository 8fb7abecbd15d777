//! What a decomposition is made from.

use nalgebra::Point3;
use toile_character::SkinWeights;

/// A layer in the frames that a decomposition is made from.
#[derive(Debug, Clone, Copy)]
pub struct LayerMotion<'a> {
    /// Vertices at rest, metres: where `joints` of identity leave them.
    pub rest: &'a [Point3<f32>],
    /// Skin weights on the skeleton's joints.
    pub weights: &'a SkinWeights,
    /// Vertices in each frame, metres, in the frame of the joints' transforms.
    pub frames: &'a [Vec<Point3<f32>>],
}

/// What a decomposition may spend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecompositionSettings {
    /// At most so many helper joints over all layers, 0 to 200. More of them follow finer folds; a player pays for each. Default 64.
    pub helpers: usize,
    /// Parts that are nearer to the truth than this (root mean square, metres, above 0) get no more helpers. Default 0.0005.
    pub tolerance: f64,
}

impl Default for DecompositionSettings {
    fn default() -> Self {
        Self { helpers: 64, tolerance: 0.0005 }
    }
}
