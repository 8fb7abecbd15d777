//! From two images of the cameras to depth.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use toile_capture::{DepthImage, RgbImage};

use crate::{
    DisparityMap, MatchSettings, Rectification, Remap, StereoError, luma, match_pair, settings::MAX_DISPARITIES,
};

/// Where depth is looked for, and how it is stored.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DepthSettings {
    /// Nearest depth, metres; default 0.5. Nearer needs more disparities and time.
    pub near: f64,
    /// Farthest depth, metres; default 4.0.
    pub far: f64,
    /// Metres a unit of the depth image; default 0.0001. `far` must fit 65535 units.
    pub depth_scale: f64,
    /// How the pair is matched; `min_disparity` and `disparities` follow from `near` and `far`.
    pub matching: MatchSettings,
}

impl Default for DepthSettings {
    fn default() -> Self {
        Self { near: 0.5, far: 4.0, depth_scale: 0.0001, matching: MatchSettings::default() }
    }
}

/// Two calibrated cameras as one depth camera.
#[derive(Debug, Clone)]
pub struct DepthFromPair {
    rectification: Rectification,
    maps: [Remap; 2],
    settings: DepthSettings,
}

/// The depth of a pair of images.
#[derive(Debug, Clone, PartialEq)]
pub struct PairDepth {
    /// Depth of the rectified left camera.
    pub depth: DepthImage,
    /// The rectified left image.
    pub left: RgbImage,
}

impl DepthFromPair {
    /// Prepares the maps and the range of the search.
    ///
    /// # Errors
    /// [`StereoError::Settings`] where the range cannot be searched or stored.
    pub fn new(rectification: Rectification, settings: DepthSettings) -> Result<Self, StereoError> {
        let (first, count) = search(&rectification, &settings).map_err(StereoError::Settings)?;
        let matching = MatchSettings { min_disparity: first, disparities: count, ..settings.matching };
        matching.check(rectification.camera.width)?;
        let maps = [&rectification.left, &rectification.right].map(|view| Remap::new(view, &rectification.camera));
        Ok(Self { rectification, maps, settings: DepthSettings { matching, ..settings } })
    }

    /// The rectification in use.
    pub fn rectification(&self) -> &Rectification {
        &self.rectification
    }

    /// The settings in use, with the disparities that follow from the range.
    pub fn settings(&self) -> &DepthSettings {
        &self.settings
    }

    /// The left image as the depth camera sees it.
    ///
    /// # Errors
    /// [`StereoError::Images`] where the image is not of the calibration's size.
    pub fn rectified_left(&self, left: &RgbImage) -> Result<RgbImage, StereoError> {
        self.maps[0].rgb(left).ok_or_else(|| other_size(left, left))
    }

    /// Depth of a pair taken at one time: rectified, matched, in units of `depth_scale`; 0 where it is not known.
    ///
    /// # Errors
    /// [`StereoError::Images`] where an image is not of the calibration's size.
    pub fn depth(&self, left: &RgbImage, right: &RgbImage) -> Result<PairDepth, StereoError> {
        let (Some(rectified), Some(other)) = (self.maps[0].rgb(left), self.maps[1].rgb(right)) else {
            return Err(other_size(left, right));
        };
        let disparities = match_pair(&luma(&rectified), &luma(&other), &self.settings.matching)?;
        Ok(PairDepth { depth: self.depth_of(&disparities), left: rectified })
    }

    /// Z = f b / d where both cameras see the point and it lies within the range.
    fn depth_of(&self, disparities: &DisparityMap) -> DepthImage {
        let DepthSettings { near, far, depth_scale, .. } = self.settings;
        let focal_baseline = self.rectification.camera.fx * self.rectification.baseline;
        let width = disparities.width as usize;
        let value = |(i, &disparity): (usize, &f32)| {
            let other = i - (disparity.round() as usize).min(i % width);
            let depth = focal_baseline / f64::from(disparity);
            let known = disparity > 0.0 && (near..=far).contains(&depth);
            if known && self.maps[0].is_seen(i) && self.maps[1].is_seen(other) {
                (depth / depth_scale).round() as u16
            } else {
                0
            }
        };
        let values = disparities.values.par_iter().enumerate().map(value).collect();
        DepthImage { width: disparities.width, height: disparities.height, values }
    }
}

fn other_size(left: &RgbImage, right: &RgbImage) -> StereoError {
    let size = |i: &RgbImage| (i.width, i.height, i.pixels.len());
    StereoError::Images { left: size(left), right: size(right) }
}

/// First disparity and number of disparities between `far` and `near`, one more on either side for the fractions.
fn search(rectification: &Rectification, settings: &DepthSettings) -> Result<(u32, u32), String> {
    let DepthSettings { near, far, depth_scale, .. } = *settings;
    if !(near > 0.0 && far > near && far.is_finite() && depth_scale > 0.0) {
        return Err(format!("near is {near}, far {far}, depth_scale {depth_scale}: 0 < near < far, scale above 0"));
    }
    if far / depth_scale > f64::from(u16::MAX) {
        return Err(format!("far is {far} m, which 16 bits of {depth_scale} m do not hold; choose depth_scale 0.001"));
    }
    let focal_baseline = rectification.camera.fx * rectification.baseline;
    let first = ((focal_baseline / far).floor() - 1.0).max(0.0);
    let count = (focal_baseline / near).ceil() + 2.0 - first;
    if count > f64::from(MAX_DISPARITIES) {
        let nearest = focal_baseline / (first + f64::from(MAX_DISPARITIES) - 2.0);
        return Err(format!(
            "near is {near} m, which needs {count} disparities of at most {MAX_DISPARITIES}; choose near >= {nearest:.3} \
             or smaller images"
        ));
    }
    Ok((first as u32, count as u32))
}
