//! The decisions of a body fit, and how good it is.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Whether a fit is to be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The body explains the scan.
    Trusted,
    /// Usable, but somebody should look at it: see the report's reasons.
    Doubtful,
    /// The scan probably does not show one standing person, or shows too little of one.
    Failed,
}

/// Distances between two surfaces, millimetres, weighted by area.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct DistanceStats {
    /// Mean.
    pub mean_mm: f64,
    /// Median.
    pub median_mm: f64,
    /// 95th percentile.
    pub p95_mm: f64,
}

/// The upper part of a person that a scan shows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PartShown {
    /// Where it begins, in words: `hips`.
    pub from: String,
    /// Height of the scan's lower end, metres, in the fit's frame.
    pub cut_m: f64,
    /// How far the body goes on below it, metres.
    pub below_m: f64,
    /// Share of the body's skin above the lower end that the scan covers, 0–1.
    pub covered: f64,
    /// Share of the trunk's skin that the scan covers, 0–1.
    pub trunk_covered: f64,
}

impl PartShown {
    /// The sentence that says what is shown.
    pub fn sentence(&self) -> String {
        format!(
            "the scan shows a person from the {} up: what lies below, the stature and their measures were not seen; they are those \
             of an ordinary body that goes with the rest; scan the whole person to have them",
            self.from
        )
    }
}

/// The decisions of a body fit, and how good it is.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FitReport {
    /// Whether to trust it.
    pub verdict: Verdict,
    /// Why not, in words; empty where it is trusted.
    pub reasons: Vec<String>,
    /// The repairs of the scan, in words.
    pub notices: Vec<String>,
    /// Gauss–Newton steps over all starts and resolutions.
    pub iterations: usize,
    /// Whether the finest resolution came to rest.
    pub converged: bool,
    /// Trusted scan surface to the statistical model.
    pub scan_to_model: DistanceStats,
    /// Trusted scan surface to the conformed body.
    pub scan_to_body: DistanceStats,
    /// Share of the body's outer surface that the scan covers, 0–1.
    pub body_covered: f64,
    /// Share of the scan's trusted surface that lies within 20 mm of the body (100 mm where the person is dressed), 0–1.
    pub scan_explained: f64,
    /// Share of the scan's trusted surface that lies farther than 30 mm from any skin, but for what lies nearest to the head
    /// (hair), 0–1: a limb that was not found.
    pub limbs_unexplained: f64,
    /// Share of the skin of one region (the worst, but for the head) that lies deep inside the scan, 0–1: a limb that was laid into
    /// the body.
    pub limb_buried: f64,
    /// Share of the head's outer surface with scan within 15 mm, dressed or not, 0–1.
    pub head_covered: f64,
    /// Root mean square of β: 1 for an ordinary body.
    pub shape_rms: f64,
    /// Shape and measures are estimated: the person was dressed.
    pub estimated: bool,
    /// The upper part of a person that the scan shows; `None` where it was taken to show a whole one.
    #[serde(default)]
    pub part: Option<PartShown>,
    /// The scan shows a part of a person that is too little for a body.
    #[serde(default)]
    pub is_too_little: bool,
    /// Share of each region's outer surface that the scan covers, 0–1, as `body_covered`.
    pub region_covered: BTreeMap<String, f64>,
}
