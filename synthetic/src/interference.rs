//! What the light of other depth cameras does to an image.

use crate::sensor::NoiseSeed;

/// Size of the lumps in which pixels are lost, pixels.
const LUMP: f64 = 11.0;
/// Standard deviation that is added to what is left, metres at 1 m; it grows with the square of the distance.
const NOISE_M: f64 = 0.0006;

/// Takes away a share of the depth (units of a millimetre) in lumps that differ from frame to frame, and makes the rest noisier.
pub(crate) fn disturb(depth: &mut [u16], (width, _): (u32, u32), share: f64, noise: NoiseSeed) {
    if share <= 0.0 {
        return;
    }
    // The share of a normal distribution that lies above this many standard deviations (Abramowitz and Stegun 26.2.23).
    let t = (-2.0 * share.min(0.5).ln()).sqrt();
    let limit = t
        - (2.515_517 + 0.802_853 * t + 0.010_328 * t * t)
            / (1.0 + 1.432_788 * t + 0.189_269 * t * t + 0.001_308 * t * t * t);
    for (i, d) in depth.iter_mut().enumerate().filter(|(_, d)| **d > 0) {
        let (u, v) = (i % width as usize, i / width as usize);
        let z = f64::from(*d) * 1e-3;
        let moved = z + NOISE_M * z * z * noise.normal(i, 11);
        *d = if noise.lumpy(u, v, LUMP, 12) > limit { 0 } else { (moved * 1e3).round().clamp(0.0, 65_535.0) as u16 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn about_the_share_that_is_asked_for_is_lost() {
        for share in [0.05, 0.2] {
            let mut depth = vec![2000; 512 * 424];
            disturb(&mut depth, (512, 424), share, NoiseSeed { seed: 3, frame: 7 });
            let lost = depth.iter().filter(|d| **d == 0).count() as f64 / depth.len() as f64;
            assert!((lost / share - 1.0).abs() < 0.3, "{lost} of {share}");
            assert!(depth.iter().filter(|d| **d > 0).all(|d| d.abs_diff(2000) < 20));
        }
    }
}
