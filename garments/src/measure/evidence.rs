//! The evidence at each scan vertex for being new: its height over what was worn before, its colour, its place.

use rayon::prelude::*;

use super::{before::Before, body_parts::PART_COUNT, noise::noise, on_body::on_body, scan_graph::ScanGraph};
use crate::{settings::ExtractSettings, take::DressedTake};

/// Cloth worn before lies differently in each take, by this share of its distance from the body.
const SLIP_SHARE: f32 = 0.2;
/// Half of the cloth at this distance from the body does so, metres.
const SLIPS: f32 = 0.03;
/// Scale of the exponential heights of new cloth over the surface below, metres: near hems it is low, skirts reach far.
const CLOTH_HEIGHT: f32 = 0.06;
/// Divisor of the density of cloth heights, metres: most cloth lies within this.
const CLOTH_SPREAD: f32 = 0.017;
/// How far new cloth presses in the surface below, metres.
const CLOTH_PRESS: f32 = 0.002;
/// Share of new cloth that has the colour of what lies below it by chance; a garment of one colour has it as often as that
/// colour lies below it.
const SAME_BY_CHANCE: f32 = 0.3;
/// Share of old surface that has the colour that it had.
const SAME_AS_IT_WAS: f32 = 0.97;
/// Extent of colour differences between different cloths.
const COLOR_RANGE: f32 = 60.0;
/// Log odds where no earlier surface is within reach, nats.
const OUT_OF_REACH: f32 = 3.0;
/// Neither height nor colour decides by more than this, nats.
const LIMIT: f32 = 4.0;

/// The measurements at each scan vertex.
#[derive(Debug, Clone)]
pub struct Evidence {
    /// Signed height over the earlier surface, metres; infinite where none is within reach.
    pub height: Vec<f32>,
    /// Distance from the earlier surface whichever way it faces, metres; infinite where none is within reach.
    pub clearance: Vec<f32>,
    /// Colour difference from the nearest place of the earlier surface; NaN where either was not seen.
    pub color: Vec<f32>,
    /// Cosine between the scan's normal and the earlier surface's: small where a hem's edge drops to the surface below.
    pub alignment: Vec<f32>,
    /// Shares of the body parts at the closest point of the body.
    pub parts: Vec<[f32; PART_COUNT]>,
    /// Distance from the body, metres.
    pub body_distance: Vec<f32>,
    /// Cosine between the scan's normal and the body's at the closest place.
    pub body_alignment: Vec<f32>,
    /// Laplacian scale of `height` on uncovered parts, metres.
    pub height_noise: f32,
    /// Exponential scale of `color` on uncovered parts.
    pub color_noise: f32,
}

/// Measures a take.
pub fn measure(take: &DressedTake, graph: &ScanGraph, settings: &ExtractSettings) -> Evidence {
    let on_body = on_body(take, graph);
    let before = Before::new(take.previous);
    let compare = |v| before.compare(&take.scan.positions[v], &graph.normals[v], graph.lab.get(v), settings);
    let compared: Vec<_> = (0..graph.len()).into_par_iter().map(compare).collect();
    let seen_color = |(v, filled): (usize, &f32)| if *filled > 0.5 { f32::NAN } else { compared[v].color };
    let height: Vec<f32> = compared.iter().map(|c| c.height).collect();
    let color: Vec<f32> = graph.filled.iter().enumerate().map(seen_color).collect();
    let parts: Vec<_> = on_body.iter().map(|b| b.parts).collect();
    let [height_noise, color_noise] = noise(&parts, &height, &color);
    Evidence {
        height,
        clearance: compared.iter().map(|c| c.clearance).collect(),
        color,
        alignment: compared.iter().map(|c| c.alignment).collect(),
        parts,
        body_distance: on_body.iter().map(|b| b.distance).collect(),
        body_alignment: on_body.iter().map(|b| b.alignment).collect(),
        height_noise,
        color_noise,
    }
}

impl Evidence {
    /// Natural log odds of "new" against "old" at vertex `v`, from height and colour. `of_this_color` is the share of the
    /// garment that has the colour of `v`, where that is known; 0 otherwise.
    pub fn log_odds(&self, v: usize, of_this_color: f32) -> f32 {
        self.height_log_odds(self.height[v], self.body_distance[v] - self.height[v])
            + self.color_log_odds(self.color[v], of_this_color)
    }

    /// Uncovered skin is a Laplacian around zero with rare outliers; earlier cloth, `slack` metres off the body, is one
    /// with a second, wider part; the height of new cloth over either is exponential.
    fn height_log_odds(&self, height: f32, slack: f32) -> f32 {
        if !height.is_finite() {
            return OUT_OF_REACH;
        }
        let b = self.height_noise;
        let laplacian = |scale: f32| (-height.abs() / scale).exp() / (2.0 * scale);
        let slack = slack.max(0.0);
        let slipped = slack / (slack + SLIPS);
        let lies = (1.0 - slipped) * laplacian(b) + slipped * laplacian(b.max(SLIP_SHARE * slack));
        let old = 0.97 * lies + 0.03 / 0.06;
        let press = b.max(CLOTH_PRESS);
        let shape = if height >= 0.0 { (-height / CLOTH_HEIGHT).exp() } else { (height / press).exp() };
        let new = shape / CLOTH_SPREAD;
        (new.max(1e-4) / old).ln().clamp(-LIMIT, LIMIT)
    }

    /// The same cloth differs by an exponential amount; another cloth by any amount, and sometimes not at all: always, where
    /// both have one colour, and then colour says nothing.
    fn color_log_odds(&self, difference: f32, of_this_color: f32) -> f32 {
        if difference.is_nan() {
            return 0.0;
        }
        let b = self.color_noise;
        let same = (-difference / b).exp() / b;
        let any = 1.0 / COLOR_RANGE;
        let mixed = |share: f32| share * same + (1.0 - share) * any;
        let (old, new) = (mixed(SAME_AS_IT_WAS), mixed(of_this_color.clamp(SAME_BY_CHANCE, SAME_AS_IT_WAS)));
        (new / old).ln().clamp(-LIMIT, LIMIT)
    }
}
