//! How noisy a depth image is, from the image itself.

use toile_geometry::{
    camera::PinholeCamera,
    statistics::{SIGMA_PER_MAD, median},
};

use super::view::is_measured;

/// Half width of the windows whose mean a pixel is compared with, pixels.
const REACH: usize = 4;
/// Neighbours farther than this many pixel widths in depth belong to another surface.
const SLOPE: f32 = 6.0;

/// Robust standard deviation (metres) of depth about the mean of symmetric neighbours along rows and columns;
/// disparity steps count as noise. `None` where fewer than 200 pixels have such neighbours.
pub fn depth_noise(camera: &PinholeCamera, depth: &[f32]) -> Option<f64> {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let slope = SLOPE * REACH as f32 / camera.fx as f32;
    let mut offsets = Vec::new();
    for y in REACH..h.saturating_sub(REACH) {
        for x in REACH..w.saturating_sub(REACH) {
            let i = y * w + x;
            offsets.extend([1, w].into_iter().filter_map(|step| offset(depth, i, step, slope)));
        }
    }
    if offsets.len() < 200 {
        return None;
    }
    let median = median(&mut offsets)?;
    // The mean of 2 REACH neighbours carries noise of its own.
    let share = (1.0 + 1.0 / (2 * REACH) as f64).sqrt();
    Some(SIGMA_PER_MAD * f64::from(median) / share)
}

/// Absolute offset of a pixel from the mean of its neighbours along one direction.
fn offset(depth: &[f32], i: usize, step: usize, slope: f32) -> Option<f32> {
    let d = depth[i];
    if !is_measured(d) {
        return None;
    }
    let gate = slope * d;
    let mut sum = 0.0;
    for k in 1..=REACH {
        let (a, b) = (depth[i - k * step], depth[i + k * step]);
        if !is_measured(a) || !is_measured(b) || (a - d).abs() > gate || (b - d).abs() > gate {
            return None;
        }
        sum += a + b;
    }
    Some((d - sum / (2 * REACH) as f32).abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_noise_on_a_slope_is_measured() {
        let camera = PinholeCamera::ideal(100, 80, 365.0, 365.0, 50.0, 40.0);
        let mut seed = 7u32;
        let mut uniform = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 8_388_608.0 - 1.0
        };
        let depth: Vec<f32> = (0..8000).map(|i| 2.0 + 0.003 * (i % 100) as f32 + 0.004 * uniform()).collect();
        let sigma = depth_noise(&camera, &depth).expect("all is measured");
        let truth = 0.004 / 3.0f64.sqrt();
        assert!((sigma / truth - 1.0).abs() < 0.35, "{sigma} for {truth}");
        assert_eq!(depth_noise(&camera, &vec![0.0; 8000]), None);
    }
}
