//! The definition of a measurement, in words.

use serde::{Deserialize, Serialize};

/// How a measurement is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MeasureKind {
    /// Vertical, above the soles.
    Height,
    /// A taut tape around a part of the body.
    Girth,
    /// A taut tape over the surface, from point to point.
    Length,
    /// Straight, between two points.
    Breadth,
}

/// One measurement's name and definition.
#[derive(Debug)]
pub(crate) struct Definition {
    /// Such as `waist girth`; measurements of limbs get `left` or `right` before it.
    pub name: &'static str,
    /// How it is taken.
    pub kind: MeasureKind,
    /// Clause of ISO 8559-1:2017; `None` where its number could not be confirmed, or the standard has no such measurement.
    pub clause: Option<&'static str>,
    /// The definition in our words.
    pub wording: &'static str,
}

impl Definition {
    /// Clause and wording as `measurements.json` and `measurements.csv` give them.
    pub fn text(&self) -> String {
        match self.clause {
            Some(clause) => format!("ISO 8559-1:2017, {clause}: {}", self.wording),
            None => self.wording.to_string(),
        }
    }
}
