//! Sixteen floats at a time: AVX-512 or AVX2 where the machine has them, plain arrays elsewhere, chosen at run time.
//!
//! A kernel is written once over [`Lanes`]. Every implementation rounds after each operation and never fuses a
//! multiplication with an addition, so that results are the same to the last bit on every machine.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod scalar;
#[cfg(test)]
mod tests;

pub use scalar::Scalar;

use pulp::{bytemuck::Pod, cast};

use crate::element::Element;

/// Number of lanes.
pub const LANES: usize = 16;

/// Adding 1.5 · 2²³ puts a float's rounded value into its low bits; subtracting it again rounds to nearest even.
const ROUNDER: f32 = 12_582_912.0;

/// Operations on sixteen floats. A value of this type proves that the processor has the instructions.
#[allow(clippy::wrong_self_convention)]
pub trait Lanes: Copy + Send + Sync {
    /// Sixteen floats.
    type F: Pod;
    /// Sixteen Booleans.
    type M: Copy;

    /// Sixteen floats from memory.
    #[inline(always)]
    fn load(self, values: &[f32; LANES]) -> Self::F {
        cast(*values)
    }
    /// Sixteen floats to memory.
    #[inline(always)]
    fn store(self, a: Self::F) -> [f32; LANES] {
        cast(a)
    }
    /// The same value in every lane.
    fn splat(self, value: f32) -> Self::F;
    /// a + b.
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    /// a − b.
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    /// a · b.
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    /// a / b.
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// √a.
    fn sqrt(self, a: Self::F) -> Self::F;
    /// `a` where it is less than `b`, else `b`.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a` where it is greater than `b`, else `b`.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// a ≥ b; false where either is NaN.
    fn ge(self, a: Self::F, b: Self::F) -> Self::M;
    /// a > b; false where either is NaN.
    fn gt(self, a: Self::F, b: Self::F) -> Self::M;
    /// Both.
    fn and(self, a: Self::M, b: Self::M) -> Self::M;
    /// Either.
    fn or(self, a: Self::M, b: Self::M) -> Self::M;
    /// Lane k as bit k.
    fn bits(self, a: Self::M) -> u32;
    /// True where at least one lane is.
    fn any(self, a: Self::M) -> bool;
    /// `a` where the mask is set, else `b`.
    fn select(self, mask: Self::M, a: Self::F, b: Self::F) -> Self::F;
    /// Whole floats from 0 to 2²⁴ as integers.
    fn indices(self, a: Self::F) -> [u32; LANES];
    /// Surface elements from depth, slant, and the normal's x and y.
    fn pack(self, parts: [Self::F; 4]) -> [Element; LANES];
    /// Depth, slant, and the normal's x and y of surface elements, in halves as they are gathered.
    fn unpack(self, elements: [[Element; LANES / 2]; 2]) -> [Self::F; 4];
    /// The four bytes of each value, in halves as they are gathered.
    fn bytes(self, values: [[[u8; 4]; LANES / 2]; 2]) -> [Self::F; 4];
    /// Sixteen signed words as floats.
    fn from_i16(self, values: &[i16; LANES]) -> Self::F;
    /// Sixteen unsigned words as floats.
    fn from_u16(self, values: &[u16; LANES]) -> Self::F;
    /// Rounded to nearest even and saturated; the values must lie within ±2²².
    fn to_i16(self, a: Self::F) -> [i16; LANES];
    /// Rounded to nearest even and saturated; the values must lie within ±2²².
    fn to_u16(self, a: Self::F) -> [u16; LANES];

    /// Rounded to nearest even, for values within ±2²².
    #[inline(always)]
    fn round(self, a: Self::F) -> Self::F {
        let rounder = self.splat(ROUNDER);
        self.sub(self.add(a, rounder), rounder)
    }

    /// Absolute value.
    #[inline(always)]
    fn abs(self, a: Self::F) -> Self::F {
        self.max(a, self.sub(self.splat(0.0), a))
    }

    /// `a` where the mask is set, else 0.
    #[inline(always)]
    fn keep(self, mask: Self::M, a: Self::F) -> Self::F {
        self.select(mask, a, self.splat(0.0))
    }
}

/// A computation that is compiled for every kind of lanes. Lane operations inside closures that are passed on (to
/// `map`, `from_fn`) are not inlined: write them out.
pub trait Kernel {
    /// Its result.
    type Output;

    /// Computes; must be `#[inline(always)]`, with all that it calls per lane.
    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// The values from `at` on, 0 beyond the end of the row.
#[inline(always)]
pub fn group<T: Copy + Default, const N: usize>(row: &[T], at: usize) -> [T; N] {
    match row.get(at..).and_then(|r| r.first_chunk()) {
        Some(whole) => *whole,
        None => std::array::from_fn(|k| row.get(at + k).copied().unwrap_or_default()),
    }
}

/// Writes values from `at` on as far as the row goes.
#[inline(always)]
pub fn put_group<T: Copy>(row: &mut [T], at: usize, values: [T; LANES]) {
    let end = row.len().min(at + LANES);
    row[at..end].copy_from_slice(&values[..end - at]);
}

/// Runs a kernel on the best lanes that this machine has.
#[inline]
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    match pulp::x86::Arch::new() {
        pulp::x86::Arch::V4(simd) => return pulp::Simd::vectorize(simd, Using(avx512::Avx512(simd), kernel)),
        pulp::x86::Arch::V3(simd) => return pulp::Simd::vectorize(simd, Using(avx2::Avx2(simd), kernel)),
        _ => {}
    }
    kernel.run(Scalar)
}

/// A kernel and the lanes that it runs on, called inside a function that is compiled for them.
#[cfg(target_arch = "x86_64")]
struct Using<L, K>(L, K);

#[cfg(target_arch = "x86_64")]
impl<L: Lanes, K: Kernel> pulp::WithSimd for Using<L, K> {
    type Output = K::Output;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> K::Output {
        self.1.run(self.0)
    }
}
