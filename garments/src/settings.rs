//! Settings of the stage; each default serves any subject.

use serde::{Deserialize, Serialize};

/// How a garment is found in a scan and cut out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ExtractSettings {
    /// Cost of a metre of hem where neither colour nor shape tells an edge, in nats times metres (a strip of garment
    /// narrower than about twice this, with evidence of one nat, is not worth its rim). Default 0.012.
    pub smoothness: f32,
    /// How far from what was worn before a garment may hang, metres. Default 0.4.
    pub reach: f32,
    /// Radius within which a colour of the earlier layers is looked for, metres: posing is no more exact. Default 0.01.
    pub color_search: f32,
    /// Rounds of labelling, each with the colours that the last one found. Default 3.
    pub rounds: usize,
    /// Standard deviation of the smoothing that rounds the hem, metres. Default 0.008.
    pub hem_smoothing: f32,
    /// What a scan lacks at the edge of cloth that nothing lies close behind, metres: the camera's outermost pixel is
    /// mixed and filtered away, and half a pixel is lost by sampling. 0 trusts the scan's edge. Default 0.008 (1.5 pixels
    /// of a depth camera that sees 5.5 mm a pixel).
    pub edge_loss: f32,
    /// Standard deviation of the smoothing of a finished hem along itself, metres. Default 0.012.
    pub rim_smoothing: f32,
    /// The step at a hem is taken off over at most this width, metres. Default 0.03.
    pub hem_depth: f32,
    /// Least area of a garment, square metres; less is "no new garment". Default 0.006.
    pub least_area: f32,
    /// A separate piece is kept when it has this share of the largest one's area (socks and gloves come in twos).
    /// Default 0.2.
    pub piece_share: f32,
    /// Holes in the garment with a rim up to this length are closed, unless the body passes through them, metres.
    /// Default 0.15.
    pub hole_rim: f32,
    /// Distance over which skin weights become those of the surroundings, metres: cloth this far off the body follows
    /// no single limb. Default 0.03.
    pub loose_distance: f32,
    /// Mean edge length of the garment's mesh, metres; 0 keeps the scan's own triangles. Default 0.006.
    pub edge_length: f32,
}

impl Default for ExtractSettings {
    fn default() -> Self {
        Self {
            smoothness: 0.012,
            reach: 0.4,
            color_search: 0.01,
            rounds: 3,
            hem_smoothing: 0.008,
            edge_loss: 0.008,
            rim_smoothing: 0.012,
            hem_depth: 0.03,
            least_area: 0.006,
            piece_share: 0.2,
            hole_rim: 0.15,
            loose_distance: 0.03,
            edge_length: 0.006,
        }
    }
}

/// How layers are pushed apart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct StackSettings {
    /// Gap of a thin layer over each layer below, metres; no layer's gap is less. Pushes stop at four fifths of a gap.
    /// Default 0.0015.
    pub gap: f32,
    /// Distance over which a push spreads into its surroundings, metres. Default 0.015.
    pub spread: f32,
    /// Most rounds in each region, each time that it is solved. Default 80.
    pub rounds: usize,
    /// Heights are read up to this distance from a lower layer, metres. Default 0.05.
    pub reach: f32,
}

impl Default for StackSettings {
    fn default() -> Self {
        Self { gap: 0.0015, spread: 0.015, rounds: 80, reach: 0.05 }
    }
}

impl StackSettings {
    /// The gap of a layer of cloth `thickness` metres thick over what lies below. Meshes are the outer sides of cloth,
    /// so its own thickness has to fit in between.
    pub fn gap_of(&self, thickness: f32) -> f32 {
        self.gap.max(thickness)
    }
}

/// What an export leaves out because clothes hide it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CullSettings {
    /// What lies nearer to skin or cloth in sight is kept, metres along the surface: so far a hem may move. Default 0.03.
    pub margin: f32,
    /// Cloth this far off still hides, metres. Default 0.1.
    pub reach: f32,
}

impl Default for CullSettings {
    fn default() -> Self {
        Self { margin: 0.03, reach: 0.1 }
    }
}
