//! What spring bones are found from.

use toile_character::SkinWeights;
use toile_geometry::Mesh;

/// A layer at rest in the T-pose.
#[derive(Debug, Clone, Copy)]
pub struct RestedLayer<'a> {
    /// Its mesh.
    pub mesh: &'a Mesh,
    /// Its skin weights.
    pub weights: &'a SkinWeights,
    /// Whether a part of it may hang around both legs: not trousers, hats, shoes.
    pub may_hang: bool,
}
