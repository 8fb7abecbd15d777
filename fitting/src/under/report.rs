//! The decisions of a fit under a scan, and how good it is.

use serde::{Deserialize, Serialize};
use toile_character::Pose;

use crate::Verdict;

/// Below this share of uncovered area the pose is doubtful: hands, head and feet are a sixth of the skin.
const UNCOVERED: f64 = 0.1;
/// Shares of area outside the scan above which the pose is doubtful, and above which it is wrong.
const OUTSIDE_DOUBTFUL: f64 = 0.1;
const OUTSIDE_FAILED: f64 = 0.3;

/// Pose of a mesh under a scan.
#[derive(Debug, Clone)]
pub struct UnderFit {
    /// The pose in the scan's frame.
    pub pose: Pose,
    /// For each vertex of the mesh: how surely it is uncovered skin or cloth of before, 0–1.
    pub uncovered: Vec<f32>,
    /// The decisions, and how good the result is.
    pub report: UnderReport,
}

/// The decisions of a fit under a scan.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct UnderReport {
    /// Whether to trust it.
    pub verdict: Verdict,
    /// Why not, in words.
    pub reasons: Vec<String>,
    /// Gauss–Newton steps over all starts.
    pub iterations: usize,
    /// Whether the finest resolution came to rest.
    pub converged: bool,
    /// Turn of the whole mesh against the initial pose about the vertical, degrees.
    pub heading_deg: f64,
    /// Share of the mesh's area that stayed uncovered, 0–1.
    pub uncovered: f64,
    /// Root mean square distance of uncovered vertices from the scan, millimetres.
    pub uncovered_rms_mm: f64,
    /// Share of the mesh's area that lies more than 2 mm outside the scan, however far, 0–1. Cloth that swung or was taken off counts,
    /// too; vertices more than 50 mm from the scan do not draw the pose.
    pub outside: f64,
}

impl UnderReport {
    /// Sets verdict and reasons by the figures.
    pub(crate) fn decide(&mut self) {
        if self.uncovered < UNCOVERED {
            self.verdict = Verdict::Doubtful;
            self.reasons.push(format!(
                "only {:.0} % of the mesh is seen again in the scan: hands, head or feet should stay uncovered",
                100.0 * self.uncovered
            ));
        }
        if self.outside > OUTSIDE_DOUBTFUL {
            self.verdict = if self.outside > OUTSIDE_FAILED { Verdict::Failed } else { Verdict::Doubtful };
            self.reasons.push(format!(
                "{:.0} % of the mesh lies outside the scan: is it the same person, wearing one layer more?",
                100.0 * self.outside
            ));
        }
    }
}
