//! Cloth against bare skin, in a take that was not preceded by an undressed one.
//!
//! Nothing was scanned before that cloth could stand off, and the body under it is a guess that is some millimetres off. What
//! is skin is told by its colour, which the face shows; by the place on the body; and, weakly, by the height over the guessed
//! body. Hair, face and hands belong to the body whatever their colour.

use nalgebra::{Point3, Vector3};
use toile_character::Joint;
use toile_geometry::statistics::median;

use super::types::{Labels, Reason};
use crate::{
    measure::{
        Measured,
        body_parts::{BodyPart, PART_COUNT},
        color::Histogram,
        scan_graph::ScanGraph,
    },
    take::DressedTake,
};

/// Log odds that somebody who is dressed wears cloth there: trunk and hips are covered, head and hands are not, sleeves and
/// trouser legs end anywhere.
const WORN: [f32; PART_COUNT] = {
    // head, neck, torso, pelvis, upper arm, lower arm, hand, upper leg, lower leg, foot
    [-6.0, -2.5, 3.5, 4.0, 0.5, -0.5, -5.0, 2.0, 0.3, 0.5]
};
/// How far a guessed body is off where skin is bare, metres (scale of a Laplacian), and how far cloth stands off (mean of an
/// exponential): an assumption about a body that was guessed, and half of the ease of an ordinary shirt.
const BODY_OFF: f32 = 0.006;
const STANDS_OFF: f32 = 0.015;
/// Neither height nor colour says more than this, nats.
const HEIGHT_LIMIT: f32 = 1.5;
const COLOR_LIMIT: f32 = 3.5;
/// Limit of the sum, nats.
const LIMIT: f32 = 7.0;
/// Where nothing was seen, evidence counts this much.
const FILLED_TRUST: f32 = 0.2;
/// The face lies within this angle (cosine) of the head's front, below this sine of the eyes' height, seen from the middle of the
/// head, which lies this far above its joint, metres.
const FRONT: f32 = 0.75;
const BROW: f32 = 0.2;
const MIDDLE: f32 = 0.07;
/// Fewest vertices of a face whose colour is believed.
const FEWEST: usize = 60;
/// Smallest and largest standard deviation of skin's lightness and chroma on one person under one light: shading changes
/// lightness, sun and blood the chroma.
const LIGHTNESS: [f32; 2] = [12.0, 20.0];
const CHROMA: [f32; 2] = [4.0, 9.0];
/// Largest area of skin that is taken for a print, square metres, and the share of it that lies on the trunk.
const PRINT: f32 = 0.015;
const MOSTLY: f32 = 0.8;
/// Volume of the colours that things have, CIELAB units cubed, over which unknown cloth is spread; and that of the histogram.
const COLORS: f32 = 640_000.0;
const HISTOGRAM: f32 = 100.0 * 168.0 * 144.0;

/// The labels without skin that cloth surrounds on the trunk, up to the size of a hand: a print of the colour of skin.
pub(super) fn close_prints(labels: Labels, on: &Measured) -> Labels {
    let (set, areas) = on.graph.components(|v| !labels.garment[v]);
    let mut of_trunk = vec![0.0f32; areas.len()];
    for v in (0..on.graph.len()).filter(|&v| set[v] != u32::MAX) {
        let parts = &on.evidence.parts[v];
        of_trunk[set[v] as usize] +=
            (parts[BodyPart::Torso as usize] + parts[BodyPart::Pelvis as usize]) * on.graph.areas[v];
    }
    let is_print = |set: u32| {
        let k = set as usize;
        set != u32::MAX && areas[k] < PRINT && of_trunk[k] > MOSTLY * areas[k]
    };
    labels.turned((0..on.graph.len()).filter(|&v| is_print(set[v])), Reason::Island)
}

/// Log odds of cloth against bare skin. The colours of `earlier` labels' cloth are used where there are any.
pub(super) fn log_odds(on: &Measured, earlier: Option<&Labels>) -> Vec<f32> {
    let (graph, evidence) = (&on.graph, &on.evidence);
    let colors = SkinColor::of_face(on.take, graph).map(|skin| skin.log_odds(graph, earlier));
    let at = |v: usize| {
        let place: f32 = evidence.parts[v].iter().zip(&WORN).map(|(share, p)| share * p).sum();
        let trust = if graph.filled[v] > 0.5 { FILLED_TRUST } else { 1.0 };
        let color = colors.as_ref().map_or(0.0, |colors| colors[v]);
        // a hat or a hood is not told from hair
        let bare = evidence.parts[v][BodyPart::Head as usize] + evidence.parts[v][BodyPart::Hand as usize];
        let measured = (1.0 - bare).max(0.0) * trust * (height_log_odds(evidence.height[v]) + color);
        (measured + place).clamp(-LIMIT, LIMIT)
    };
    (0..graph.len()).map(at).collect()
}

/// Skin lies at the body, cloth over it.
fn height_log_odds(height: f32) -> f32 {
    if !height.is_finite() {
        return HEIGHT_LIMIT;
    }
    let skin = (-height.abs() / BODY_OFF).exp() / (2.0 * BODY_OFF);
    let scale = if height >= 0.0 { STANDS_OFF } else { BODY_OFF };
    let cloth = (-height.abs() / scale).exp() / (STANDS_OFF + BODY_OFF);
    (cloth.max(1e-6) / skin.max(1e-6)).ln().clamp(-HEIGHT_LIMIT, HEIGHT_LIMIT)
}

/// The colour of a person's skin: a Gaussian in CIELAB.
struct SkinColor {
    middle: [f32; 3],
    sigma: [f32; 3],
}

impl SkinColor {
    /// Of the face; `None` where the scan has no colour or shows no face.
    fn of_face(take: &DressedTake, graph: &ScanGraph) -> Option<Self> {
        let head = take.pose.joint_frames(take.skeleton)[Joint::Head.index()].cast::<f32>();
        let [front, up] = [Vector3::z(), Vector3::y()].map(|axis| head.rotation * axis);
        let middle = Point3::from(head.translation.vector) + up * MIDDLE;
        let is_face = |v: &usize| {
            let way = (take.scan.positions[*v] - middle).try_normalize(1e-6).unwrap_or_default();
            let is_near = (take.scan.positions[*v] - middle).norm() < 2.0 * MIDDLE;
            is_near && graph.filled[*v] < 0.5 && way.dot(&front) > FRONT && way.dot(&up) < BROW
        };
        let face: Vec<usize> = (0..graph.lab.len()).filter(is_face).collect();
        if face.len() < FEWEST {
            return None;
        }
        let of = |k: usize, limits: [f32; 2]| {
            let mut values: Vec<f32> = face.iter().map(|&v| graph.lab[v][k]).collect();
            let middle = median(&mut values)?;
            let mut off: Vec<f32> = face.iter().map(|&v| (graph.lab[v][k] - middle).abs()).collect();
            // standard deviation by the median of a Gaussian's absolute values
            Some((middle, (1.48 * median(&mut off)?).clamp(limits[0], limits[1])))
        };
        let [l, a, b] = [of(0, LIGHTNESS)?, of(1, CHROMA)?, of(2, CHROMA)?];
        Some(Self { middle: [l.0, a.0, b.0], sigma: [l.1, a.1, b.1] })
    }

    /// Log odds of cloth by each vertex's colour: cloth of any colour, half of it of those that `earlier` labels found.
    fn log_odds(&self, graph: &ScanGraph, earlier: Option<&Labels>) -> Vec<f32> {
        let cloth = earlier.map(|labels| {
            let mut cloth = Histogram::default();
            for v in (0..graph.len()).filter(|&v| labels.garment[v] && graph.filled[v] < 0.5) {
                cloth.add(&graph.lab[v], graph.areas[v] * labels.confidence[v]);
            }
            cloth
        });
        let odds = |color: &[f32; 3]| {
            let any = 1.0 / COLORS;
            let worn = cloth.as_ref().map_or(any, |cloth| 0.5 * any + 0.5 * cloth.density(color) / HISTOGRAM);
            (worn / self.density(color).max(1e-12)).ln().clamp(-COLOR_LIMIT, COLOR_LIMIT)
        };
        graph.lab.iter().map(odds).collect()
    }

    /// Probability density of a colour, with rare outliers (moles, hair, lips).
    fn density(&self, color: &[f32; 3]) -> f32 {
        let squared: f32 = (0..3).map(|k| ((color[k] - self.middle[k]) / self.sigma[k]).powi(2)).sum();
        let volume = std::f32::consts::TAU.powf(1.5) * self.sigma.iter().product::<f32>();
        0.95 * (-0.5 * squared).exp() / volume + 0.05 / COLORS
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::color::lab;

    #[test]
    fn skin_is_told_from_cloth_by_colour_and_height() {
        let skin = SkinColor { middle: lab([200, 150, 125]), sigma: [12.0, 5.0, 5.0] };
        let odds = |rgb| (1.0 / COLORS / skin.density(&lab(rgb))).ln();
        assert!(odds([200, 150, 125]) < -3.0 && odds([165, 120, 100]) < -2.0, "shaded skin is skin");
        assert!(odds([30, 30, 35]) > 0.5 && odds([60, 90, 160]) > 0.5 && odds([250, 250, 250]) > 0.5);
        assert!(height_log_odds(0.0) < 0.0 && height_log_odds(0.03) > 1.0);
    }
}
