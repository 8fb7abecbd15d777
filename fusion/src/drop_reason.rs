//! Why a frame is left out.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::settings::KNOWN_POSE_WITHIN_NS;

/// Why a frame is left out of the scan. Reports hold it as the sentence that [`fmt::Display`] writes.
#[derive(Debug, Clone, PartialEq)]
pub enum DropReason {
    /// The source could not read it; its message.
    Unreadable(String),
    /// It has no depth image, or one of another size than the sensor's.
    NoDepth,
    /// Too little of the subject is in view.
    TooFewPixels {
        /// Measured pixels of the subject.
        pixels: usize,
    },
    /// The take cannot begin with it: too few pixels have a normal.
    TooLittleSurface,
    /// Poses are known, but none of a time near enough.
    NoKnownPose,
    /// Too few of its points lie on the model.
    LittleOverlap {
        /// Share of the points that lie within the model's band.
        overlap: f64,
    },
    /// Too few of its points agree with the model, or not closely enough.
    Disagrees {
        /// Share of the points in the band that agree.
        inliers: f64,
        /// Their root mean square distance, metres.
        residual: f64,
    },
    /// It fits where a turntable cannot have brought the subject.
    Departs {
        /// Distance from the prediction at the axis, metres.
        shift: f64,
        /// Angle from the prediction, radians.
        angle: f64,
    },
    /// Its sensor's place in the rig was not found.
    SensorNotPlaced,
    /// It does not fit where its sensor stands.
    OffItsPlace,
    /// The subject was lost and fits elsewhere; the next frame must be tracked from there.
    Unconfirmed,
}

impl fmt::Display for DropReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreadable(message) => f.write_str(message),
            Self::NoDepth => f.write_str("its depth image is missing or not of the sensor's size"),
            Self::TooFewPixels { pixels } => write!(f, "only {pixels} pixels of the subject are seen"),
            Self::TooLittleSurface => f.write_str("too little surface to begin with"),
            Self::NoKnownPose => {
                write!(f, "a known pose within {} ms of it is missing", KNOWN_POSE_WITHIN_NS / 1_000_000)
            }
            Self::LittleOverlap { overlap } => {
                write!(f, "lost: {:.0} % of its points lie on the model", overlap * 100.0)
            }
            Self::Disagrees { inliers, residual } => {
                let (percent, mm) = (inliers * 100.0, residual * 1e3);
                write!(f, "lost: {percent:.0} % of its points agree, {mm:.1} mm residual")
            }
            Self::Departs { shift, angle } => {
                let (mm, degrees) = (shift * 1e3, angle.to_degrees());
                write!(f, "its pose departs {mm:.0} mm and {degrees:.1}° from the turn so far")
            }
            Self::SensorNotPlaced => f.write_str("where its sensor stands was not found"),
            Self::OffItsPlace => f.write_str("it does not fit where its sensor stands"),
            Self::Unconfirmed => f.write_str("lost: it fits elsewhere; the next frame must confirm that"),
        }
    }
}

impl Serialize for DropReason {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// A report holds the sentence alone: it is read back as a message, which is written as the same sentence again.
impl<'de> Deserialize<'de> for DropReason {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer).map(Self::Unreadable)
    }
}
