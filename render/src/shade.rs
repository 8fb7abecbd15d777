//! Light on surfaces.

use std::sync::LazyLock;

use nalgebra::Vector3;

/// A sky and ground hemisphere and one key light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lights {
    /// Unit direction that the sky comes from.
    pub up: Vector3<f32>,
    /// Light from the sky, 0..1.
    pub sky: f32,
    /// Light from the ground, 0..1.
    pub ground: f32,
    /// Unit direction towards the key light.
    pub key_direction: Vector3<f32>,
    /// Strength of the key light, 0..1.
    pub key: f32,
}

impl Lights {
    /// A key light over the viewer's left shoulder. `right`, `up` and `back` are the viewer's axes (unit vectors, in the
    /// frame of the normals to be shaded); the sky is world +Y.
    pub fn over_the_shoulder(right: Vector3<f32>, up: Vector3<f32>, back: Vector3<f32>) -> Self {
        let key = back + up * 0.7 - right * 0.6;
        Self {
            up: Vector3::y(),
            sky: 0.52,
            ground: 0.22,
            key_direction: key.try_normalize(1e-6).unwrap_or_else(Vector3::y),
            key: 0.55,
        }
    }

    /// Brightness of a white surface with unit `normal`: about 0..1.
    #[inline]
    pub fn brightness(&self, normal: &Vector3<f32>) -> f32 {
        let sky = 0.5 + 0.5 * normal.dot(&self.up);
        self.ground + (self.sky - self.ground) * sky + self.key * normal.dot(&self.key_direction).max(0.0)
    }
}

static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let s = i as f32 / 255.0;
        if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
    })
});

/// sRGB bytes to linear light 0..1 (IEC 61966-2-1).
#[inline]
pub fn linear(srgb: [u8; 3]) -> [f32; 3] {
    srgb.map(|c| LINEAR[c as usize])
}

/// Linear light to sRGB bytes, clamped.
#[inline]
pub fn srgb(light: [f32; 3]) -> [u8; 3] {
    light.map(|l| {
        let s = if l <= 0.003_130_8 { l * 12.92 } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 };
        (s * 255.0 + 0.5).clamp(0.0, 255.0) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_inverts_linear() {
        for c in 0..=255u8 {
            assert_eq!(srgb(linear([c; 3])), [c; 3]);
        }
    }
}
