//! Patches of the scan that nobody saw and that fusion closed.

use super::types::{Labels, Reason};
use crate::measure::{Measured, bones::crosses};

/// A patch or hole belongs to the garment when this share of its surroundings does.
pub(crate) const SURROUNDED: f64 = 0.95;

/// A closed patch may be cloth where its normal is within this angle (cosine) of that of the surface worn before; a
/// membrane is not.
const ALONG: f32 = 0.8;
/// Cloth that nobody saw is believed up to this height over the surface worn before, metres: a membrane spans hollows.
const NEAR: f32 = 0.05;

/// The labels with those of closed patches settled by their surroundings.
///
/// Below a skirt's hem and in a collar a bone passes through the patch, and the scan is closed there by a membrane that
/// is not cloth. A patch that the garment surrounds belongs to it. Of one that it shares with its surroundings (on top of
/// a shoulder, beside the neck) those vertices stay that were labelled so and lie along the surface worn before; where a
/// bone passes through the patch elsewhere, they must lie along the body too.
pub(crate) fn settle_closed_patches(mut labels: Labels, on: &Measured) -> Labels {
    let (graph, evidence) = (&on.graph, &on.evidence);
    let closed: Vec<usize> = (0..graph.len()).filter(|&v| graph.filled[v] > 0.5).collect();
    let (patch_of, areas) = graph.components(|v| graph.filled[v] > 0.5);
    let patches = patches(on, &labels, &closed, &patch_of, areas.len());
    for v in closed {
        let patch = &patches[patch_of[v] as usize];
        let along = evidence.alignment[v] > ALONG && evidence.height[v].abs() < NEAR;
        let along_body = evidence.body_alignment[v] > ALONG && evidence.body_distance[v] < 2.0 * NEAR;
        let is_garment = if patch.bone_passes {
            labels.garment[v] && along && along_body
        } else {
            patch.is_surrounded() || (labels.garment[v] && along)
        };
        labels.decide(v, is_garment, Reason::ClosedPatch);
    }
    labels
}

/// A closed patch and its surroundings.
#[derive(Clone, Copy, Default)]
struct Patch {
    /// Neighbours around it that are old.
    old: u32,
    /// Neighbours around it that are new.
    new: u32,
    bone_passes: bool,
}

impl Patch {
    fn is_surrounded(&self) -> bool {
        f64::from(self.new) > SURROUNDED * f64::from(self.old + self.new)
    }
}

fn patches(on: &Measured, labels: &Labels, closed: &[usize], patch_of: &[u32], count: usize) -> Vec<Patch> {
    let mut patches = vec![Patch::default(); count];
    for &v in closed {
        let patch = &mut patches[patch_of[v] as usize];
        for &n in on.graph.neighbors.of(v).iter().filter(|&&n| patch_of[n as usize] == u32::MAX) {
            *(if labels.garment[n as usize] { &mut patch.new } else { &mut patch.old }) += 1;
        }
    }
    for (t, corners) in on.take.scan.triangles.iter().enumerate() {
        // One closed corner is enough: the patch's rim was seen.
        if let Some(&v) = corners.iter().find(|&&v| patch_of[v as usize] != u32::MAX) {
            let passes = || on.bones.iter().any(|bone| crosses(bone, &on.take.scan.corners(t)));
            patches[patch_of[v as usize] as usize].bone_passes |= passes();
        }
    }
    patches
}
