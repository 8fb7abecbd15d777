//! All measurements of one body.

use serde::{Deserialize, Serialize};
use toile_character::{BodyModel, SkinnedMesh};
use toile_geometry::Mesh;

use crate::{
    BodyFit, FittingError,
    measure::{
        arm,
        definition::MeasureKind,
        extremes, head, leg,
        levels::Levels,
        parts::Side,
        plausible,
        standing::Standing,
        taken::{BodyMeasure, Taken},
        trunk, uncertainty,
    },
};

/// A landmark on the standing body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BodyLandmark {
    /// The standard's term, such as `back neck point`.
    pub name: String,
    /// Metres, in the standing body's frame: +Y up, soles at 0, +Z the front.
    pub position: [f64; 3],
}

/// All measurements of one body: the content of `measurements.json`.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct MeasureTable {
    /// The standard whose definitions are followed.
    pub standard: String,
    /// The measurements.
    pub measures: Vec<BodyMeasure>,
    /// Volume, litres.
    pub volume_l: f64,
    /// The landmarks.
    pub landmarks: Vec<BodyLandmark>,
    /// The standing body that was measured, soles at 0.
    #[serde(skip)]
    pub standing: Mesh,
}

/// Measures a body (its own shape at rest, template topology of `model`) by the definitions of ISO 8559-1.
///
/// The body is stood straight first, so that its pose in the scan changes nothing. Every value is the length of the path
/// that is given with it. A measurement whose tape cannot be laid is left out.
///
/// # Errors
/// [`FittingError::Mesh`] where the body is not of the model's topology or too small to be a body.
pub fn measure_table(model: &BodyModel, body: &SkinnedMesh) -> Result<MeasureTable, FittingError> {
    let standing = Standing::new(model, body)?;
    let levels = Levels::find(&standing);
    let mut taken = Taken::default();
    head::measure(&standing, extremes::stature(&standing.mesh, &model.inner), &mut taken);
    trunk::measure(&standing, &levels, &mut taken);
    leg::measure_heights(&standing, &mut taken);
    for side in Side::BOTH {
        arm::measure(&standing, side, &mut taken);
        leg::measure(&standing, &levels, side, &mut taken);
    }
    let landmarks = standing.landmarks.terms();
    Ok(MeasureTable {
        standard: "ISO 8559-1:2017".into(),
        measures: taken.0,
        volume_l: 1e3 * standing.mesh.signed_volume(),
        landmarks: landmarks.into_iter().map(|(name, p)| BodyLandmark { name, position: p.into() }).collect(),
        standing: standing.mesh,
    })
}

impl MeasureTable {
    /// The table of the body that `fit` found: each measurement with its uncertainty, and with a doubt where it does not go
    /// with the others as it does among people.
    #[must_use]
    pub fn of_fit(mut self, fit: &BodyFit) -> Self {
        uncertainty::weigh(&mut self.measures, &self.standing, fit);
        plausible::doubt(&mut self.measures);
        self
    }

    /// The measurement called `name`, metres.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.measures.iter().find(|m| m.name == name).map(|m| m.value_m)
    }

    /// As comma-separated lines: name, kind, centimetres, the height of the tape's middle above the soles in centimetres
    /// (empty for heights), the definition, the uncertainty in centimetres, the share of the skin under the tape that was seen
    /// (0–1), and the doubt; the volume in litres last. What is not known is empty.
    pub fn csv(&self) -> String {
        let mut out = String::from("measurement,kind,value,unit,height,definition,uncertainty,seen,doubt\n");
        for m in &self.measures {
            let kind = format!("{:?}", m.kind).to_lowercase();
            let (low, high) = m.path.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[1]), h.max(p[1])));
            let is_shown = !m.path.is_empty() && m.kind != MeasureKind::Height;
            let height = if is_shown { format!("{:.1}", 50.0 * (low + high)) } else { String::new() };
            let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
            let uncertainty = m.uncertainty_m.map_or(String::new(), |u| format!("{:.2}", 100.0 * u));
            let seen = m.seen.map_or(String::new(), |seen| format!("{seen:.2}"));
            let (definition, doubt) = (quoted(&m.definition), m.doubt.as_deref().map_or(String::new(), quoted));
            let value = 100.0 * m.value_m;
            out += &format!("{},{kind},{value:.1},cm,{height},{definition},{uncertainty},{seen},{doubt}\n", m.name);
        }
        out + &format!("volume,volume,{:.2},l,,\"volume that the skin encloses\",,,\n", self.volume_l)
    }
}
