//! The content of `body.json`.

use std::collections::BTreeMap;

use serde::Serialize;
use toile_character::joint::JOINTS;

use crate::{BodyFit, FitReport, Girth, Mend, ScanLandmark};

/// The content of `body.json`.
#[derive(Debug, Clone, Serialize)]
pub struct BodySummary {
    /// Standing straight, metres.
    pub stature_m: f64,
    /// The girths that bodies are scored by: chest, waist, hip as extremes within shares of the stature, metres. The
    /// measurements of ISO 8559-1 are in `measurements.json`.
    pub girths_m: BTreeMap<&'static str, f64>,
    /// The same with the heights they were taken at.
    pub girths: BTreeMap<&'static str, Girth>,
    /// Volume, cubic metres.
    pub volume_m3: f64,
    /// Posed joints by VRM name, metres, in the scan's frame.
    pub joints: BTreeMap<&'static str, [f64; 3]>,
    /// Shape coefficients in standard deviations.
    pub beta: Vec<f64>,
    /// Joints of the body at rest (A-pose) by VRM name, metres.
    pub rest_joints: BTreeMap<&'static str, [f64; 3]>,
    /// Joint angles.
    pub theta: Theta,
    /// Landmarks on the scan, in its frame.
    pub landmarks: Vec<ScanLandmark>,
    /// How the input was mended.
    pub mend: Mend,
    /// How good the fit is.
    pub report: FitReport,
}

/// Joint angles relative to the A-pose rest.
#[derive(Debug, Clone, Serialize)]
pub struct Theta {
    /// Displacement of the hips, metres.
    pub translation: [f64; 3],
    /// Local rotation vectors (axis times angle, radians) by VRM name.
    pub rotations: BTreeMap<&'static str, [f64; 3]>,
}

impl BodyFit {
    /// Posed joints by VRM name, metres, in the (mended) scan's frame.
    pub fn joints(&self) -> BTreeMap<&'static str, [f64; 3]> {
        let positions = self.pose.joint_positions(&self.skeleton);
        JOINTS.iter().map(|j| (j.name(), positions[j.index()].into())).collect()
    }

    /// The content of `body.json`.
    pub fn summary(&self) -> BodySummary {
        let m = &self.measurements;
        let girths = BTreeMap::from([("chest", m.chest), ("waist", m.waist), ("hip", m.hip)]);
        BodySummary {
            stature_m: m.stature_m,
            girths_m: girths.iter().map(|(name, g)| (*name, g.girth_m)).collect(),
            girths,
            volume_m3: m.volume_m3,
            joints: self.joints(),
            beta: self.beta.clone(),
            rest_joints: JOINTS.iter().map(|&j| (j.name(), self.skeleton.position(j).into())).collect(),
            theta: Theta {
                translation: self.pose.translation.into(),
                rotations: JOINTS.iter().map(|&j| (j.name(), self.pose.rotation(j).scaled_axis().into())).collect(),
            },
            landmarks: self.landmarks.clone(),
            mend: self.mend,
            report: self.report.clone(),
        }
    }
}
