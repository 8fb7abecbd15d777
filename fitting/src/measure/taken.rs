//! A measurement that was taken.

use serde::{Deserialize, Serialize};

use crate::measure::{
    definition::{Definition, MeasureKind},
    parts::Side,
    section::Tape,
};

/// Half intervals beyond this are no measurement any more, metres: more than twice what ISO 20685 allows for large girths.
pub(crate) const MEASURED: f64 = 0.02;

/// One measurement.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BodyMeasure {
    /// Such as `waist girth` or `left upper arm length`.
    pub name: String,
    /// How it is taken.
    pub kind: MeasureKind,
    /// Metres: the length of `path`.
    pub value_m: f64,
    /// The definition: the clause of ISO 8559-1 where there is one, and the definition in words.
    #[serde(default)]
    pub definition: String,
    /// Where the tape lies on the standing body: corners in metres.
    pub path: Vec<[f64; 3]>,
    /// Half the interval that holds the true value in 95 of 100 cases, metres; only where a scan was fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncertainty_m: Option<f64>,
    /// Share of the skin under the tape that the scan shows, 0–1; only where a scan was fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seen: Option<f64>,
    /// Why the value is not to be trusted, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub doubt: Option<String>,
}

impl BodyMeasure {
    /// False where so little was seen, or so noisily, that the value is an estimate.
    pub fn is_measured(&self) -> bool {
        self.uncertainty_m.is_none_or(|u| u <= MEASURED)
    }

    /// The value for people: centimetres with the uncertainty, and `(?)` where it is doubted.
    pub fn text(&self) -> String {
        let cm = |metres: f64| format!("{:.1}", 100.0 * metres);
        let around = self.uncertainty_m.map_or(String::new(), |u| format!(" ± {}", cm(u)));
        let mark = if self.doubt.is_some() { " (?)" } else { "" };
        format!("{}{around} cm{mark}", cm(self.value_m))
    }
}

/// Measurements in the order in which they were taken.
#[derive(Debug, Default)]
pub(crate) struct Taken(pub Vec<BodyMeasure>);

impl Taken {
    /// Adds a measurement; one whose tape could not be laid is left out.
    pub fn add(&mut self, definition: &Definition, tape: Option<Tape>) {
        self.push(definition.name.to_string(), definition, tape);
    }

    /// Adds a measurement of one side.
    pub fn add_side(&mut self, side: Side, definition: &Definition, tape: Option<Tape>) {
        self.push(format!("{} {}", side.word(), definition.name), definition, tape);
    }

    fn push(&mut self, name: String, definition: &Definition, tape: Option<Tape>) {
        let Some(tape) = tape else { return };
        let path = tape.path.iter().map(|p| (*p).into()).collect();
        let (kind, definition) = (definition.kind, definition.text());
        let value_m = tape.length;
        self.0.push(BodyMeasure {
            name,
            kind,
            value_m,
            definition,
            path,
            uncertainty_m: None,
            seen: None,
            doubt: None,
        });
    }
}
