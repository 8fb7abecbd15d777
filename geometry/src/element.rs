//! A surface element: depth and normal of one pixel in eight bytes.

/// Bits of the packed normal: x above, then y, then the slant.
pub(crate) const X_SHIFT: u32 = 21;
pub(crate) const Y_SHIFT: u32 = 10;
pub(crate) const Y_MASK: i32 = 0x7FF;
pub(crate) const SLANT_MASK: i32 = 0x3FF;
/// Steps of a normal's coordinate, and of the slant, in one: angles to 0.03°.
pub(crate) const NORMAL_SCALE: f32 = 1023.0;
pub(crate) const SLANT_SCALE: f32 = 511.0;

/// A surface element: depth (metres), its normal · ray of unit depth (the slant, negative towards the camera), and the
/// unit normal's x and y, camera frame. All 0 where depth or normal is missing. Eight bytes, so that the voxels of a
/// block find their pixels in the nearest cache and one load brings all: depth in the lower half.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[repr(transparent)]
pub struct Element(pub(crate) u64);

impl Element {
    /// No surface.
    pub const EMPTY: Self = Self(0);

    /// Packs; the slant must lie within [−2, 0], the normal's coordinates within ±1.
    #[inline]
    pub fn new(depth: f32, slant: f32, [nx, ny]: [f32; 2]) -> Self {
        let whole = |a: f32, scale: f32| (a * scale).round_ties_even() as i32;
        let x = whole(nx, NORMAL_SCALE) << X_SHIFT;
        let y = (whole(ny, NORMAL_SCALE) & Y_MASK) << Y_SHIFT;
        let normal = x | y | (whole(slant, -SLANT_SCALE) & SLANT_MASK);
        Self(u64::from(normal as u32) << 32 | u64::from(depth.to_bits()))
    }

    /// Depth, metres; 0 for an empty element.
    #[inline]
    pub fn depth(self) -> f32 {
        f32::from_bits(self.0 as u32)
    }

    /// True where there is a surface.
    #[inline]
    pub fn is_some(self) -> bool {
        self.0 as u32 != 0
    }

    /// Depth, slant, and the normal's x and y.
    #[inline]
    pub fn parts(self) -> [f32; 4] {
        let normal = (self.0 >> 32) as i32;
        let (x, y) = (normal >> X_SHIFT, normal << (X_SHIFT - Y_SHIFT) >> X_SHIFT);
        let bits = (normal & SLANT_MASK) as f32;
        [self.depth(), bits * (-1.0 / SLANT_SCALE), x as f32 * (1.0 / NORMAL_SCALE), y as f32 * (1.0 / NORMAL_SCALE)]
    }

    /// The normal, where the pixel's ray of unit depth is (x, y, 1).
    #[inline]
    pub fn normal(self, x: f32, y: f32) -> [f32; 3] {
        let [_, slant, nx, ny] = self.parts();
        let rough = slant - nx * x - ny * y;
        // The root of the remainder is finer, but not where it is small.
        let square = 1.0 - nx * nx - ny * ny;
        [nx, ny, if square > 0.1 { square.sqrt().copysign(rough) } else { rough }]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_element_keeps_its_depth_and_its_normal_to_the_steps() {
        for k in 0..2000 {
            let (a, b) = (k as f32 * 0.37, k as f32 * 0.11);
            let n = [a.cos() * b.sin().abs(), a.sin() * b.sin().abs()];
            let slant = -1.9 * b.cos().abs();
            let parts = Element::new(0.5 + a, slant, n).parts();
            assert_eq!(parts[0], 0.5 + a);
            assert!((parts[1] - slant).abs() < 0.501 / SLANT_SCALE, "{parts:?} {slant}");
            assert!((0..2).all(|i| (parts[2 + i] - n[i]).abs() < 0.501 / NORMAL_SCALE), "{parts:?} {n:?}");
        }
        assert_eq!(Element::EMPTY.parts().map(f32::abs), [0.0; 4]);
        assert!(!Element::EMPTY.is_some() && Element::new(1.0, -1.0, [0.0; 2]).is_some());
    }
}
