//! The answer for each scan vertex, and why it is so.

use serde::{Deserialize, Serialize};

/// Confidence of a label that was turned over against what was measured.
const TURNED: f32 = 0.5;

/// Why a vertex belongs to the garment or does not: the step that had the last word.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reason {
    /// Its height over the surface worn before, its colour and its place on the body say so.
    #[default]
    Evidence,
    /// Its surroundings say so, against its own evidence.
    Surroundings,
    /// The template of the garment's type says so at the nearest body vertex (seed §6.2).
    Template,
    /// It lies inside the surface worn before: something was uncovered there.
    Uncovered,
    /// Cloth that was worn before can have swung there.
    Swung,
    /// It lies in a small island of old surface inside the garment.
    Island,
    /// It lies in a piece of new surface that is too small for a garment.
    SmallPiece,
    /// Nobody saw it: the patch that fusion closed there decides.
    ClosedPatch,
    /// It lies on the step from a hem down to the surface below.
    Step,
    /// It lies low on the slope that a fused scan draws below a hem.
    Slope,
    /// It lies past the fold at a hem, turned away from the cloth.
    Lip,
    /// A stroke touches it, or moved the border across it.
    Stroke,
    /// It lies within reach of a hem line.
    HemLine,
}

impl Reason {
    /// True for reasons that lowered the vertex's log odds, so that they hold when labels are minimised again.
    fn is_in_odds(self) -> bool {
        matches!(self, Self::Uncovered | Self::Swung | Self::Step | Self::Slope | Self::Lip)
    }

    /// The reason of a vertex after labels were minimised, when it had this one before; `agrees` says whether its label
    /// is that of its own log odds.
    pub(super) fn after_minimising(self, agrees: bool) -> Self {
        match self {
            _ if !agrees => Self::Surroundings,
            held if held.is_in_odds() => held,
            _ => Self::Evidence,
        }
    }
}

/// The answer for each scan vertex.
#[derive(Debug, Clone, Default)]
pub struct Labels {
    /// True where the new garment is.
    pub garment: Vec<bool>,
    /// Probability of the label, 0.5 to 1.
    pub confidence: Vec<f32>,
    /// Log odds of "new" that the last minimisation used, nats.
    pub log_odds: Vec<f32>,
    /// Why the label is as it is.
    pub reasons: Vec<Reason>,
}

impl Labels {
    /// These labels with those of `vertices` turned over for a reason.
    pub(super) fn turned(mut self, vertices: impl Iterator<Item = usize>, reason: Reason) -> Self {
        for v in vertices {
            self.garment[v] = !self.garment[v];
            self.confidence[v] = TURNED;
            self.reasons[v] = reason;
        }
        self
    }

    /// These labels with the log odds of `vertices` lowered to at most `log_odds`; the labels themselves stay until they
    /// are minimised again.
    pub(crate) fn lowered(mut self, vertices: &[u32], log_odds: f32, reason: Reason) -> Self {
        for &v in vertices {
            let odds = &mut self.log_odds[v as usize];
            *odds = odds.min(log_odds);
            self.reasons[v as usize] = reason;
        }
        self
    }

    /// These labels without `vertices`, whose log odds become at most `log_odds`.
    pub(super) fn without(self, vertices: &[u32], log_odds: f32, reason: Reason) -> Self {
        let mut labels = self.lowered(vertices, log_odds, reason);
        vertices.iter().for_each(|&v| labels.garment[v as usize] = false);
        labels
    }

    /// Sets the label of one vertex for a reason.
    pub(crate) fn decide(&mut self, v: usize, garment: bool, reason: Reason) {
        if self.garment[v] != garment {
            self.garment[v] = garment;
            self.reasons[v] = reason;
        }
    }

    /// Area of the vertices that have a reason, square metres; `areas` are those of all vertices.
    pub(crate) fn area_of(&self, reason: Reason, areas: &[f32]) -> f32 {
        self.reasons.iter().zip(areas).filter(|(r, _)| **r == reason).map(|(_, a)| a).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_of_lowered_odds_outlive_minimising_and_others_do_not() {
        assert_eq!(Reason::Step.after_minimising(true), Reason::Step);
        assert_eq!(Reason::Step.after_minimising(false), Reason::Surroundings);
        assert_eq!(Reason::Island.after_minimising(true), Reason::Evidence);
    }
}
