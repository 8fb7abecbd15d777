//! Which axis of a file points up.

use std::{fmt, str::FromStr};

use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// An axis of a file that points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Up {
    /// +X.
    #[serde(rename = "x")]
    X,
    /// −X.
    #[serde(rename = "-x")]
    MinusX,
    /// +Y, as in glTF.
    #[serde(rename = "y")]
    Y,
    /// −Y.
    #[serde(rename = "-y")]
    MinusY,
    /// +Z, as in many programs for engineers.
    #[serde(rename = "z")]
    Z,
    /// −Z.
    #[serde(rename = "-z")]
    MinusZ,
}

impl Up {
    /// All axes, the usual ones first.
    pub const ALL: [Self; 6] = [Self::Y, Self::Z, Self::X, Self::MinusY, Self::MinusZ, Self::MinusX];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::MinusX => "-x",
            Self::Y => "y",
            Self::MinusY => "-y",
            Self::Z => "z",
            Self::MinusZ => "-z",
        }
    }

    /// The axis as a unit vector of the file's frame.
    pub fn axis(self) -> Vector3<f64> {
        match self {
            Self::X => Vector3::x(),
            Self::MinusX => -Vector3::x(),
            Self::Y => Vector3::y(),
            Self::MinusY => -Vector3::y(),
            Self::Z => Vector3::z(),
            Self::MinusZ => -Vector3::z(),
        }
    }

    /// The rotation that takes the axis to +Y. A further axis stays where it is, so that nothing is mirrored.
    pub fn upright(self) -> UnitQuaternion<f64> {
        let between = Rotation3::rotation_between(&self.axis(), &Vector3::y());
        // Opposite axes have no shortest turn between them: about X.
        let rotation = between.unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
        UnitQuaternion::from_rotation_matrix(&rotation)
    }

    /// The axis that a rotation takes nearest to +Y.
    pub fn of(rotation: &UnitQuaternion<f64>) -> Self {
        let height = |up: &Self| (rotation * up.axis()).y;
        Self::ALL.into_iter().reduce(|a, b| if height(&b) > height(&a) { b } else { a }).unwrap_or(Self::Y)
    }
}

impl fmt::Display for Up {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Up {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = Self::ALL.into_iter().find(|up| up.name() == text.trim_start_matches('+'));
        known.ok_or_else(|| format!("`{text}` is not an axis; choose one of {}", Self::ALL.map(Self::name).join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_axis_is_taken_to_plus_y_and_recognised() {
        for up in Up::ALL {
            let rotation = up.upright();
            assert!((rotation * up.axis() - Vector3::y()).norm() < 1e-12, "{up}");
            assert_eq!((Up::of(&rotation), up.name().parse()), (up, Ok(up)));
        }
        assert!("w".parse::<Up>().unwrap_err().contains("-z"));
    }
}
