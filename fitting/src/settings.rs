//! Settings of the fits: units, ranges, defaults.

use std::{collections::BTreeMap, ops::RangeInclusive};

use serde::{Deserialize, Serialize};
use toile_character::{Joint, JointRegressor, joint::JOINTS};

use crate::FittingError;

/// Landmarks by the template's names, metres, in the scan's own frame.
pub type HandLandmarks = BTreeMap<String, [f64; 3]>;

/// Whose way a fit goes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Robust distances in both directions, priors, coarse to fine.
    #[default]
    Toile,
    /// As the seed prints it (Hu et al. 2017): eq. 4 for the body, eq. 5 and 6 under clothes; no priors, no trust, no
    /// normals. [`FitSettings::seed`] and [`UnderSettings::seed`] also give its numbers.
    Seed,
}

/// Which map by landmarks the conformation starts from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LandmarkMap {
    /// Landmarks set by hand carry their surroundings along.
    #[default]
    ByHand,
    /// All landmarks, found ones too, carry the whole body by radial basis functions (the conformation of the V-Man
    /// project, §2.1.1).
    WholeBody,
}

/// Settings of [`crate::fit_body`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FitSettings {
    /// Whose way: `toile` (default) or `seed`.
    pub method: Method,
    /// Shape components used, 1 to the model's own number (50). Default 50; the seed used 15.
    pub components: usize,
    /// How joints follow the shape: `affine` (default), or `mean-value` coordinates as in the seed.
    pub joints: JointRegressor,
    /// The person wears clothes: shape and pose are estimated from a scan that stands off, and the scan's surface is not
    /// taken on. Default false.
    pub dressed: bool,
    /// Landmarks set by hand, metres, in the scan's own frame: they drive the pose and carry the skin along. Default none.
    pub landmarks: HandLandmarks,
    /// Headings tried, evenly spread over the turn, 1 to 360. Default 8.
    pub headings: usize,
    /// Standard deviation that the shape prior gives each coefficient, 0.01 to 100; larger trusts the scan more.
    /// Default 1. Only `toile`.
    pub shape_sigma: f64,
    /// Standard deviation of the scan's surface that fine residuals are weighed by, metres, 0.00001 to 0.1. Default 0.002.
    /// Only `toile`.
    pub noise: f64,
    /// Gauss–Newton steps of the finest resolution at most, 0 to 1000. Default 24, of which a fit that
    /// comes to rest needs some five; closest points without priors need some 60.
    pub fine_iterations: usize,
    /// Whether the body takes on the scan's own surface. Default true; the seed's does not.
    pub conform: bool,
    /// Settings of that.
    pub conformation: ConformSettings,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self {
            method: Method::Toile,
            components: 50,
            joints: JointRegressor::Affine,
            dressed: false,
            landmarks: HandLandmarks::new(),
            headings: 8,
            shape_sigma: 1.0,
            noise: 0.002,
            fine_iterations: 24,
            conform: true,
            conformation: ConformSettings::default(),
        }
    }
}

/// Settings of the conformation (local deformation under an elastic energy).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ConformSettings {
    /// The map by landmarks that it starts from: `by-hand` (default) or `whole-body`.
    pub map: LandmarkMap,
    /// Closest-point rounds, 0 to 100. Default 3.
    pub rounds: usize,
    /// Farthest that the scan may draw a vertex, metres, 0.001 to 0.2. Default 0.025.
    pub reach: f64,
    /// Length over which the bending energy smooths the displacement, metres, 0.0005 to 0.2: detail much finer than six
    /// times this is left out. Default 0.006.
    pub stiffness_length: f64,
    /// The same for hands and feet, which must stay well-formed, metres. Default 0.015.
    pub extremity_length: f64,
    /// The same for the head, metres. Default 0.008.
    pub head_length: f64,
    /// Smallest cosine between the normals of body and scan, −1 to 1; half of it on head and feet. Default 0.6.
    pub min_cos: f64,
}

impl Default for ConformSettings {
    fn default() -> Self {
        Self {
            map: LandmarkMap::ByHand,
            rounds: 3,
            reach: 0.025,
            stiffness_length: 0.006,
            extremity_length: 0.015,
            head_length: 0.008,
            min_cos: 0.6,
        }
    }
}

/// Settings of [`crate::pose_under`] and [`crate::settle_under`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct UnderSettings {
    /// Whose way: `toile` (default), or `seed`: articulated ICP without priors (eq. 5), its body not settled afterwards.
    pub method: Method,
    /// Joints that `seed` turns besides the hips (the seed's "chosen joint angles"), by their VRM names. Default all but the
    /// fingers.
    pub joints: Vec<Joint>,
    /// Whether `seed` keeps the mesh inside the scan (eq. 6) or not (eq. 5). Default true.
    pub inside: bool,
    /// Headings tried, evenly spread over the turn, 1 to 360. Default 12.
    pub headings: usize,
    /// Standard deviation of a joint's turn away from the initial pose, radians, 0.0001 to 3.2. Default 0.05 (2.9°).
    pub joint_sigma: f64,
    /// Distance at which a match counts a quarter, metres, 0.0001 to 0.1: beyond it the scan is taken for new cloth over
    /// the mesh. Default 0.004.
    pub cloth: f64,
    /// How far new cloth typically stands off, metres, 0.0001 to 0.5: covered limbs are drawn to the middle of their
    /// sleeves with this standard deviation. Default 0.012.
    pub stand_off: f64,
    /// Standard deviation of the one-sided inside term, metres, 0.00001 to 0.1. Default 0.002.
    pub inside_sigma: f64,
    /// Difference of colour (root mean square of the channels) at which a match counts a quarter, 1 to 255. Default 25;
    /// colours are left out where either mesh has none.
    pub color: f32,
    /// Gauss–Newton steps of the finest resolution at most, 0 to 1000. Default 20.
    pub fine_iterations: usize,
}

impl Default for UnderSettings {
    fn default() -> Self {
        Self {
            method: Method::Toile,
            joints: JOINTS.into_iter().filter(|j| *j != Joint::Hips && !j.is_finger()).collect(),
            inside: true,
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

/// A setting as a check reads it: name, value, the values it may have, unit.
type Checked = (&'static str, f64, RangeInclusive<f64>, &'static str);

fn check(settings: &[Checked]) -> Result<(), FittingError> {
    match settings.iter().find(|(_, value, range, _)| !range.contains(value)) {
        None => Ok(()),
        Some((name, value, range, unit)) => {
            let reason = format!("is {value}, but must lie between {} and {}{unit}", range.start(), range.end());
            Err(FittingError::Setting { name, reason })
        }
    }
}

impl FitSettings {
    /// The seed's own way with its numbers: 15 components, joints by mean value coordinates, and the model itself as the
    /// body.
    pub fn seed() -> Self {
        Self {
            method: Method::Seed,
            components: 15,
            joints: JointRegressor::MeanValue,
            fine_iterations: 60,
            conform: false,
            ..Self::default()
        }
    }

    /// Checks all values for a model of `components` shape components.
    ///
    /// # Errors
    /// [`FittingError::Setting`] names the first field that is out of its range, and the range.
    pub fn check(&self, components: usize) -> Result<(), FittingError> {
        let c = &self.conformation;
        check(&[
            ("components", self.components as f64, 1.0..=components as f64, ""),
            ("headings", self.headings as f64, 1.0..=360.0, ""),
            ("shape_sigma", self.shape_sigma, 0.01..=100.0, " standard deviations"),
            ("noise", self.noise, 1e-5..=0.1, " m"),
            ("fine_iterations", self.fine_iterations as f64, 0.0..=1000.0, ""),
            ("conformation.rounds", c.rounds as f64, 0.0..=100.0, ""),
            ("conformation.reach", c.reach, 0.001..=0.2, " m"),
            ("conformation.stiffness_length", c.stiffness_length, 0.0005..=0.2, " m"),
            ("conformation.extremity_length", c.extremity_length, 0.0005..=0.2, " m"),
            ("conformation.head_length", c.head_length, 0.0005..=0.2, " m"),
            ("conformation.min_cos", c.min_cos, -1.0..=1.0, ""),
        ])
    }
}

impl UnderSettings {
    /// The seed's own way: articulated ICP on all joints but the fingers', kept inside (eq. 6).
    pub fn seed() -> Self {
        Self { method: Method::Seed, fine_iterations: 60, ..Self::default() }
    }

    /// Checks all values.
    ///
    /// # Errors
    /// [`FittingError::Setting`] names the first field that is out of its range, and the range.
    pub fn check(&self) -> Result<(), FittingError> {
        check(&[
            ("headings", self.headings as f64, 1.0..=360.0, ""),
            ("joint_sigma", self.joint_sigma, 1e-4..=3.2, " rad"),
            ("cloth", self.cloth, 1e-4..=0.1, " m"),
            ("stand_off", self.stand_off, 1e-4..=0.5, " m"),
            ("inside_sigma", self.inside_sigma, 1e-5..=0.1, " m"),
            ("color", f64::from(self.color), 1.0..=255.0, ""),
            ("fine_iterations", self.fine_iterations as f64, 0.0..=1000.0, ""),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_out_of_range_are_named_with_the_range() {
        FitSettings::default().check(50).unwrap();
        UnderSettings::default().check().unwrap();
        let error = |s: FitSettings| s.check(50).unwrap_err().to_string();
        let many = error(FitSettings { components: 51, ..FitSettings::default() });
        assert_eq!(many, "setting components: is 51, but must lie between 1 and 50");
        let conformation = ConformSettings { reach: f64::NAN, ..ConformSettings::default() };
        let not_a_number = error(FitSettings { conformation, ..FitSettings::default() });
        assert!(
            not_a_number.contains("conformation.reach: is NaN") && not_a_number.ends_with("0.2 m"),
            "{not_a_number}"
        );
        let unknown = serde_json::from_str::<FitSettings>(r#"{"methode": "seed"}"#).unwrap_err().to_string();
        assert!(unknown.contains("methode") && unknown.contains("method"), "{unknown}");
        let seed: UnderSettings = serde_json::from_str(r#"{"method": "seed", "joints": ["leftUpperLeg"]}"#).unwrap();
        assert_eq!((seed.method, seed.joints), (Method::Seed, vec![Joint::LeftUpperLeg]));
        let none = UnderSettings { headings: 0, ..UnderSettings::default() };
        assert!(none.check().unwrap_err().to_string().contains("headings"));
    }
}
