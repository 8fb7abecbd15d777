//! What spoils depth beside the sensor's own noise, each switched on by itself.

use serde::{Deserialize, Serialize};
use toile_geometry::camera::PinholeCamera;

use crate::SyntheticError;

/// What spoils depth beside the sensor's own noise. The default spoils nothing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Nuisances {
    /// Brown–Conrady coefficients k1 k2 p1 p2 k3 of the lens; −0.5..0.5 each, default an ideal lens.
    pub lens: [f64; 5],
    /// The calibration does not tell of the lens, default false.
    pub is_lens_untold: bool,
    /// Depth is told as this many times what was measured; 0.9..1.1, default 1.
    pub depth_scale: f64,
    /// Standard deviation of noise in blotches of nine pixels, metres at 2 m (it grows with the square of the depth); 0..0.05.
    pub blotches_m: f64,
    /// Black cloth (the garment's own colour is black) is four times as noisy, and a seventh of it is not measured.
    pub has_dark_cloth: bool,
    /// How much too far light by way of the floor makes the floor and what stands on it, metres; it falls to a third
    /// every 8 cm upward; 0..0.1.
    pub multipath_m: f64,
    /// How far the disk turns while a picture is exposed, degrees; 0..10.
    pub smear_degrees: f64,
    /// Width of the brim of flying pixels around hair, pixels; 0..20.
    pub brim_pixels: usize,
    /// How far the disk seems to rise at the rim of what stands on it, metres; 0..0.05.
    pub plates_m: f64,
    /// Widest gap between two legs across which threads are seen, pixels; 0..40.
    pub strings_pixels: usize,
}

impl Default for Nuisances {
    fn default() -> Self {
        Self {
            lens: [0.0; 5],
            is_lens_untold: false,
            depth_scale: 1.0,
            blotches_m: 0.0,
            has_dark_cloth: false,
            multipath_m: 0.0,
            smear_degrees: 0.0,
            brim_pixels: 0,
            plates_m: 0.0,
            strings_pixels: 0,
        }
    }
}

impl Nuisances {
    /// True where nothing is spoilt.
    pub fn are_none(&self) -> bool {
        *self == Self::default()
    }

    /// The camera with its lens.
    pub fn bent(&self, ideal: &PinholeCamera) -> PinholeCamera {
        PinholeCamera { distortion: self.lens, ..*ideal }
    }

    /// The camera as the calibration tells it.
    pub fn told(&self, ideal: &PinholeCamera) -> PinholeCamera {
        if self.is_lens_untold { *ideal } else { self.bent(ideal) }
    }

    /// Checks every range.
    ///
    /// # Errors
    /// [`SyntheticError::Setting`] names the first setting that is out of its range.
    pub fn validate(&self) -> Result<(), SyntheticError> {
        let within = |name, value: f64, low: f64, high: f64| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            Err(SyntheticError::setting(name, format!("{value} is not within {low} to {high}")))
        };
        self.lens.iter().try_for_each(|k| within("lens", *k, -0.5, 0.5))?;
        within("depth_scale", self.depth_scale, 0.9, 1.1)?;
        within("blotches_m", self.blotches_m, 0.0, 0.05)?;
        within("multipath_m", self.multipath_m, 0.0, 0.1)?;
        within("smear_degrees", self.smear_degrees, 0.0, 10.0)?;
        within("brim_pixels", self.brim_pixels as f64, 0.0, 20.0)?;
        within("plates_m", self.plates_m, 0.0, 0.05)?;
        within("strings_pixels", self.strings_pixels as f64, 0.0, 40.0)
    }
}
