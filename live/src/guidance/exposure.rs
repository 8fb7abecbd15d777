//! How well the subject is lit.

use serde::Serialize;
use toile_capture::RgbImage;

/// A pixel darker than this has lost its colour in the noise of eight bits; one brighter is clipped.
const DARK: u8 = 16;
const BRIGHT: u8 = 250;
/// Shares of the subject that may be so: black shoes and hair, a white collar.
const MOST_DARK: f64 = 0.5;
const MOST_BRIGHT: f64 = 0.15;
/// Mean lightness below which the colours of a scan are noisy.
const LEAST_MEAN: f64 = 0.10;

/// How well the subject is lit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Exposure {
    /// Neither too dark nor too bright.
    pub ok: bool,
    /// Mean of the subject's pixels, 0 black to 1 white, as they are in the picture (sRGB).
    pub mean: f64,
    /// What to do.
    pub advice: Option<String>,
}

impl Exposure {
    /// Of the pixels of `picture` that `is_subject` holds; of all where the two have not one size.
    pub fn of(picture: &RgbImage, is_subject: &[bool]) -> Option<Self> {
        let held = is_subject.len() == picture.pixels.len();
        let pixels = picture.pixels.iter().enumerate().step_by(3).filter(|(k, _)| !held || is_subject[*k]);
        let (mut count, mut sum, mut dark, mut bright) = (0.0, 0.0, 0.0, 0.0);
        for (_, pixel) in pixels {
            let [r, g, b] = pixel.map(f64::from);
            let peak = *pixel.iter().max()?;
            count += 1.0;
            sum += (0.2126 * r + 0.7152 * g + 0.0722 * b) / 255.0;
            dark += f64::from(u8::from(peak < DARK));
            bright += f64::from(u8::from(peak >= BRIGHT));
        }
        if count == 0.0 {
            return None;
        }
        let mean = sum / count;
        let advice = if dark / count > MOST_DARK || mean < LEAST_MEAN {
            Some("The picture is too dark: more light, or a longer exposure.".to_string())
        } else if bright / count > MOST_BRIGHT {
            Some("The picture is too bright: less light on the person, or a shorter exposure.".to_string())
        } else {
            None
        };
        Some(Self { ok: advice.is_none(), mean, advice })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(subject: u8, around: u8) -> Exposure {
        let pixels: Vec<[u8; 3]> = (0..900).map(|k| [if k % 30 < 10 { subject } else { around }; 3]).collect();
        let is_subject: Vec<bool> = (0..900).map(|k| k % 30 < 10).collect();
        Exposure::of(&RgbImage { width: 30, height: 30, pixels }, &is_subject).unwrap()
    }

    #[test]
    fn only_the_subject_counts() {
        assert!(of(120, 0).ok && of(120, 255).ok);
        assert!(of(10, 120).advice.unwrap().contains("too dark"));
        assert!(of(254, 120).advice.unwrap().contains("too bright"));
        assert!((of(51, 0).mean - 0.2).abs() < 1e-9);
    }
}
