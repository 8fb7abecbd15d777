//! A layer of an outfit.

use toile_character::SkinWeights;
use toile_cloth::Fabric;
use toile_geometry::Mesh;

/// A layer of an outfit: the body, or a garment.
#[derive(Debug, Clone)]
pub struct OutfitLayer {
    /// Name of the layer.
    pub name: String,
    /// The mesh in the outfit's first pose.
    pub mesh: Mesh,
    /// Its skin weights.
    pub weights: SkinWeights,
    /// What it is made of; not read for the body.
    pub fabric: Fabric,
}
