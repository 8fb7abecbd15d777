//! Settings of the matcher.

use serde::{Deserialize, Serialize};

use crate::{StereoError, census::BITS, path::Penalties};

/// The largest number of disparities that one search may cover.
pub const MAX_DISPARITIES: u32 = 256;

/// How two rectified images are matched.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MatchSettings {
    /// Smallest disparity that is looked for, pixels; default 0 (infinitely far). Larger values leave out what is far.
    pub min_disparity: u32,
    /// How many disparities from there are looked for, 1 to 256; default 64. What is nearer stays unmatched.
    /// The search runs in vectors of 32, so the count is rounded up to 32, 64, 96, 128, 192 or 256.
    pub disparities: u32,
    /// Penalty for neighbours whose disparities differ by one, as a share of the largest matching cost (24 differing
    /// bits); 0 to 7, default 0.3. Larger values smooth slanted surfaces.
    pub small_penalty: f32,
    /// Penalty for a jump, same unit, at least the small one; 0 to 7, default 1.5. Larger values keep surfaces together
    /// and lose thin things.
    pub large_penalty: f32,
    /// How much costlier any other disparity must be, as a share of the winner's cost; 0 to 1, default 0.1. Larger values
    /// answer fewer pixels, more of them rightly.
    pub uniqueness: f32,
    /// How far the disparity found from the right image may be off, pixels; default 1. Occluded pixels fail here.
    pub left_right: u32,
    /// Islands of fewer pixels than this are not answered; default 100, 0 keeps all.
    pub speckle_area: u32,
    /// Neighbours whose disparities differ by less belong to one island, pixels; default 1.
    pub speckle_step: f32,
    /// Whether a 3×3 median smooths the disparities of pixels with eight answered neighbours; default true.
    pub median: bool,
}

impl Default for MatchSettings {
    fn default() -> Self {
        Self {
            min_disparity: 0,
            disparities: 64,
            small_penalty: 0.3,
            large_penalty: 1.5,
            uniqueness: 0.1,
            left_right: 1,
            speckle_area: 100,
            speckle_step: 1.0,
            median: true,
        }
    }
}

/// Largest penalty, as a share of the largest matching cost: path costs must fit a byte.
const MAX_PENALTY: f32 = 7.0;

impl MatchSettings {
    /// Checks every field against its range, and the search against an image `width` pixels wide.
    ///
    /// # Errors
    /// [`StereoError::Settings`] names the field.
    pub fn check(&self, width: u32) -> Result<(), StereoError> {
        let wrong = |reason: String| Err(StereoError::Settings(reason));
        if !(1..=MAX_DISPARITIES).contains(&self.disparities) {
            return wrong(format!("disparities is {}; choose 1 to {MAX_DISPARITIES}", self.disparities));
        }
        if self.min_disparity >= width {
            return wrong(format!("min_disparity is {} in images {width} pixels wide", self.min_disparity));
        }
        if !(0.0..=MAX_PENALTY).contains(&self.small_penalty)
            || !(self.small_penalty..=MAX_PENALTY).contains(&self.large_penalty)
        {
            let (small, large) = (self.small_penalty, self.large_penalty);
            return wrong(format!("penalties are {small} and {large}; choose 0 <= small <= large <= {MAX_PENALTY}"));
        }
        if !(0.0..=1.0).contains(&self.uniqueness) || !(0.0..=f32::MAX).contains(&self.speckle_step) {
            let (unique, step) = (self.uniqueness, self.speckle_step);
            return wrong(format!("uniqueness is {unique} (0 to 1), speckle_step is {step} (0 or more)"));
        }
        Ok(())
    }

    /// The penalties in differing bits.
    pub(crate) fn penalties(&self) -> Penalties {
        let bits = |share: f32| (share * f32::from(BITS)).round() as u8;
        Penalties { small: bits(self.small_penalty), large: bits(self.large_penalty) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_field_out_of_range_is_named() {
        let good = MatchSettings::default();
        assert!(good.check(640).is_ok());
        let named = |settings: MatchSettings| settings.check(640).unwrap_err().to_string();
        assert!(named(MatchSettings { disparities: 0, ..good }).contains("disparities"));
        assert!(named(MatchSettings { disparities: 257, ..good }).contains("disparities"));
        assert!(named(MatchSettings { min_disparity: 640, ..good }).contains("min_disparity"));
        assert!(named(MatchSettings { large_penalty: 0.1, ..good }).contains("penalties"));
        assert!(named(MatchSettings { large_penalty: 7.5, ..good }).contains("penalties"));
        assert!(named(MatchSettings { uniqueness: f32::NAN, ..good }).contains("uniqueness"));
        assert!(named(MatchSettings { speckle_step: -1.0, ..good }).contains("speckle_step"));
    }
}
