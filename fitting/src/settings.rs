//! Settings of the stages.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use toile_character::JointRegressor;

/// Landmarks by the template's names, metres, in the scan's own frame.
pub type HandLandmarks = BTreeMap<String, [f64; 3]>;

/// Settings of [`crate::fit_body`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FitSettings {
    /// Shape components used, 1 to the model's own number (the seed used 15). Default 50.
    pub components: usize,
    /// How joints follow the shape: affine (default), or by mean value coordinates as in the seed.
    pub joints: JointRegressor,
    /// The person wears clothes: shape and pose are estimated from a scan that stands off, and no surface is taken
    /// on. Default false.
    pub dressed: bool,
    /// Landmarks set by hand; the others are found. Default none.
    pub landmarks: HandLandmarks,
    /// Headings tried, evenly spread over the turn, at least 1. Default 8.
    pub headings: usize,
    /// Standard deviation that the shape prior gives each coefficient; larger trusts the scan more. Default 1.
    pub shape_sigma: f64,
    /// Standard deviation of the scan's surface that fine residuals are weighed by, metres. Default 0.002.
    pub noise: f64,
    /// Most Gauss–Newton steps of the finest level. Default 12.
    pub fine_iterations: usize,
    /// Whether the body takes on the scan's own surface. Default true.
    pub conform: bool,
    /// Settings of that.
    pub conformation: ConformSettings,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self {
            components: 50,
            joints: JointRegressor::Affine,
            dressed: false,
            landmarks: HandLandmarks::new(),
            headings: 8,
            shape_sigma: 1.0,
            noise: 0.002,
            fine_iterations: 12,
            conform: true,
            conformation: ConformSettings::default(),
        }
    }
}

/// Settings of the conformation (local deformation under an elastic energy).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ConformSettings {
    /// Closest-point rounds. Default 3.
    pub rounds: usize,
    /// Farthest that the scan may draw a vertex, metres. Default 0.025.
    pub reach: f64,
    /// Length over which the bending energy smooths the displacement, metres: detail much finer than six times
    /// this is left out. Default 0.006.
    pub stiffness_length: f64,
    /// The same for hands and feet, which must stay well-formed, metres. Default 0.015.
    pub extremity_length: f64,
    /// The same for the head, metres. Default 0.008.
    pub head_length: f64,
    /// Smallest cosine between the normals of body and scan; half of it on head and feet. Default 0.6.
    pub min_cos: f64,
}

impl Default for ConformSettings {
    fn default() -> Self {
        Self {
            rounds: 3,
            reach: 0.025,
            stiffness_length: 0.006,
            extremity_length: 0.015,
            head_length: 0.008,
            min_cos: 0.6,
        }
    }
}

/// Settings of [`crate::pose_under`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct UnderSettings {
    /// Headings tried, evenly spread over the turn, at least 1. Default 12.
    pub headings: usize,
    /// Standard deviation of a joint's turn away from the initial pose, radians. Default 0.05 (2.9°).
    pub joint_sigma: f64,
    /// Distance at which a match counts a quarter: beyond it the scan is taken for new cloth over the mesh, metres.
    /// Default 0.004.
    pub cloth: f64,
    /// How far new cloth typically stands off, metres: covered limbs are drawn to the middle of their sleeves with
    /// this standard deviation. Default 0.012.
    pub stand_off: f64,
    /// Standard deviation of the one-sided inside term, metres. Default 0.002.
    pub inside_sigma: f64,
    /// Difference of colour (0–255, root mean square of the channels) at which a match counts a quarter. Default 25;
    /// colours are left out where either mesh has none.
    pub color: f32,
    /// Most Gauss–Newton steps of the finest level. Default 20.
    pub fine_iterations: usize,
}

impl Default for UnderSettings {
    fn default() -> Self {
        Self {
            headings: 12,
            joint_sigma: 0.05,
            cloth: 0.004,
            stand_off: 0.012,
            inside_sigma: 0.002,
            color: 25.0,
            fine_iterations: 20,
        }
    }
}
