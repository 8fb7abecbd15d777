//! How long one unit of a file is.

use std::{fmt, str::FromStr};

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::Surface;

/// The longest side of a scan of a grown person, metres: from somebody small who stands with arms close to the trunk to
/// somebody tall with raised arms. Of all units below at most one gives a length in this range.
const PERSON: std::ops::Range<f64> = 1.25..2.7;

/// A unit of length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    /// 1 m.
    #[serde(rename = "m")]
    Metre,
    /// 0.01 m.
    #[serde(rename = "cm")]
    Centimetre,
    /// 0.001 m.
    #[serde(rename = "mm")]
    Millimetre,
    /// 0.0254 m.
    #[serde(rename = "in")]
    Inch,
    /// 0.3048 m.
    #[serde(rename = "ft")]
    Foot,
}

impl Unit {
    /// All units.
    pub const ALL: [Self; 5] = [Self::Metre, Self::Centimetre, Self::Millimetre, Self::Inch, Self::Foot];

    /// Its length, metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Centimetre => 0.01,
            Self::Millimetre => 0.001,
            Self::Inch => 0.0254,
            Self::Foot => 0.3048,
        }
    }

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Metre => "m",
            Self::Centimetre => "cm",
            Self::Millimetre => "mm",
            Self::Inch => "in",
            Self::Foot => "ft",
        }
    }

    /// The name in sentences.
    pub fn plural(self) -> &'static str {
        match self {
            Self::Metre => "metres",
            Self::Centimetre => "centimetres",
            Self::Millimetre => "millimetres",
            Self::Inch => "inches",
            Self::Foot => "feet",
        }
    }

    /// The unit in which a surface has the size of a grown person.
    ///
    /// # Errors
    /// A sentence with the size, where it is that of a person in no unit.
    pub fn find(surface: &Surface) -> Result<Self, String> {
        let longest = longest_side(&surface.positions);
        Self::ALL.into_iter().find(|unit| PERSON.contains(&(longest * unit.metres()))).ok_or_else(|| {
            format!(
                "its longest side is {longest:.4}, which is the size of a grown person neither in metres, centimetres, \
                 millimetres, inches nor feet; say the unit with --unit, or cut away what is not the person"
            )
        })
    }
}

/// The longest side of the bounds, without the outermost half per cent of the vertices at each end.
pub(crate) fn longest_side(points: &[Point3<f32>]) -> f64 {
    let side = |axis: usize| {
        let mut values: Vec<f32> = points.iter().map(|p| p[axis]).collect();
        let Some(last) = values.len().checked_sub(1) else { return 0.0 };
        let cut = last / 200;
        let low = *values.select_nth_unstable_by(cut, f32::total_cmp).1;
        let high = *values.select_nth_unstable_by(last - cut, f32::total_cmp).1;
        f64::from(high) - f64::from(low)
    };
    (0..3).map(side).fold(0.0, f64::max)
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Unit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = Self::ALL.into_iter().find(|unit| unit.name() == text);
        known.ok_or_else(|| format!("`{text}` is not a unit; choose one of {}", Self::ALL.map(Self::name).join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tall(height: f32) -> Surface {
        Surface::new((0..1000).map(|i| Point3::new(0.0, 0.0, height * i as f32 / 999.0)).collect(), Vec::new())
    }

    #[test]
    fn each_unit_is_found_for_small_and_tall_people() {
        for unit in Unit::ALL {
            for metres in [1.3, 1.75, 2.4] {
                assert_eq!(Unit::find(&tall((metres / unit.metres()) as f32)), Ok(unit), "{metres} m");
            }
        }
        for length in [0.0, 0.5, 20.0, 700.0, 1e6] {
            assert!(Unit::find(&tall(length)).unwrap_err().contains("--unit"), "{length}");
        }
    }

    #[test]
    fn no_length_is_a_person_in_two_units() {
        for length in (1..400_000).map(|i| f64::from(i) * 0.01) {
            let fits = Unit::ALL.into_iter().filter(|u| PERSON.contains(&(length * u.metres()))).count();
            assert!(fits < 2, "{length}");
        }
    }
}
