//! Smooth noise in space: wrinkles, skin, cloth.

use nalgebra::{Point3, Vector3};

use crate::random::uniform_at;

/// Value noise in [-1, 1] with features of about one unit: random lattice values, blended smoothly.
pub fn smooth(p: &Point3<f32>, seed: u64) -> f32 {
    let cell = p.map(f32::floor);
    let f = (p - cell).map(|t| t * t * t * (t * (t * 6.0 - 15.0) + 10.0));
    let corner = |i: usize| {
        let at = |k: usize| i64::from(cell[k] as i32) + (i >> k & 1) as i64;
        let key = (at(1) as u64) << 32 ^ (at(2) as u64 & 0xffff_ffff);
        uniform_at(seed, at(0) as u64, key) as f32 * 2.0 - 1.0
    };
    (0..8).map(|i| corner(i) * (0..3).map(|k| if i >> k & 1 == 0 { 1.0 - f[k] } else { f[k] }).product::<f32>()).sum()
}

/// Two octaves of [`smooth`] over features of `wavelength` metres along each axis, about [-1, 1].
pub fn layered(p: &Point3<f32>, wavelength: Vector3<f32>, seed: u64) -> f32 {
    let scaled = Point3::from(p.coords.component_div(&wavelength));
    (smooth(&scaled, seed) + 0.5 * smooth(&(scaled * 2.1), seed ^ 0x5bd1)) / 1.2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_smooth_and_spread() {
        let at = |x: f32| smooth(&Point3::new(x, 0.3, -1.7), 9);
        let values: Vec<f32> = (0..4000).map(|i| at(i as f32 * 0.01 - 20.0)).collect();
        assert!(values.windows(2).all(|w| (w[1] - w[0]).abs() < 0.06));
        assert!(values.iter().any(|&v| v > 0.4) && values.iter().any(|&v| v < -0.4));
        assert!(values.iter().all(|v| v.abs() <= 1.0));
    }
}
