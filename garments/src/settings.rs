//! Settings of the stage; each default serves any subject.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use crate::error::GarmentError;

/// How the vertices of a scan are labelled as new garment or not.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Labelling {
    /// One energy over height, colour and place, minimised by a graph cut; then hems, islands and closed patches are
    /// settled.
    #[default]
    GraphCut,
    /// The seed's own way (Hu et al. 2017, §6.2): the label of the nearest body vertex in a template of the garment's
    /// type. It is rough: strokes and hem lines are meant to correct it. Garments of the type `other` have no template.
    NearestBodyVertex,
}

/// How a garment is found in a scan and cut out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ExtractSettings {
    /// How vertices are labelled: `graph-cut` or `nearest-body-vertex` (the seed's own way). Default `graph-cut`.
    pub labelling: Labelling,
    /// Cost of a metre of hem where neither colour nor shape shows an edge, nats times metres, 0 to 0.1: a strip of
    /// garment narrower than about twice this, with evidence of one nat, is not worth its rim. Default 0.012.
    pub smoothness: f32,
    /// How far from what was worn before a garment may hang, metres, 0.05 to 1. Default 0.4.
    pub reach: f32,
    /// Radius within which a colour of the earlier layers is looked for, metres, 0 to 0.05: posing is that exact. Default
    /// 0.01.
    pub color_search: f32,
    /// Rounds of labelling, each with the colours that the last one found, 1 to 10. Default 3.
    pub rounds: usize,
    /// Standard deviation of the smoothing that rounds the hem, metres, 0 to 0.05. Default 0.008.
    pub hem_smoothing: f32,
    /// Width that a scan lacks at the edge of cloth that nothing lies close behind, metres, 0 to 0.03: the camera's outermost
    /// pixel is mixed and filtered away, and half a pixel is lost by sampling. 0 trusts the scan's edge. Default 0.008
    /// (1.5 pixels of a depth camera that sees 5.5 mm a pixel).
    pub edge_loss: f32,
    /// Standard deviation of the smoothing of a finished hem along itself, metres, 0 to 0.05. Default 0.012.
    pub rim_smoothing: f32,
    /// The step at a hem is taken off over at most this width in a round, metres, 0 to 0.1. Default 0.03.
    pub hem_depth: f32,
    /// Smallest area of a garment, square metres, 0 to 0.1; less is "no new garment". Default 0.006.
    pub least_area: f32,
    /// A separate piece is kept when it has this share of the largest one's area, 0 to 1 (socks and gloves come in
    /// twos). Default 0.2.
    pub piece_share: f32,
    /// Holes in the garment with a rim up to this length are closed, unless the body passes through them, metres, 0 to 1.
    /// Default 0.15.
    pub hole_rim: f32,
    /// Distance over which skin weights become those of the surroundings, metres, 0.001 to 0.2: cloth this far off the
    /// body follows no single limb. Default 0.03.
    pub loose_distance: f32,
    /// Mean edge length of the garment's mesh, metres, 0.002 to 0.05; 0 keeps the scan's own triangles. Default 0.006.
    pub edge_length: f32,
}

impl Default for ExtractSettings {
    fn default() -> Self {
        Self {
            labelling: Labelling::GraphCut,
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

impl ExtractSettings {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`GarmentError::Settings`] names the first number that is outside, with its range.
    pub fn check(&self) -> Result<(), GarmentError> {
        check_ranges(&[
            ("smoothness", self.smoothness, 0.0..=0.1),
            ("reach", self.reach, 0.05..=1.0),
            ("color_search", self.color_search, 0.0..=0.05),
            ("rounds", self.rounds as f32, 1.0..=10.0),
            ("hem_smoothing", self.hem_smoothing, 0.0..=0.05),
            ("edge_loss", self.edge_loss, 0.0..=0.03),
            ("rim_smoothing", self.rim_smoothing, 0.0..=0.05),
            ("hem_depth", self.hem_depth, 0.0..=0.1),
            ("least_area", self.least_area, 0.0..=0.1),
            ("piece_share", self.piece_share, 0.0..=1.0),
            ("hole_rim", self.hole_rim, 0.0..=1.0),
            ("loose_distance", self.loose_distance, 0.001..=0.2),
        ])?;
        if self.edge_length == 0.0 { Ok(()) } else { check_ranges(&[("edge_length", self.edge_length, 0.002..=0.05)]) }
    }
}

/// How layers that cut through one another are parted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StackMethod {
    /// All layers of a region are moved together, smoothly, until an exact test finds no crossing.
    #[default]
    Regions,
    /// The seed's own way (Hu et al. 2017, eq. 7): each vertex inside a lower layer is pushed out along its own normal,
    /// once. Crossings can remain and are reported.
    PushAlongNormal,
}

/// How layers are pushed apart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StackSettings {
    /// How layers are parted: `regions` or `push-along-normal` (the seed's own way). Default `regions`.
    pub method: StackMethod,
    /// Gap of a thin layer over each layer below, metres, 0 to 0.02; thicker cloth has a larger one. Pushes stop at four
    /// fifths of a gap. Default 0.0015.
    pub gap: f32,
    /// Distance over which a push spreads into its surroundings, metres, 0.002 to 0.1. Default 0.015.
    pub spread: f32,
    /// Limit of the rounds in each region, each time that it is solved, 0 to 1000. Default 80.
    pub rounds: usize,
    /// Heights are read up to this distance from a lower layer, metres, 0.01 to 0.2. Default 0.05.
    pub reach: f32,
    /// The coefficient k of the seed's eq. 7: how far beyond the surface a vertex is pushed along its normal, metres, 0 to
    /// 0.02. Only `push-along-normal` uses it. Default 0.0015, the gap of a thin layer.
    pub push_beyond: f32,
}

impl Default for StackSettings {
    fn default() -> Self {
        Self { method: StackMethod::Regions, gap: 0.0015, spread: 0.015, rounds: 80, reach: 0.05, push_beyond: 0.0015 }
    }
}

impl StackSettings {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`GarmentError::Settings`] names the first number that is outside, with its range.
    pub fn check(&self) -> Result<(), GarmentError> {
        check_ranges(&[
            ("gap", self.gap, 0.0..=0.02),
            ("spread", self.spread, 0.002..=0.1),
            ("rounds", self.rounds as f32, 0.0..=1000.0),
            ("reach", self.reach, 0.01..=0.2),
            ("push_beyond", self.push_beyond, 0.0..=0.02),
        ])
    }

    /// The gap of a layer of cloth `thickness` metres thick over what lies below. Meshes are the outer sides of cloth,
    /// so its own thickness has to fit in between.
    pub fn gap_of(&self, thickness: f32) -> f32 {
        self.gap.max(thickness)
    }
}

/// Triangles that an export leaves out because clothes hide them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CullSettings {
    /// Triangles nearer than this to skin or cloth in sight are kept, metres along the surface, 0 to 1: so far a hem may move.
    /// Default 0.03.
    pub margin: f32,
    /// Cloth this far off still hides, metres, 0.01 to 1. Default 0.1.
    pub reach: f32,
}

impl Default for CullSettings {
    fn default() -> Self {
        Self { margin: 0.03, reach: 0.1 }
    }
}

impl CullSettings {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`GarmentError::Settings`] names the first number that is outside, with its range.
    pub fn check(&self) -> Result<(), GarmentError> {
        check_ranges(&[("margin", self.margin, 0.0..=1.0), ("reach", self.reach, 0.01..=1.0)])
    }
}

fn check_ranges(settings: &[(&'static str, f32, RangeInclusive<f32>)]) -> Result<(), GarmentError> {
    let Some((name, value, range)) = settings.iter().find(|(_, value, range)| !range.contains(value)) else {
        return Ok(());
    };
    Err(GarmentError::Settings { name, value: *value, least: *range.start(), most: *range.end() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_read_by_name_and_unknown_ones_refused() {
        let seed: ExtractSettings = serde_json::from_str(r#"{"labelling":"nearest-body-vertex"}"#).unwrap();
        assert_eq!(seed, ExtractSettings { labelling: Labelling::NearestBodyVertex, ..ExtractSettings::default() });
        let seed: StackSettings = serde_json::from_str(r#"{"method":"push-along-normal"}"#).unwrap();
        assert_eq!(seed.method, StackMethod::PushAlongNormal);
        for wrong in [r#"{"labeling":"graph-cut"}"#, r#"{"labelling":"template"}"#, r#"{"rounds":-1}"#] {
            assert!(serde_json::from_str::<ExtractSettings>(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn numbers_outside_their_range_are_refused_by_name() {
        let extract = ExtractSettings::default();
        assert_eq!(extract.check(), Ok(()));
        assert_eq!(ExtractSettings { edge_length: 0.0, ..extract.clone() }.check(), Ok(()));
        for (wrong, name) in [
            (ExtractSettings { smoothness: -0.1, ..extract.clone() }, "smoothness"),
            (ExtractSettings { reach: f32::NAN, ..extract.clone() }, "reach"),
            (ExtractSettings { rounds: 1_000_000, ..extract.clone() }, "rounds"),
            (ExtractSettings { edge_length: 1e-6, ..extract.clone() }, "edge_length"),
        ] {
            assert!(wrong.check().unwrap_err().to_string().starts_with(name), "{wrong:?}");
        }
        assert_eq!((StackSettings::default().check(), CullSettings::default().check()), (Ok(()), Ok(())));
        let wrong = StackSettings { gap: f32::INFINITY, ..StackSettings::default() };
        assert_eq!(wrong.check().unwrap_err().to_string(), "gap = inf is outside of its range, 0 to 0.02");
        assert!(CullSettings { reach: 0.0, ..CullSettings::default() }.check().is_err());
    }
}
